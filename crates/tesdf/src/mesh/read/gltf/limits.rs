//! Limits the total size of all mesh instances: a file of some kilobytes can show a mesh any number
//! of times.
use gltf_json::mesh::{Mesh, Mode, Semantic};
use gltf_json::validation::Checked;

use super::buffers::Data;
use super::{ReadError, fault};

/// Largest number of vertices, and of face corners, of all instances together. The encoder accepts
/// fewer.
const MAX_ELEMENTS: usize = 1 << 27;

/// Refuses a scene with too many vertices or face corners. `meshes` has the mesh of each instance.
pub(super) fn check(data: &Data<'_>, meshes: impl Iterator<Item = usize>) -> Result<(), ReadError> {
    let elements: Vec<_> = data.root.meshes.iter().map(|mesh| elements(data, mesh)).collect();
    let mut sums = [0_usize; 2];
    for mesh in meshes {
        for ((sum, more), what) in sums.iter_mut().zip(elements[mesh]).zip(["vertices", "corners of faces"]) {
            *sum = sum.saturating_add(more);
            if *sum > MAX_ELEMENTS {
                let found = format!("with this instance of it the scene has {sum} {what}");
                let help = format!("expected at most {MAX_ELEMENTS}: split the scene");
                return Err(fault(data.format, format!("meshes[{mesh}]"), found, help));
            }
        }
    }
    Ok(())
}

/// Numbers of vertices and of face corners in one instance of a mesh.
fn elements(data: &Data<'_>, mesh: &Mesh) -> [usize; 2] {
    let bytes = data.buffers.iter().map(|buffer| buffer.len()).sum();
    // A count that exceeds the bytes is refused later, when the values are read.
    let count = |accessor: usize| {
        let count = data.root.accessors.get(accessor).map_or(0, |accessor| accessor.count.0);
        usize::try_from(count).unwrap_or(usize::MAX).min(bytes)
    };
    let mut sums = [0_usize; 2];
    for primitive in &mesh.primitives {
        let positions = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
        let vertices = positions.map_or(0, |accessor| count(accessor.value()));
        let indices = primitive.indices.map_or(vertices, |accessor| count(accessor.value()));
        // A strip or a fan has a face for each index but two.
        let corners = if primitive.mode == Checked::Valid(Mode::Triangles) {
            indices
        } else {
            indices.saturating_mul(3)
        };
        sums = [sums[0].saturating_add(vertices), sums[1].saturating_add(corners)];
    }
    sums
}
