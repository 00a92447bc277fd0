//! Divides meshes into objects, or into connected components with their cavities.
use tesdf::glam::DVec3;
use tesdf::mesh::{LoadedMesh, MeshFormat, NamedMesh, SolidMesh, read_bytes, split};

const OUTWARD: [[i32; 3]; 4] = [[-4, -2, -3], [-4, -3, -1], [-3, -2, -1], [-2, -4, -1]];

/// A tetrahedron of this size at `at`, or its inside-out copy if the size is negative.
fn tetrahedron(at: DVec3, size: f64) -> String {
    let step = size.abs();
    let mut text = String::new();
    for p in [at, at + DVec3::X * step, at + DVec3::Y * step, at + DVec3::Z * step] {
        text += &format!("v {} {} {}\n", p.x, p.y, p.z);
    }
    for [a, b, c] in OUTWARD {
        text += &if size > 0.0 { format!("f {a} {b} {c}\n") } else { format!("f {a} {c} {b}\n") };
    }
    text
}

fn obj(text: &str) -> LoadedMesh {
    read_bytes(text.as_bytes(), MeshFormat::Obj).unwrap()
}

fn names(parts: &[NamedMesh]) -> Vec<&str> {
    parts.iter().map(|part| part.name.as_str()).collect()
}

#[test]
fn obj_has_objects_or_groups_and_a_name_that_returns_continues_its_object() {
    let [a, b, c] = [0.0, 2.0, 4.0].map(|x| tetrahedron(DVec3::X * x, 1.0));
    let parts = split(&obj(&format!("g body\no left one\n{a}g other\no right\n{b}o left one\n{c}o empty\n")));
    assert_eq!(names(&parts), ["left one", "right"]);
    assert_eq!(parts.iter().map(|part| part.mesh.faces().len()).collect::<Vec<_>>(), [8, 4]);
    // Faces before the first object belong to none.
    let parts = split(&obj(&format!("{a}g x\n{b}g y z\n{c}")));
    assert_eq!(names(&parts), ["x", "y z", ""]);
    assert_eq!(parts[2].mesh.vertices()[1], DVec3::X);
    // Polygons become several triangles.
    let quads = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    let parts = split(&obj(&format!("o a\n{quads}f 1 2 3 4\no b\nf 4 3 2 1\nf 1 2 3\n")));
    assert_eq!(parts.iter().map(|part| part.mesh.faces().len()).collect::<Vec<_>>(), [2, 3]);
}

#[test]
fn stl_has_solids() {
    let facet = "facet normal 0 0 0 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 0 endloop endfacet";
    let text = format!("solid one two\n{facet}\nendsolid one two\nsolid b\n{facet}\n{facet}\nendsolid\n");
    let loaded = read_bytes(text.as_bytes(), MeshFormat::Stl).unwrap();
    assert_eq!(names(&split(&loaded)), ["one two", "b"]);
}

#[test]
fn components_keep_their_cavities() {
    let inner = DVec3::splat(0.5);
    let text = [
        tetrahedron(DVec3::ZERO, 10.0),
        tetrahedron(DVec3::X * 20.0, 1.0),
        // A cavity, and a solid within the cavity that has a cavity of its own.
        tetrahedron(inner, -8.0),
        tetrahedron(inner * 2.0, 6.0),
        tetrahedron(inner * 2.5, -1.0),
    ]
    .concat();
    let parts = split(&obj(&text));
    assert_eq!(names(&parts), ["1", "2", "3"]);
    assert_eq!(parts.iter().map(|part| part.mesh.faces().len()).collect::<Vec<_>>(), [8, 4, 8]);
    parts.into_iter().for_each(|part| drop(SolidMesh::new(part.mesh).unwrap()));
}

#[test]
fn solids_that_touch_along_an_edge_are_two() {
    // They share the edge from (0, 0, 0) to (0, 0, 1).
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv -1 0 0\nv 0 -1 0\n\
                f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\nf 1 6 5\nf 1 5 4\nf 5 6 4\nf 6 1 4\n";
    let parts = split(&obj(text));
    assert_eq!(parts.iter().map(|part| part.mesh.faces().len()).collect::<Vec<_>>(), [4, 4]);
}
