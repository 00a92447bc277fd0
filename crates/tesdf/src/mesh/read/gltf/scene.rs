//! Finds the meshes that a glTF file shows, with their poses.
use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf_json as json;

use super::{MeshFormat, ReadError, decimal, decimals, fault};

/// A mesh at a place in the scene.
pub(super) struct Instance {
    pub mesh: usize,
    /// The node that places it. `None` in a file without nodes.
    pub node: Option<usize>,
    pub pose: DAffine3,
}

/// Meshes with their poses, in the depth-first order of their nodes.
pub(super) fn instances(root: &json::Root, format: MeshFormat) -> Result<Vec<Instance>, ReadError> {
    if root.nodes.is_empty() {
        let alone = |mesh| Instance { mesh, node: None, pose: DAffine3::IDENTITY };
        return Ok((0..root.meshes.len()).map(alone).collect());
    }
    let scene = root.scene.map_or(0, |scene| scene.value());
    let roots: Vec<usize> = match root.scenes.get(scene) {
        Some(scene) => scene.nodes.iter().map(|n| n.value()).collect(),
        None => {
            let mut is_child = vec![false; root.nodes.len()];
            for child in root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
                is_child[child.value()] = true;
            }
            (0..root.nodes.len()).filter(|&i| !is_child[i]).collect()
        }
    };
    let mut found = Vec::new();
    let mut seen = vec![false; root.nodes.len()];
    let mut stack: Vec<_> = roots.into_iter().rev().map(|node| (node, DAffine3::IDENTITY)).collect();
    while let Some((i, parent)) = stack.pop() {
        if std::mem::replace(&mut seen[i], true) {
            let found = "the node is reached twice";
            return Err(fault(
                format,
                format!("nodes[{i}]"),
                found,
                "nodes must form trees: export the file again",
            ));
        }
        let node = &root.nodes[i];
        let local = local_pose(node);
        let pose = parent * local;
        let size = pose.matrix3.determinant();
        if node.mesh.is_some() && (size == 0.0 || !size.is_finite()) {
            let found = format!("the transform's determinant is {size}");
            return Err(fault(
                format,
                format!("nodes[{i}]"),
                found,
                "expected one that keeps the mesh a volume",
            ));
        }
        found.extend(node.mesh.map(|mesh| Instance { mesh: mesh.value(), node: Some(i), pose }));
        stack.extend(node.children.iter().flatten().rev().map(|child| (child.value(), pose)));
    }
    Ok(found)
}

fn local_pose(node: &json::Node) -> DAffine3 {
    if let Some(columns) = node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(&columns.map(decimal)));
    }
    let scale = node.scale.map_or(DVec3::ONE, decimals);
    let translation = node.translation.map_or(DVec3::ZERO, decimals);
    // After rounding to f32, it is not exactly a unit quaternion.
    let rotation = node.rotation.map_or(DQuat::IDENTITY, |q| DQuat::from_array(q.0.map(decimal)).normalize());
    DAffine3::from_scale_rotation_translation(scale, rotation, translation)
}
