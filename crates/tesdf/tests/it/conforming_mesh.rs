//! The checks of conforming tetrahedral meshes: one mesh that passes, and for each check a mesh
//! that fails this check and no earlier check.
use tesdf::Side;
use tesdf::domain::{Classes, ConformingError, ConformingMesh, MissingFace, TetMesh};
use tesdf::glam::DVec3;
use tesdf::mesh::{SolidMesh, TriangleMesh};

/// Corner `i` of the unit cube. Bits 0, 1, 2 of `i` are x, y, z.
fn corner(i: u32) -> DVec3 {
    DVec3::new((i & 1).into(), (i >> 1 & 1).into(), (i >> 2).into())
}

/// The unit cube as six tetrahedra around the diagonal from 0 to 7.
const CUBE: [[u32; 4]; 6] =
    [[0, 1, 3, 7], [0, 1, 7, 5], [0, 2, 7, 3], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 7, 6]];

fn volume([a, b, c, d]: [DVec3; 4]) -> f64 {
    (b - a).cross(c - a).dot(d - a) / 6.0
}

/// The outer boundary of the tetrahedra, oriented outward.
fn surface(vertices: &[DVec3], tetrahedra: &[[u32; 4]]) -> TriangleMesh {
    let mut faces: Vec<[u32; 3]> = Vec::new();
    for &[a, b, c, d] in tetrahedra {
        let turned = volume([a, b, c, d].map(|v| vertices[v as usize])) < 0.0;
        for [a, b, c] in [[b, c, d], [a, d, c], [a, b, d], [a, c, b]] {
            let face = if turned { [a, c, b] } else { [a, b, c] };
            let same = |other: &[u32; 3]| face.iter().all(|v| other.contains(v));
            match faces.iter().position(same) {
                Some(at) => drop(faces.remove(at)),
                None => faces.push(face),
            }
        }
    }
    TriangleMesh::new(vertices.to_vec(), faces).unwrap()
}

fn cube_vertices() -> Vec<DVec3> {
    (0..8).map(corner).collect()
}

fn cube() -> SolidMesh {
    SolidMesh::new(surface(&cube_vertices(), &CUBE)).unwrap()
}

/// The cube with a shell of tetrahedra around it. Each face is joined by a prism to its copy on the
/// cube [-1, 2]^3.
fn cube_in_a_box() -> (Vec<DVec3>, Vec<[u32; 4]>) {
    let inner = cube_vertices();
    let mut vertices = inner.clone();
    vertices.extend(inner.iter().map(|&p| 3.0 * p - 1.0));
    let mut tetrahedra = CUBE.to_vec();
    for &face in surface(&inner, &CUBE).faces() {
        // Prisms are cut by ascending ids, so that neighbours agree on the diagonal of the side
        // that they share.
        let [mut a, mut b, mut c] = face;
        if a > b {
            std::mem::swap(&mut a, &mut b)
        }
        if b > c {
            std::mem::swap(&mut b, &mut c)
        }
        if a > b {
            std::mem::swap(&mut a, &mut b)
        }
        tetrahedra.extend([[a, b, c, c + 8], [a, b, b + 8, c + 8], [a, a + 8, b + 8, c + 8]]);
    }
    (vertices, tetrahedra)
}

fn conform(
    solid: &SolidMesh,
    vertices: Vec<DVec3>,
    tetrahedra: Vec<[u32; 4]>,
) -> Result<ConformingMesh, ConformingError> {
    ConformingMesh::new(solid, &TetMesh::new(vertices, tetrahedra).unwrap())
}

#[test]
fn a_cube_conforms() {
    let solid = cube();
    let mesh = conform(&solid, cube_vertices(), CUBE.to_vec()).unwrap();
    assert_eq!(mesh.vertices(), solid.mesh().vertices());
    assert_eq!(mesh.sides(), [Side::Inside; 6]);
    let expected = Classes { surface_vertices: 8, boundary_inner_tetrahedra: 6, ..Classes::default() };
    assert_eq!(mesh.classes(), expected);
    for t in 0..6 {
        assert_eq!(volume(mesh.corners(t)), 1.0 / 6.0);
    }
}

