//! Meshes for the tests.
use std::path::Path;

use tesdf::TeSdf;
use tesdf::collide::Shape;
use tesdf::encode::{Encoder, Preset};
use tesdf::mesh::{LoadedMesh, MeshFormat, SolidMesh, read, read_bytes};
use tesdf_sim::MassProperties;

/// A cube whose edges have the length 2 · `half`, centred on the origin.
pub fn cube(half: f64) -> TeSdf {
    let mut obj = String::new();
    for corner in 0..8 {
        let sign = |bit: u32| if corner >> bit & 1 == 1 { half } else { -half };
        obj += &format!("v {} {} {}\n", sign(0), sign(1), sign(2));
    }
    for [a, b, c, d] in [[1, 3, 4, 2], [5, 6, 8, 7], [1, 2, 6, 5], [3, 7, 8, 4], [1, 5, 7, 3], [2, 4, 8, 6]] {
        obj += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
    }
    encoded(read_bytes(obj.as_bytes(), MeshFormat::Obj).expect("an OBJ"))
}

/// The encoded mesh `name` of `data/procedural`.
pub fn data(name: &str) -> TeSdf {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../data/procedural/{name}.obj"));
    encoded(read(&path).expect("a mesh"))
}

fn encoded(loaded: LoadedMesh) -> TeSdf {
    let solid = SolidMesh::new(loaded.mesh).expect("closed");
    Encoder::new().preset(Preset::Fast).encode(&solid).expect("encoded")
}

/// Mass properties of a shape of steel.
pub fn steel(shape: &Shape) -> MassProperties {
    MassProperties::of_shape(shape, 1.0, 7850.0).expect("a volume")
}
