//! Memory and error of the representations of Table III.
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use serde::Serialize;
use tesdf::TeSdf;
use tesdf::collide::{Shape, ShapeId};
use tesdf::inspect::{InspectOptions, inspect};
use tesdf_sim::System;

use super::Scenario;
use crate::voxel::{VoxelAccuracy, VoxelGrid, VoxelOptions, accuracy};
use tesdf_cli::terminal::progress::Bar;
use tesdf_cli::terminal::report::Failure;

/// Memory of the two meshes of a scene, encoded.
#[derive(Clone, Debug, Serialize)]
pub struct Encoded {
    /// Scene.
    pub scenario: &'static str,
    /// Tolerance, µm.
    pub tolerance_um: u32,
    /// The paper's account, MiB.
    pub paper_mib: f64,
    /// All resident bytes.
    pub whole_bytes: usize,
}

/// A voxel grid.
#[derive(Clone, Debug, Serialize)]
pub struct Voxels {
    /// Scene.
    pub scenario: &'static str,
    /// Name of the body.
    pub body: &'static str,
    /// Tolerance, µm.
    pub tolerance_um: u32,
    /// Voxels along the longest side.
    pub quality: u32,
    /// Edge of a voxel, m.
    pub voxel: f64,
    /// Samples along each axis.
    pub samples: [u64; 3],
    /// Bytes of the dense grid, with a 32-bit float for each sample.
    pub dense_bytes: u64,
    /// Bytes of the sparse grid that was used.
    pub sparse_bytes: u64,
    /// Errors up to the contact distance from the surface.
    pub accuracy: VoxelAccuracy,
    /// Wall time of the sampling, s.
    pub seconds: f64,
}

/// The grids that were made, by mesh and quality.
#[derive(Default)]
pub struct Grids {
    made: BTreeMap<(PathBuf, u32), (Arc<VoxelGrid>, Voxels)>,
}

/// A mesh of a scene.
#[derive(Clone)]
pub struct Geometry {
    pub body: &'static str,
    pub path: PathBuf,
    pub shape: ShapeId,
    pub asset: Arc<TeSdf>,
}

/// The meshes of the moving and the fixed body of a system.
///
/// # Errors
/// A body is missing, or is a simple shape.
pub fn geometries(
    scenario: Scenario,
    system: &System,
    paths: [PathBuf; 2],
) -> Result<[Geometry; 2], Failure> {
    let of = |body: &'static str, path: PathBuf| {
        let missing = || Failure::new(format!("{}: there is no mesh of the body {body}", scenario.name()));
        let instance = system.bodies().iter().find(|b| b.name == body).ok_or_else(missing)?.instance;
        let shape = system.scene().instance(instance).map_err(Failure::new)?.shape;
        match system.scene().shape(shape).map_err(Failure::new)? {
            Shape::Mesh(asset) => Ok(Geometry { body, path, shape, asset: Arc::clone(asset) }),
            _ => Err(missing()),
        }
    };
    let ([moving, fixed], [of_moving, of_fixed]) = (scenario.bodies(), paths);
    Ok([of(moving, of_moving)?, of(fixed, of_fixed)?])
}

impl Encoded {
    pub fn of(scenario: Scenario, tolerance_um: u32, geometries: &[Geometry; 2]) -> Self {
        let memories = geometries.each_ref().map(|g| inspect(&g.asset, &InspectOptions::default()).memory);
        Self {
            scenario: scenario.name(),
            tolerance_um,
            paper_mib: memories.iter().map(|m| m.paper_mib).sum(),
            whole_bytes: memories.iter().map(|m| m.whole).sum(),
        }
    }
}

impl Grids {
    /// The grid of a mesh, which is sampled once.
    ///
    /// The narrow band is the contact distance and two voxels. So all samples around a contact are
    /// those of a dense grid.
    ///
    /// # Errors
    /// There is not enough memory.
    pub fn get(
        &mut self,
        (scenario, tolerance_um): (Scenario, u32),
        geometry: &Geometry,
        quality: u32,
        contact_distance: f64,
        bar: &Bar,
    ) -> Result<Arc<VoxelGrid>, Failure> {
        let key = (geometry.path.clone(), quality);
        if let Some((grid, _)) = self.made.get(&key) {
            return Ok(Arc::clone(grid));
        }
        bar.stage("sampling distances for voxels");
        let start = std::time::Instant::now();
        let asset = &*geometry.asset;
        let voxel = asset.bounds().extent().max_element() / f64::from(quality);
        let options = VoxelOptions { resolution: quality, narrow_band: contact_distance + 2.0 * voxel };
        let grid = VoxelGrid::new(asset, options, |share| bar.set(share)).map_err(Failure::new)?;
        let seconds = start.elapsed().as_secs_f64();
        let row = Voxels {
            scenario: scenario.name(),
            body: geometry.body,
            tolerance_um,
            quality,
            voxel,
            samples: grid.samples(),
            dense_bytes: grid.dense_bytes(),
            sparse_bytes: grid.sparse_bytes(),
            accuracy: accuracy(&grid, asset, contact_distance),
            seconds,
        };
        let grid = Arc::new(grid);
        self.made.insert(key, (Arc::clone(&grid), row));
        Ok(grid)
    }

    /// Forgets the grids of a mesh, and returns what is known of them.
    pub fn release(&mut self, geometry: &Geometry) -> Vec<Voxels> {
        let (gone, kept) =
            std::mem::take(&mut self.made).into_iter().partition(|((p, _), _)| *p == geometry.path);
        self.made = kept;
        let gone: BTreeMap<_, (_, Voxels)> = gone;
        gone.into_values().map(|(_, row)| row).collect()
    }
}
