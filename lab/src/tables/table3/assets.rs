//! The encoded meshes of Table III.
use std::path::{Path, PathBuf};

use tempfile::TempDir;
use tesdf::encode::Encoder;
use tesdf::mesh::SolidMesh;
use tesdf_cli::terminal::report::Failure;
use tesdf_parts::{LobedHole, Nut, Resolution, Size};

use super::Scenario;
use tesdf::encode::Preset;

/// Encodes meshes into files, which are removed in the end.
pub struct Assets {
    folder: TempDir,
    preset: Preset,
}

impl Assets {
    /// # Errors
    /// There is no folder for temporary files.
    pub fn new(preset: Preset) -> Result<Self, Failure> {
        let folder = TempDir::new().map_err(|e| {
            Failure::new(format!("no temporary folder: {e}"))
                .hint("set TMPDIR to a folder that can be written to")
        })?;
        Ok(Self { folder, preset })
    }

    /// The asset of a mesh file.
    ///
    /// # Errors
    /// The mesh cannot be read or is not a solid, or the asset cannot be written.
    pub fn of_file(&self, mesh: &Path) -> Result<PathBuf, Failure> {
        let name = mesh.file_stem().unwrap_or_default().to_string_lossy();
        self.asset(&name, || SolidMesh::read(mesh).map_err(Failure::new))
    }

    /// The asset of the body that gives a scenario its tolerance, made for this one, µm.
    ///
    /// # Errors
    /// No such part exists, or the asset cannot be written.
    pub fn of_part(&self, scenario: Scenario, tolerance: u32) -> Result<PathBuf, Failure> {
        let clearance = f64::from(tolerance) * 1e-6;
        self.asset(&format!("{}_{tolerance}", scenario.name()), || {
            // The segments of the files for the other tolerances.
            let solid = match scenario {
                Scenario::BoltNut => {
                    let size: Size = "M16".parse().map_err(Failure::new)?;
                    Nut { clearance, height: 13e-3, ..Nut::iso_4032(size) }.mesh(Resolution::Segments(96))
                }
                Scenario::PegInHole => {
                    LobedHole { clearance, ..LobedHole::DEFAULT }.mesh(Resolution::Segments(192))
                }
            };
            solid.map_err(Failure::new)
        })
    }

    fn asset(
        &self,
        name: &str,
        solid: impl FnOnce() -> Result<SolidMesh, Failure>,
    ) -> Result<PathBuf, Failure> {
        let path = self.folder.path().join(name).with_extension("tesdf");
        if !path.exists() {
            let asset = Encoder::new().preset(self.preset).encode(&solid()?).map_err(Failure::new)?;
            asset.save(&path).map_err(Failure::new)?;
        }
        Ok(path)
    }
}