/// Negatively oriented corners, vertices in another order, duplicate and unused vertices, -0
/// instead of 0.
#[test]
fn vertices_are_matched_by_position() {
    let solid = cube();
    let mut vertices = vec![DVec3::splat(9.0)];
    vertices.extend(cube_vertices().into_iter().rev().map(|p| if p == DVec3::ZERO { -p } else { p }));
    vertices.push(corner(7));
    let tetrahedra: Vec<_> = CUBE
        .iter()
        .enumerate()
        .map(|(t, c)| c.map(|v| if v == 7 && t % 2 == 0 { 9 } else { 8 - v }))
        .collect();
    let turned: Vec<_> = tetrahedra.iter().map(|&[a, b, c, d]| [b, a, c, d]).collect();
    for tetrahedra in [tetrahedra, turned] {
        let mesh = conform(&solid, vertices.clone(), tetrahedra).unwrap();
        assert_eq!(mesh.vertices(), solid.mesh().vertices());
        assert!(mesh.vertices()[0].to_array().iter().all(|x| x.is_sign_positive()));
        for (t, corners) in CUBE.iter().enumerate() {
            let mut found = mesh.tetrahedra()[t];
            found.sort_unstable();
            let mut expected = *corners;
            expected.sort_unstable();
            assert_eq!(found, expected);
            assert!(volume(mesh.corners(t)) > 0.0);
        }
    }
}

#[test]
fn an_outer_region_is_outside() {
    let (vertices, tetrahedra) = cube_in_a_box();
    let mesh = conform(&cube(), vertices.clone(), tetrahedra.clone()).unwrap();
    assert!(mesh.sides()[..6].iter().all(|&s| s == Side::Inside));
    assert!(mesh.sides()[6..].iter().all(|&s| s == Side::Outside));
    let expected = Classes {
        surface_vertices: 8,
        outer_vertices: 8,
        boundary_inner_tetrahedra: 6,
        boundary_outer_tetrahedra: 36,
        ..Classes::default()
    };
    assert_eq!(mesh.classes(), expected);
    // A part of an outer region is also an outer region.
    let part = conform(&cube(), vertices, tetrahedra[..20].to_vec()).unwrap();
    assert_eq!(part.sides(), &mesh.sides()[..20]);
}

/// A box inside a box, both oriented outward. The inner box has the winding number 2, so it is
/// inside too.
#[test]
fn winding_numbers_above_one_are_inside() {
    let (vertices, tetrahedra) = cube_in_a_box();
    let mut faces = surface(&vertices[..8], &CUBE).faces().to_vec();
    faces.extend(surface(&vertices, &tetrahedra).faces());
    let solid = SolidMesh::new(TriangleMesh::new(vertices.clone(), faces).unwrap()).unwrap();
    let mesh = conform(&solid, vertices, tetrahedra).unwrap();
    assert!(mesh.sides().iter().all(|&s| s == Side::Inside));
}

/// The same with the inner box oriented inward: a cavity. It may have tetrahedra, but need not.
#[test]
fn a_cavity_is_outside() {
    let (vertices, tetrahedra) = cube_in_a_box();
    let mut faces: Vec<_> =
        surface(&vertices[..8], &CUBE).faces().iter().map(|&[a, b, c]| [a, c, b]).collect();
    faces.extend(surface(&vertices, &tetrahedra).faces());
    let solid = SolidMesh::new(TriangleMesh::new(vertices.clone(), faces).unwrap()).unwrap();
    let mesh = conform(&solid, vertices.clone(), tetrahedra.clone()).unwrap();
    assert!(mesh.sides()[..6].iter().all(|&s| s == Side::Outside));
    assert!(mesh.sides()[6..].iter().all(|&s| s == Side::Inside));
    let without = conform(&solid, vertices, tetrahedra[6..].to_vec()).unwrap();
    assert_eq!(without.sides(), &mesh.sides()[6..]);
}

#[test]
fn coordinates_out_of_range_are_refused() {
    let mut vertices = cube_vertices();
    vertices[3].z = 1e-95;
    let error = conform(&cube(), vertices, CUBE.to_vec()).unwrap_err();
    assert_eq!(error, ConformingError::OutOfRange { vertex: 3, axis: 'z', value: 1e-95 });
}

#[test]
fn a_missing_surface_vertex_is_refused() {
    let mut vertices = cube_vertices();
    vertices[6].y += 1e-9;
    let error = conform(&cube(), vertices, CUBE.to_vec()).unwrap_err();
    let ConformingError::VertexMissing { missing: 1, of: 8, vertex: 6, position, distance } = error else {
        panic!("{error}")
    };
    assert_eq!(position, corner(6));
    assert!((distance - 1e-9).abs() < 1e-15);
}

#[test]
fn flat_tetrahedra_are_refused() {
    let mut tetrahedra = CUBE.to_vec();
    tetrahedra.insert(2, [0, 1, 3, 2]);
    let error = conform(&cube(), cube_vertices(), tetrahedra).unwrap_err();
    let expected =
        ConformingError::Flat { flat: 1, of: 7, tetrahedron: 2, position: DVec3::new(0.5, 0.5, 0.0) };
    assert_eq!(error, expected);
}

