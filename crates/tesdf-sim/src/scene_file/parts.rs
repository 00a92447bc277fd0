//! Bodies of several meshes and shapes, which are encoded as one mesh.
use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tesdf::base::elementary;
use tesdf::base::{Inside, SurfaceFaces};
use tesdf::collide::Pose;
use tesdf::glam::{DAffine3, DQuat, DVec3};
use tesdf::input;
use tesdf::mesh::{RepairMode, SolidMesh, TriangleMesh};

use super::{PoseSection, identity};

/// Faces around the axis of a round part.
const AROUND: usize = 64;

/// A part of a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PartSection {
    /// Path of a mesh file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mesh: Option<PathBuf>,
    /// A simple shape.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<PartShape>,
    /// Factors along the axes of the mesh or shape. An odd number of negative ones mirrors.
    #[serde(default = "ones")]
    pub scale: [f64; 3],
    /// Position of its origin in the frame of the body.
    #[serde(default)]
    pub translation: [f64; 3],
    /// Orientation in the frame of the body: a unit quaternion x y z w.
    #[serde(default = "identity")]
    pub rotation: [f64; 4],
    /// Both together: x y z qx qy qz qw, or the rows of a matrix of 4 × 4. A loaded scene has them
    /// apart.
    #[serde(default, skip_serializing)]
    pub pose: Option<PoseSection>,
}

/// A simple shape that is a mesh within a body. Round ones have 64 faces around their axis, whose
/// corners are on the surface: the faces are up to 0.13 % of the radius below it, those of balls
/// and round ends up to 0.25 %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum PartShape {
    /// A box, centred on the origin.
    Box {
        /// Half of the edge lengths along x, y and z, m.
        half_extents: [f64; 3],
    },
    /// A ball, centred on the origin.
    Sphere {
        /// Radius, m.
        radius: f64,
    },
    /// A cylinder about the z axis, centred on the origin.
    Cylinder {
        /// Half of its length, m.
        half_height: f64,
        /// Radius, m.
        radius: f64,
    },
    /// The points within `radius` of a segment of the z axis, centred on the origin.
    Capsule {
        /// Half of the segment's length, m.
        half_height: f64,
        /// Radius, m.
        radius: f64,
    },
}

fn ones() -> [f64; 3] {
    [1.0; 3]
}

/// The mesh of the parts together, and what is inside of it. `resolve` gives the file of a path.
///
/// # Errors
/// The part at fault.
pub(crate) fn joined(
    resolve: &dyn Fn(&Path) -> PathBuf,
    parts: &[PartSection],
    repair: RepairMode,
) -> Result<(TriangleMesh, Inside), String> {
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for (k, part) in parts.iter().enumerate() {
        let mesh = placed(resolve, part, repair).map_err(|reason| format!("part {}: {reason}", k + 1))?;
        let first = u32::try_from(vertices.len()).map_err(|_| "the parts have too many vertices")?;
        vertices.extend_from_slice(mesh.vertices());
        faces.extend(mesh.faces().iter().map(|face| face.map(|v| v.saturating_add(first))));
    }
    let mesh = TriangleMesh::new(vertices, faces).map_err(|e| e.to_string())?;
    // Faces within another part are no surface.
    let surface = if parts.len() > 1 { SurfaceFaces::Boundary } else { SurfaceFaces::All };
    Ok((mesh, Inside { surface, ..Inside::default() }))
}

