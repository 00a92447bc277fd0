//! Tetrahedra by Gmsh. Gmsh is run as a separate program and never linked, because its licence is
//! the GPL.
//!
//! The input is a [`SolidMesh`], the output is a [`ConformingMesh`]. The tetrahedra of Gmsh go
//! through the checks of [`ConformingMesh::new`]. When these refuse them, the next settings are
//! tried. Gmsh runs on one thread, in a folder of its own and without the configuration of the
//! user. So the same solid, options and version of Gmsh give the same tetrahedra.
use std::{path::PathBuf, time::Duration};

use glam::DVec3;
use serde::{Deserialize, Serialize};

mod error;
mod input;
mod run;

use super::{ConformingMesh, TetMesh};
use crate::base::{Length, Progress, Side};
use crate::geometry::{Aabb, LocalFrame};
use crate::mesh::SolidMesh;
pub use error::{GmshError, Refused, RefusedBecause};

/// How Gmsh fills the volume: the option `Mesh.Algorithm3D` of Gmsh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GmshAlgorithm {
    /// `1`: Delaunay.
    Delaunay,
    /// `4`: advancing front, by Netgen.
    Frontal,
    /// `10`: HXT, a faster Delaunay.
    Hxt,
}

/// How Gmsh improves the tetrahedra: the options `Mesh.Optimize` and `Mesh.OptimizeNetgen` of Gmsh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GmshOptimizer {
    /// Not at all.
    Off,
    /// By Gmsh itself.
    Gmsh,
    /// By Gmsh itself, then by Netgen.
    Netgen,
}

/// The settings of one run of Gmsh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct GmshSettings {
    /// How the volume is filled.
    pub algorithm: GmshAlgorithm,
    /// How the tetrahedra are improved.
    pub optimizer: GmshOptimizer,
}

impl std::fmt::Display for GmshSettings {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (algorithm, [optimize, netgen]) = (self.algorithm.number(), self.optimizer.numbers());
        write!(f, "Mesh.Algorithm3D={algorithm} Mesh.Optimize={optimize} Mesh.OptimizeNetgen={netgen}")
    }
}

impl GmshAlgorithm {
    fn number(self) -> u8 {
        match self {
            Self::Delaunay => 1,
            Self::Frontal => 4,
            Self::Hxt => 10,
        }
    }
}

impl GmshOptimizer {
    fn numbers(self) -> [u8; 2] {
        match self {
            Self::Off => [0, 0],
            Self::Gmsh => [1, 0],
            Self::Netgen => [1, 1],
        }
    }
}

/// The part of space to fill, and how to run Gmsh. Every field is used.
#[derive(Clone, Debug, PartialEq)]
pub struct GmshOptions {
    /// Width of the layer around the solid that is filled too: the bounds are grown by it. `None`
    /// fills no layer.
    pub band: Option<Length>,
    /// Boxes that are filled too, in the unit of the mesh: `[min x y z, max x y z]`. Outer
    /// tetrahedra that meet neither a box nor the layer are left out.
    pub regions: Vec<[f64; 6]>,
    /// The settings, tried in this order until the tetrahedra conform.
    pub settings: Vec<GmshSettings>,
    /// The program. `None` stands for the program that the environment variable `TESDF_GMSH` names,
    /// or else `gmsh`.
    pub executable: Option<PathBuf>,
    /// Time limit for each of the settings.
    pub time_limit: Duration,
}

impl Default for GmshOptions {
    /// Fills only the inside.
    fn default() -> Self {
        use {GmshAlgorithm::*, GmshOptimizer::*};
        let settings = [(Delaunay, Gmsh), (Hxt, Gmsh), (Delaunay, Netgen), (Delaunay, Off), (Hxt, Off)];
        Self {
            band: None,
            regions: Vec::new(),
            settings: settings.map(|(algorithm, optimizer)| GmshSettings { algorithm, optimizer }).into(),
            executable: None,
            time_limit: Duration::from_secs(600),
        }
    }
}

/// The tetrahedra of Gmsh, with the settings that gave them.
#[derive(Debug)]
pub struct GmshMesh {
    /// The tetrahedra.
    pub mesh: ConformingMesh,
    /// The settings that gave them.
    pub settings: GmshSettings,
    /// The settings that were tried before and refused.
    pub refused: Vec<Refused>,
}