#[test]
fn triangles_of_too_many_tetrahedra_are_refused() {
    let mut vertices = cube_vertices();
    let mut tetrahedra = CUBE.to_vec();
    tetrahedra.push(CUBE[4]);
    let error = conform(&cube(), vertices.clone(), tetrahedra.clone()).unwrap_err();
    assert!(
        matches!(error, ConformingError::Overfull { users: 3, .. } | ConformingError::SameSide { .. }),
        "{error}"
    );

    // A tetrahedron on face 0 1 3, on its wrong side: inside the cube.
    vertices.push(DVec3::new(0.6, 0.3, 0.25));
    tetrahedra[6] = [0, 1, 3, 8];
    let error = conform(&cube(), vertices.clone(), tetrahedra.clone()).unwrap_err();
    assert!(matches!(error, ConformingError::SameSide { tetrahedra: [0, 6], .. }), "{error}");

    // A tetrahedron on a triangle that already has two.
    tetrahedra[6] = [0, 1, 7, 8];
    let error = conform(&cube(), vertices, tetrahedra).unwrap_err();
    assert!(matches!(error, ConformingError::Overfull { users: 3, tetrahedra: [0, 1], .. }), "{error}");
}

#[test]
fn missing_surface_faces_are_refused() {
    // The cube with the centre of its side z = 0 as an additional vertex. Four tetrahedra around it
    // form a fan to vertex 7.
    let mut vertices = cube_vertices();
    vertices.push(DVec3::new(0.5, 0.5, 0.0));
    let mut tetrahedra = vec![[8, 1, 3, 7], [8, 0, 1, 7], [8, 3, 2, 7], [8, 2, 0, 7]];
    tetrahedra.extend([CUBE[1], CUBE[3], CUBE[4], CUBE[5]]);
    let error = conform(&cube(), vertices, tetrahedra).unwrap_err();
    let expected = ConformingError::FaceMissing {
        missing: 2,
        of: 12,
        face: match error {
            ConformingError::FaceMissing { face, .. } => face,
            _ => panic!("{error}"),
        },
        reason: MissingFace::Split { vertex: 8 },
    };
    assert_eq!(error, expected);

    // Five tetrahedra, mirrored, use the other diagonal of the side z = 0, so they do not fit.
    let five = vec![[0, 3, 5, 6], [1, 0, 3, 5], [2, 0, 6, 3], [4, 0, 5, 6], [7, 3, 6, 5]];
    let error = conform(&cube(), cube_vertices(), five).unwrap_err();
    let recut = MissingFace::Recut;
    assert!(matches!(error, ConformingError::FaceMissing { ref reason, .. } if *reason == recut), "{error}");
}

#[test]
fn a_face_without_area() {
    // The edge from 0 to 1 is opened into a slit, closed by a face without area.
    let mut vertices = cube_vertices();
    vertices.push(DVec3::new(0.5, 0.0, 0.0));
    let mut faces = surface(&cube_vertices(), &CUBE).faces().to_vec();
    let edge = |f: &[u32; 3]| (0..3).any(|k| [f[k], f[(k + 1) % 3]] == [0, 1]);
    let at = faces.iter().position(edge).unwrap();
    let apex = *faces[at].iter().find(|&&v| v > 1).unwrap();
    faces.splice(at..=at, [[0, 8, apex], [8, 1, apex], [0, 1, 8]]);
    let flat = at + 2;
    let solid = SolidMesh::new(TriangleMesh::new(vertices.clone(), faces).unwrap()).unwrap();
    let mut tetrahedra = CUBE.to_vec();
    for t in 0..6 {
        if CUBE[t].contains(&0) && CUBE[t].contains(&1) {
            tetrahedra.push(CUBE[t].map(|v| if v == 0 { 8 } else { v }));
            tetrahedra[t] = CUBE[t].map(|v| if v == 1 { 8 } else { v });
        }
    }
    let error = conform(&solid, vertices, tetrahedra).unwrap_err();
    assert_eq!(error, ConformingError::FaceWithoutArea { face: flat });
}

#[test]
fn holes_and_an_empty_inside_are_refused() {
    // A solid cube made of tetrahedra around a vertex at its centre conforms.
    let mut vertices = cube_vertices();
    vertices.push(DVec3::splat(0.5));
    let shell: Vec<_> =
        surface(&cube_vertices(), &CUBE).faces().iter().map(|&[a, b, c]| [a, b, c, 8]).collect();
    assert!(conform(&cube(), vertices.clone(), shell.clone()).is_ok());
    // An empty hole that touches no face of the surface: the small cube in the middle is left out.
    let (boxed, tetrahedra) = cube_in_a_box();
    let outside = surface(&boxed, &tetrahedra);
    let solid = SolidMesh::new(TriangleMesh::new(boxed.clone(), outside.faces().to_vec()).unwrap()).unwrap();
    assert!(conform(&solid, boxed.clone(), tetrahedra.clone()).is_ok());
    let error = conform(&solid, boxed.clone(), tetrahedra[6..].to_vec()).unwrap_err();
    assert!(matches!(error, ConformingError::InsideOpen { .. }), "{error}");

    // Tetrahedra only around the cube, none inside it.
    let error = conform(&cube(), boxed, tetrahedra[6..].to_vec()).unwrap_err();
    assert!(matches!(error, ConformingError::InsideEmpty { winding: 1, .. }), "{error}");
}

