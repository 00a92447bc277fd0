//! The collision meshes of an MJCF file.
use std::path::Path;

use crate::terminal::report::Failure;
use mjcf_rs::Model;
use mjcf_rs::body::{Geom, GeomType};
use tesdf::glam::{DAffine3, DQuat, DVec3};
use tesdf_sim::robot::expand;

use super::MeshUse;
use crate::encode_all::meshes::Use;

/// All uses of meshes by geoms that can touch others, in the order of the bodies.
///
/// # Errors
/// The file cannot be read or is no MJCF.
pub(super) fn uses(path: &Path) -> Result<Vec<MeshUse>, Failure> {
    let at = |found: &dyn std::fmt::Display| Failure::new(format!("{}: {found}", path.display()));
    let folder = path.parent().unwrap_or(Path::new(""));
    let model = Model::from_str(&expand(path).map_err(Failure::new)?, folder).map_err(|e| at(&e))?;
    let mut found = Vec::new();
    for (b, body) in model.bodies.iter().enumerate() {
        let body = &body.body;
        for (g, geom) in body.geoms.iter().enumerate().filter(|(_, geom)| is_collision_mesh(geom)) {
            let name = geom.mesh.as_deref().unwrap_or_default();
            let used_by = Use::Mjcf {
                body: body
                    .name
                    .clone()
                    .unwrap_or_else(|| if b == 0 { "world".into() } else { b.to_string() }),
                geom: geom.name.clone().unwrap_or_else(|| g.to_string()),
            };
            let Some(mesh) = model.assets.mesh(name) else {
                return Err(at(&format!("a geom uses the mesh '{name}', which <asset> does not have")));
            };
            let scale = DVec3::from_array(mesh.scale);
            if !(scale.is_finite() && scale.cmpne(DVec3::ZERO).all()) {
                return Err(at(&format!(
                    "the mesh '{name}' has the scale {scale}; expected numbers other than 0"
                )));
            }
            let file = model.resolve_mesh_file(mesh, folder);
            found.push(MeshUse {
                reference: mesh.file.clone().unwrap_or_else(|| name.to_owned()),
                path: file.ok_or_else(|| {
                    format!("{name}: its vertices are in the MJCF file, which is not read; write them to an OBJ file")
                }),
                scale,
                pose: pose(mesh, scale),
                used_by,
            });
        }
    }
    Ok(found)
}

/// Whether a geom is a mesh, and no picture alone: MuJoCo's way to say that is to let it touch
/// nothing.
fn is_collision_mesh(geom: &Geom) -> bool {
    let is_mesh = matches!(geom.type_, GeomType::Mesh | GeomType::Sdf);
    is_mesh && geom.mesh.is_some() && (geom.contype != 0 || geom.conaffinity != 0)
}

/// MuJoCo subtracts `refpos`, rotates by the inverse of `refquat`, and then scales.
fn pose(mesh: &mjcf_rs::assets::Mesh, scale: DVec3) -> DAffine3 {
    let (p, q) = (mesh.refpose.translation, mesh.refpose.rotation);
    let reference = DAffine3::from_translation(-DVec3::new(p.x, p.y, p.z));
    let rotation = DQuat::from_xyzw(q.x, q.y, q.z, q.w).normalize();
    if rotation == DQuat::IDENTITY && reference == DAffine3::IDENTITY {
        return DAffine3::from_scale(scale);
    }
    DAffine3::from_scale(scale) * DAffine3::from_quat(rotation.inverse()) * reference
}