fn placed(
    resolve: &dyn Fn(&Path) -> PathBuf,
    part: &PartSection,
    repair: RepairMode,
) -> Result<TriangleMesh, String> {
    let mesh = match (&part.mesh, &part.shape) {
        (Some(file), None) => {
            let file = resolve(file);
            input::check_regular(&file).map_err(|e| format!("{}: {e}", file.display()))?;
            let loaded = tesdf::mesh::read(&file).map_err(|e| e.in_file(&file).to_string())?;
            let solid = SolidMesh::with_repair(loaded.mesh, Inside::default(), repair);
            solid.map_err(|e| format!("{}: {e}", file.display()))?.0.into_mesh()
        }
        (None, Some(shape)) => shape.mesh()?,
        (None, None) => return Err("it has no geometry; give mesh = \"FILE\" or a shape".into()),
        (Some(_), Some(_)) => return Err("it has a mesh and a shape; keep one".into()),
    };
    let scale = DVec3::from_array(part.scale);
    if !(scale.is_finite() && scale.cmpne(DVec3::ZERO).all()) {
        return Err(format!("its scale is {scale}; expected numbers other than 0"));
    }
    let pose = Pose::new(DVec3::from_array(part.translation), DQuat::from_array(part.rotation));
    let pose = pose.map_err(|e| e.to_string())?;
    let map = DAffine3::from_scale_rotation_translation(scale, pose.rotation, pose.translation);
    let vertices = mesh.vertices().iter().map(|&p| map.transform_point3(p)).collect();
    let mirrored = scale.x * scale.y * scale.z < 0.0;
    let turned = |&[a, b, c]: &[u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
    TriangleMesh::new(vertices, mesh.faces().iter().map(turned).collect()).map_err(|e| e.to_string())
}

impl PartShape {
    fn mesh(self) -> Result<TriangleMesh, String> {
        let sizes = match self {
            Self::Box { half_extents } => half_extents.to_vec(),
            Self::Sphere { radius } => vec![radius],
            Self::Cylinder { half_height, radius } | Self::Capsule { half_height, radius } => {
                vec![half_height, radius]
            }
        };
        if let Some(found) = sizes.iter().find(|size| !(**size > 0.0 && size.is_finite())) {
            return Err(format!("a size of its shape is {found}; expected a finite length above 0"));
        }
        // The half circles of the ends, from the lowest point to the highest.
        let arc = |from: usize, to: usize, radius: f64, middle: f64| {
            (from..=to).map(move |k| {
                let angle = PI * k as f64 / (AROUND / 2) as f64;
                let r = if k == 0 || 2 * k == AROUND { 0.0 } else { radius * elementary::sin(angle) };
                [r, middle - radius * elementary::cos(angle)]
            })
        };
        let (quarter, half) = (AROUND / 4, AROUND / 2);
        let profile: Vec<[f64; 2]> = match self {
            Self::Box { half_extents } => return cuboid(DVec3::from_array(half_extents)),
            Self::Sphere { radius } => arc(0, half, radius, 0.0).collect(),
            Self::Cylinder { half_height: h, radius: r } => vec![[0.0, -h], [r, -h], [r, h], [0.0, h]],
            Self::Capsule { half_height: h, radius: r } => {
                arc(0, quarter, r, -h).chain(arc(quarter, half, r, h)).collect()
            }
        };
        revolved(&profile)
    }
}

fn cuboid(half: DVec3) -> Result<TriangleMesh, String> {
    let sign = |k: usize, bit: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let corner = |k| half * DVec3::new(sign(k, 0), sign(k, 1), sign(k, 2));
    let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    TriangleMesh::new((0..8).map(corner).collect(), faces).map_err(|e| e.to_string())
}

/// The solid of revolution of a profile of radius and height, which begins and ends on the axis,
/// from below.
fn revolved(profile: &[[f64; 2]]) -> Result<TriangleMesh, String> {
    let (mut vertices, mut faces, mut rings) = (Vec::new(), Vec::new(), Vec::<Vec<u32>>::new());
    for &[radius, height] in profile {
        let first = vertices.len() as u32;
        if radius == 0.0 {
            vertices.push(DVec3::new(0.0, 0.0, height));
            rings.push(vec![first; AROUND]);
            continue;
        }
        vertices.extend((0..AROUND).map(|k| {
            let (sin, cos) = elementary::sin_cos(TAU * k as f64 / AROUND as f64);
            DVec3::new(radius * cos, radius * sin, height)
        }));
        rings.push((0..AROUND as u32).map(|k| first + k).collect());
    }
    for pair in rings.windows(2) {
        let [low, high] = [&pair[0], &pair[1]];
        for k in 0..AROUND {
            let next = (k + 1) % AROUND;
            let quad = [[low[k], low[next], high[next]], [low[k], high[next], high[k]]];
            faces.extend(quad.into_iter().filter(|[a, b, c]| a != b && b != c && c != a));
        }
    }
    TriangleMesh::new(vertices, faces).map_err(|e| e.to_string())
}
