//! The collision meshes of a URDF file.
use std::path::{Path, PathBuf};

use crate::terminal::report::Failure;
use tesdf::glam::DAffine3;
use tesdf_sim::robot::{Packages, mesh_reference, parse, read};

use super::MeshUse;
use crate::encode_all::meshes::Use;

/// All uses of meshes by `<collision>` elements, in the order of the file.
///
/// # Errors
/// The file cannot be read or is no URDF, or a mesh has no file name or no valid scale.
pub(super) fn uses(path: &Path, named: &[(String, PathBuf)]) -> Result<Vec<MeshUse>, Failure> {
    let text = read(path).map_err(Failure::new)?;
    let document = parse(path, &text).map_err(Failure::new)?;
    let robot = document.root_element();
    let at = |node: roxmltree::Node<'_, '_>| {
        format!("{}, line {}", path.display(), document.text_pos_at(node.range().start).row)
    };
    if !robot.has_tag_name("robot") {
        let found = robot.tag_name().name();
        return Err(Failure::new(format!("{}: found <{found}>; expected <robot> of URDF", at(robot))));
    }
    let packages = Packages::new(path, named);
    let mut found = Vec::new();
    for link in robot.children().filter(|node| node.has_tag_name("link")) {
        let name = link.attribute("name").unwrap_or_default();
        let collisions = link.children().filter(|node| node.has_tag_name("collision"));
        for (i, collision) in collisions.enumerate() {
            let mesh = collision
                .children()
                .filter(|node| node.has_tag_name("geometry"))
                .flat_map(|node| node.children())
                .find(|node| node.has_tag_name("mesh"));
            let Some(mesh) = mesh else { continue };
            let (reference, scale) = mesh_reference(path, &document, mesh).map_err(Failure::new)?;
            found.push(MeshUse {
                reference: reference.to_owned(),
                path: packages.resolve(reference),
                scale,
                pose: DAffine3::from_scale(scale),
                used_by: Use::Urdf {
                    link: name.to_owned(),
                    collision: collision.attribute("name").map_or_else(|| i.to_string(), str::to_owned),
                },
            });
        }
    }
    Ok(found)
}
