//! Meshes and presets of the benchmarks.
use std::path::Path;
use std::time::Instant;

use super::Failure;
use tesdf::TeSdf;
use tesdf::asset::about::Source;
pub use tesdf::encode::Preset;
use tesdf::encode::{EncodeOptions, Encoder};
use tesdf::mesh::{RepairMode, SolidMesh, SolidOptions};

/// A mesh that the encoder accepts.
pub struct Input {
    /// File name without extension; ` (repaired)` follows the name of a repaired mesh.
    pub name: String,
    /// The mesh, repaired if necessary.
    pub solid: SolidMesh,
    source: Source,
}

impl Input {
    /// Reads a mesh file. A mesh that cannot be encoded is repaired, and stderr reports the changes.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let options = SolidOptions { repair: RepairMode::Auto, ..SolidOptions::default() };
        let loaded = SolidMesh::load(path, &options)?;
        let mut name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let source = loaded.source();
        if let Some(repair) = &source.repair {
            eprintln!("note: {}: repaired {repair}", path.display());
            name += " (repaired)";
        }
        Ok(Self { name, solid: loaded.solid, source })
    }

    /// Encodes the mesh on all threads of the current rayon pool. Returns the asset and the time,
    /// s.
    pub fn encode(&self, options: &EncodeOptions) -> Result<(TeSdf, f64), Failure> {
        let start = Instant::now();
        let asset = Encoder::new()
            .options(options.clone())
            .source(self.source.clone())
            .encode(&self.solid)
            .map_err(|e| format!("{}: {e}", self.source.name))?;
        Ok((asset, start.elapsed().as_secs_f64()))
    }
}