/// Of two connected outer tetrahedra, the larger lies in the cube. So the smaller one, which lies
/// on a face, is labelled inside too.
#[test]
fn equal_labels_on_both_sides_of_a_face_are_refused() {
    let mut vertices = cube_vertices();
    vertices.extend([DVec3::new(-0.1, 0.5, -0.2), DVec3::new(3.0, 0.5, 1.0)]);
    let mut tetrahedra = CUBE.to_vec();
    tetrahedra.extend([[0, 2, 6, 8], [0, 2, 8, 9]]);
    let error = conform(&cube(), vertices, tetrahedra).unwrap_err();
    assert!(matches!(error, ConformingError::Labels { windings: [1, 1], .. }), "{error}");
}

#[test]
fn a_tetrahedron_without_an_inner_point_is_refused() {
    let mut vertices = cube_vertices();
    let (at, next) = (5.0, 5f64.next_up());
    vertices.extend([(at, at, at), (next, at, at), (at, next, at), (at, at, next)].map(DVec3::from));
    let mut tetrahedra = CUBE.to_vec();
    tetrahedra.push([8, 9, 10, 11]);
    let error = conform(&cube(), vertices, tetrahedra).unwrap_err();
    assert_eq!(error, ConformingError::NoSeed { tetrahedron: 6 });
}

/// Two tetrahedra that touch no face of the surface and do not share a face, but lie in the same
/// place.
#[test]
fn overlapping_tetrahedra_are_refused() {
    let far = |shift: f64| {
        [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z].map(|p| p + DVec3::splat(5.0) + shift * DVec3::ONE)
    };
    let with = |others: &[[DVec3; 4]]| {
        let mut vertices = cube_vertices();
        let mut tetrahedra = CUBE.to_vec();
        for other in others {
            let n = vertices.len() as u32;
            vertices.extend(other);
            tetrahedra.push([n, n + 1, n + 2, n + 3]);
        }
        conform(&cube(), vertices, tetrahedra)
    };
    assert!(with(&[far(0.0), far(3.0)]).is_ok());
    // They cross.
    let error = with(&[far(0.0), far(0.1)]).unwrap_err();
    assert!(
        matches!(error, ConformingError::Overlap { ref found, .. } if found.contains("tetrahedra 6 and 7")),
        "{error}"
    );
    // One contains the other.
    let [a, b, c, d] = far(0.0);
    let m = 0.25 * (a + b + c + d);
    let error = with(&[[a, b, c, d], [a, b, c, d].map(|p| m + 0.25 * (p - m))]).unwrap_err();
    assert!(
        matches!(error, ConformingError::Overlap { ref found, .. } if found.contains("twice")),
        "{error}"
    );
    // They meet in a part of a triangle.
    let below = [a, b, c].map(|p| a + 0.5 * (p - a));
    let error = with(&[[a, b, c, d], [below[0], below[1], below[2], a - DVec3::Z]]).unwrap_err();
    assert!(
        matches!(error, ConformingError::Overlap { ref found, .. } if found.contains("meets itself")),
        "{error}"
    );
    // One lies in the solid. It is not connected to the inside, but has its winding number.
    let error = with(&[far(0.0).map(|p| 0.1 * (p - 5.0) + DVec3::new(0.5, 0.2, 0.1))]).unwrap_err();
    assert!(matches!(error, ConformingError::InsideOpen { tetrahedron: 6, .. }), "{error}");
}

#[test]
fn messages_name_the_failed_check_its_place_and_the_next_step() {
    let mut vertices = cube_vertices();
    vertices[6].y += 1e-9;
    let error = conform(&cube(), vertices, CUBE.to_vec()).unwrap_err().to_string();
    assert!(error.starts_with("surface vertices: 1 of 8") && error.contains("17 digits"), "{error}");
    let error =
        conform(&cube(), cube_vertices(), vec![[0, 1, 2, 3], [4, 5, 6, 7], CUBE[0]]).unwrap_err().to_string();
    assert!(error.starts_with("orientation: 2 of 3") && error.contains("tetrahedron 0"), "{error}");
}