/// Fills a solid with tetrahedra, and the space around it that the options name.
///
/// # Errors
/// [`GmshError`] says how to install Gmsh, which option is wrong, or why each of the settings
/// failed.
pub fn tetrahedralise(solid: &SolidMesh, options: &GmshOptions) -> Result<ConformingMesh, GmshError> {
    Ok(tetrahedralise_and_report(solid, options, &Progress::default())?.mesh)
}

/// The same as [`tetrahedralise`], with the settings that gave the tetrahedra. When `progress` is
/// cancelled, Gmsh is ended.
///
/// # Errors
/// The same as for [`tetrahedralise`], and [`GmshError::Cancelled`].
pub fn tetrahedralise_and_report(
    solid: &SolidMesh,
    options: &GmshOptions,
    progress: &Progress,
) -> Result<GmshMesh, GmshError> {
    let layers = Layers::new(solid, options)?;
    let frame = LocalFrame::of(solid.mesh().bounds());
    let surface = input::surface(solid, &frame, layers.hull());
    let mut refused = Vec::new();
    for &settings in &options.settings {
        let script = input::script(settings, layers.hull().is_some());
        let result = match run::run(&surface, &script, options, progress)? {
            Ok(found) => conform(solid, &found, &frame, &layers),
            Err(because) => Err(because),
        };
        match result {
            Ok(mesh) => return Ok(GmshMesh { mesh, settings, refused }),
            Err(because) => refused.push(Refused { settings, because }),
        }
    }
    Err(GmshError::AllRefused(refused))
}

/// Takes the tetrahedra back to the unit of the mesh, checks them, and leaves out tetrahedra that
/// were not asked for.
fn conform(
    solid: &SolidMesh,
    found: &TetMesh,
    frame: &LocalFrame,
    layers: &Layers,
) -> Result<ConformingMesh, RefusedBecause> {
    let vertices = found.vertices().iter().map(|&p| frame.to_world(p)).collect();
    let whole = ConformingMesh::new(solid, &TetMesh::new(vertices, found.tetrahedra().to_vec())?)?;
    let wanted = |t: usize| whole.sides()[t] == Side::Inside || layers.meet(Aabb::of(&whole.corners(t)));
    let kept: Vec<_> =
        (0..whole.tetrahedra().len()).filter(|&t| wanted(t)).map(|t| whole.tetrahedra()[t]).collect();
    if kept.len() == whole.tetrahedra().len() {
        return Ok(whole);
    }
    Ok(ConformingMesh::new(solid, &TetMesh::new(whole.vertices().to_vec(), kept)?)?)
}

/// The boxes to fill in addition to the solid, in the unit of the mesh.
struct Layers {
    boxes: Vec<Aabb>,
    /// A box around all of them and, with some room, around the solid.
    hull: Option<Aabb>,
}

/// Room between the solid and the box around the regions, relative to the diagonal. It is about one
/// face of the box.
const ROOM: f64 = 0.05;

impl Layers {
    fn new(solid: &SolidMesh, options: &GmshOptions) -> Result<Self, GmshError> {
        let (bounds, diagonal) = (solid.mesh().bounds(), solid.mesh().diagonal());
        let mut boxes = Vec::new();
        for (index, &[a, b, c, d, e, f]) in options.regions.iter().enumerate() {
            let region = Aabb { min: DVec3::new(a, b, c), max: DVec3::new(d, e, f) };
            let is_finite = region.min.is_finite() && region.max.is_finite();
            if !(is_finite && region.min.cmplt(region.max).all()) {
                return Err(GmshError::Region { index, min: region.min, max: region.max });
            }
            boxes.push(region);
        }
        let mut room = ROOM * diagonal;
        if let Some(band) = options.band {
            room = band.resolve(diagonal);
            let layer = bounds.grown(room);
            // This also covers a width that is lost to rounding, far from the origin.
            let is_around = layer.min.cmplt(bounds.min).all() && layer.max.cmpgt(bounds.max).all();
            if !is_around || !room.is_finite() {
                return Err(GmshError::Band { width: room, diagonal });
            }
            boxes.push(layer);
        }
        let hull = boxes.iter().copied().reduce(Aabb::union).map(|all| all.union(bounds.grown(room)));
        Ok(Self { boxes, hull })
    }

    fn hull(&self) -> Option<Aabb> {
        self.hull
    }

    fn meet(&self, bounds: Aabb) -> bool {
        self.boxes.iter().any(|b| b.overlaps(bounds))
    }
}
