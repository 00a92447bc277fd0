//! Shapes of links.
use std::sync::Arc;

use tesdf::base::Inside;
use tesdf::collide::Shape;
use tesdf::encode::{EncodeError, Encoder, Preset};
use tesdf::mesh::{RepairMode, SolidMesh};
use tesdf::{Progress, TeSdf};

use super::error::PlanningError;
use crate::robot::Geometry;
use crate::scene_file::{AssetCache, PartSection, joined};

/// The shape of a geometry of a link, in its frame.
///
/// # Errors
/// A mesh that cannot be read or encoded.
pub(super) fn shape_of(
    link: &str,
    geometry: &Geometry,
    repair: RepairMode,
    assets: Option<&AssetCache>,
    progress: &Progress,
) -> Result<Shape, PlanningError> {
    let (file, scale) = match geometry {
        &Geometry::Box { half_extents } => return Ok(Shape::Box { half_extents }),
        &Geometry::Sphere { radius } => return Ok(Shape::Sphere { radius }),
        &Geometry::Capsule { half_height, radius } => return Ok(Shape::Capsule { half_height, radius }),
        &Geometry::Cylinder { half_height, radius } => return Ok(Shape::Cylinder { half_height, radius }),
        Geometry::Mesh { file, scale } => (file, scale),
    };
    let part = PartSection {
        mesh: Some(file.clone()),
        shape: None,
        scale: scale.to_array(),
        translation: [0.0; 3],
        rotation: [0.0, 0.0, 0.0, 1.0],
        pose: None,
    };
    let refused = |reason: String| PlanningError::Robot(format!("the link {link}: {reason}"));
    let (mesh, inside): (_, Inside) = joined(&|file| file.to_path_buf(), &[part], repair).map_err(refused)?;
    let encode = || -> Result<TeSdf, PlanningError> {
        let solid = SolidMesh::with_repair(mesh.clone(), inside, RepairMode::Never);
        let solid = solid.map_err(|e| refused(e.to_string()))?.0;
        let encoder = Encoder::new().preset(Preset::Fast).inside(inside).progress(progress);
        encoder.encode(&solid).map_err(|e| match e {
            EncodeError::Cancelled => PlanningError::Cancelled,
            e => refused(e.to_string()),
        })
    };
    let asset = match assets {
        Some(assets) => assets.of_mesh(link, &mesh, inside, encode)?,
        None => encode()?,
    };
    Ok(Shape::Mesh(Arc::new(asset)))
}
