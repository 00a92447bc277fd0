//! Masses of geometries, for descriptions that leave them to the density.
use glam::{DMat3, DVec3};
use tesdf::collide::{Pose, Shape};
use tesdf::input;

use super::{Collision, Geometry};
use crate::{MassError, MassProperties};

/// Mass, centre and inertia of a geometry of density 1, in the frame in which it has its pose.
///
/// # Errors
/// It cannot be read, or has no volume.
pub(super) fn of_density_one(Collision { pose, geometry }: &Collision) -> Result<MassProperties, String> {
    let told = |e: MassError| e.to_string();
    let own = match geometry {
        &Geometry::Box { half_extents } => {
            MassProperties::of_shape(&Shape::Box { half_extents }, 1.0, 1.0).map_err(told)?
        }
        &Geometry::Sphere { radius } => {
            MassProperties::of_shape(&Shape::Sphere { radius }, 1.0, 1.0).map_err(told)?
        }
        &Geometry::Capsule { half_height, radius } => {
            MassProperties::of_shape(&Shape::Capsule { half_height, radius }, 1.0, 1.0).map_err(told)?
        }
        &Geometry::Cylinder { half_height, radius } => {
            MassProperties::of_shape(&Shape::Cylinder { half_height, radius }, 1.0, 1.0).map_err(told)?
        }
        Geometry::Mesh { file, scale } => {
            input::check_regular(file).map_err(|e| format!("{}: {e}", file.display()))?;
            let mesh = tesdf::mesh::read(file).map_err(|e| e.in_file(file))?.mesh;
            let mirrored = scale.x * scale.y * scale.z < 0.0;
            let triangle = |face: usize| {
                let [a, b, c] = mesh.triangle(face).map(|p| *scale * p);
                if mirrored { [a, c, b] } else { [a, b, c] }
            };
            let found = MassProperties::of_triangles((0..mesh.faces().len()).map(triangle));
            found.map_err(|e| format!("{}: {e}", file.display()))?
        }
    };
    Ok(placed(own, *pose))
}

fn placed(own: MassProperties, pose: Pose) -> MassProperties {
    let turn = DMat3::from_quat(pose.rotation);
    let inertia = turn * own.inertia * turn.transpose();
    MassProperties { mass: own.mass, center: pose.to_world(own.center), inertia }
}

/// The body that several bodies are together; `None` without any.
pub(super) fn together(all: &[MassProperties]) -> Option<MassProperties> {
    let mass: f64 = all.iter().map(|one| one.mass).sum();
    if mass <= 0.0 {
        return None;
    }
    let center = all.iter().map(|one| one.mass * one.center).sum::<DVec3>() / mass;
    let mut inertia = DMat3::ZERO;
    for one in all {
        let d = one.center - center;
        let outer = DMat3::from_cols(d * d.x, d * d.y, d * d.z);
        inertia += one.inertia + one.mass * (d.length_squared() * DMat3::IDENTITY - outer);
    }
    Some(MassProperties { mass, center, inertia })
}
