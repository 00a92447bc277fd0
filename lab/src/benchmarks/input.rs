//! Meshes and presets of the benchmarks.
use std::path::Path;
use std::time::Instant;

use super::Failure;
use tesdf::TeSdf;
use tesdf::asset::about::Source;
pub use tesdf::encode::Preset;
use tesdf::encode::{EncodeOptions, Encoder};
use tesdf::mesh::{RepairOptions, SolidMesh, repair};

/// A mesh that the encoder accepts.
pub struct Input {
    /// File name without extension; ` (repaired)` follows the name of a repaired mesh.
    pub name: String,
    /// The mesh, repaired if necessary.
    pub solid: SolidMesh,
    source: Source,
}

impl Input {
    /// Reads a mesh file. A mesh that cannot be encoded is repaired with default options, and
    /// stderr reports the changes.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let at = |e: &dyn std::fmt::Display| Failure::from(format!("{}: {e}", path.display()));
        let loaded = tesdf::mesh::read(path).map_err(|e| e.in_file(path))?;
        let mut name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let source = Source::of_file(path, loaded.report.source_blake3);
        let solid = match SolidMesh::new(loaded.mesh.clone()) {
            Ok(solid) => solid,
            Err(e) if e.is_repairable() => {
                let repaired = repair(&loaded.mesh, &RepairOptions::default()).map_err(|e| at(&e))?;
                let r = &repaired.report;
                eprintln!(
                    "note: {}: repaired with default options: {} faces with two equal corners and {} duplicates dropped, \
                     {} edges split, {} faces vanished, {} reversed",
                    path.display(),
                    r.collapsed_faces.len(),
                    r.duplicate_faces.len(),
                    r.split_edges.len(),
                    r.vanished_faces.len(),
                    r.reversed_faces.len()
                );
                name += " (repaired)";
                SolidMesh::new(repaired.mesh).map_err(|e| at(&e))?
            }
            Err(e) => return Err(at(&e)),
        };
        Ok(Self { name, solid, source })
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
