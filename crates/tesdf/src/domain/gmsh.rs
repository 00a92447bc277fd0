//! Tetrahedra by Gmsh, run as a program of its own and never linked, as its licence is the GPL.
//!
//! Comes in: a [`SolidMesh`]. Goes out: a [`ConformingMesh`]. Whatever Gmsh returns goes through the gate of
//! [`ConformingMesh::new`]; when that refuses it, the next settings are tried. Gmsh runs on one thread, in a folder of its
//! own and without the user's configuration, so that the same solid, options and version of Gmsh give the same tetrahedra.
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

/// How Gmsh fills the volume: its option `Mesh.Algorithm3D`.
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

/// How Gmsh improves the tetrahedra: its options `Mesh.Optimize` and `Mesh.OptimizeNetgen`.
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

/// One way to run Gmsh.
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

/// Which part of space to fill, and how to run Gmsh. Every field is used.
#[derive(Clone, Debug, PartialEq)]
pub struct GmshOptions {
    /// Fills the bounds grown by this width; `None` fills no layer around the solid.
    pub band: Option<Length>,
    /// Boxes that are filled as well, in the mesh's unit: `[min x y z, max x y z]`. Tetrahedra outside that meet no box and
    /// no layer are left out.
    pub regions: Vec<[f64; 6]>,
    /// Tried in this order until the result conforms.
    pub settings: Vec<GmshSettings>,
    /// The program. `None`: what the environment variable `TESDF_GMSH` names, or else `gmsh`.
    pub executable: Option<PathBuf>,
    /// Longest time for one of the settings.
    pub time_limit: Duration,
}

impl Default for GmshOptions {
    /// Only the inside.
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

/// Tetrahedra by Gmsh, and what it took.
#[derive(Debug)]
pub struct GmshMesh {
    /// The tetrahedra.
    pub mesh: ConformingMesh,
    /// The settings that gave them.
    pub settings: GmshSettings,
    /// The settings that were tried before.
    pub refused: Vec<Refused>,
}

/// Fills a solid, and what the options say around it, with tetrahedra.
///
/// # Errors
/// [`GmshError`] says how to install Gmsh, which option is wrong, or for each of the settings what failed.
pub fn tetrahedralise(solid: &SolidMesh, options: &GmshOptions) -> Result<ConformingMesh, GmshError> {
    Ok(tetrahedralise_and_report(solid, options, &Progress::default())?.mesh)
}

/// As [`tetrahedralise`], with the settings that it took. Gmsh is ended when `progress` is cancelled.
///
/// # Errors
/// As [`tetrahedralise`], and [`GmshError::Cancelled`].
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

/// Back to the mesh's unit, through the gate, and without what nobody asked for.
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

/// The boxes that are to be filled besides the solid, in the mesh's unit.
struct Layers {
    boxes: Vec<Aabb>,
    /// Around all of them and, with some room, around the solid.
    hull: Option<Aabb>,
}

/// Room between the solid and the box around the regions, relative to the diagonal: about a face of the box.
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
            // Also where the width is lost to rounding, far from the origin.
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
