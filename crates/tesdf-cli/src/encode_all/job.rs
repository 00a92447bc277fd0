//! Encodes one of many meshes.
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::Serialize;
use tesdf::asset::FORMAT_VERSION;
use tesdf::asset::about::{Repair, Source};
use tesdf::encode::{DomainChoice, EncodeChoices, EncodeOptions, Encoder};
use tesdf::glam::DAffine3;
use tesdf::mesh::{LoadReport, LoadedMesh, MeshError, MeshFormat, RepairMode, SolidMesh, TriangleMesh};
use tesdf::save::save_atomic;
use tesdf::{Certificate, Progress, TeSdf};

use super::meshes::{Content, Mesh, Placed};
use crate::encode::choices::{ChoiceArgs, encode};
use crate::terminal::asset_file;
use crate::terminal::mesh_file::{self, CadArgs};
use crate::terminal::report::Failure;

/// The work on each mesh.
#[derive(Debug)]
pub struct Job {
    choices: EncodeChoices,
    repair: RepairMode,
    options: EncodeOptions,
    cad: CadArgs,
    output: PathBuf,
}

/// What became of a mesh in this run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// Encoded now.
    Encoded,
    /// Its asset was there and whole.
    Present,
    /// There is no asset, because of an error.
    Failed,
}

/// The result for a mesh.
#[derive(Debug)]
pub struct Done {
    pub state: State,
    pub seconds: f64,
    /// The asset, or the error message.
    pub result: Result<Asset, String>,
}

/// An asset in the output folder.
#[derive(Clone, Debug, Serialize)]
pub struct Asset {
    /// BLAKE3 of the mesh file, in hex.
    mesh_blake3: String,
    /// Name of the asset's file.
    asset: String,
    /// Size of the asset's file.
    pub bytes: u64,
    faces: usize,
    certificate: Certificate,
    /// What `--repair auto` changed.
    #[serde(skip_serializing_if = "Option::is_none")]
    repair: Option<Repair>,
}

/// The asset that a mesh gets.
struct Expected {
    source: Source,
    name: String,
    path: PathBuf,
}

impl Job {
    /// # Errors
    /// The choices exclude each other.
    pub fn new(args: &ChoiceArgs, cad: CadArgs, output: &Path) -> Result<Self, Failure> {
        let choices = args.choices();
        let options = choices.options().map_err(Failure::new)?;
        Ok(Self { choices, repair: args.repair_mode(), options, cad, output: output.to_path_buf() })
    }

    /// The options of the encoder.
    pub fn options(&self) -> &EncodeOptions {
        &self.options
    }

    /// The name of the domain.
    pub fn domain(&self) -> &'static str {
        match self.choices.domain {
            DomainChoice::Bisection => "bisection",
            DomainChoice::Gmsh => "gmsh",
            DomainChoice::File(_) => "file",
        }
    }

    /// Encodes a mesh, unless its asset is there. Nothing that is wrong with the mesh stops the
    /// caller, not even a mistake in the encoder.
    pub fn run(&self, mesh: &Mesh, stop: &Progress) -> Done {
        let start = Instant::now();
        let result = catch_unwind(AssertUnwindSafe(|| self.asset(mesh, stop))).unwrap_or_else(|panic| {
            let found = message(&*panic);
            Err(Failure::new(format!("{}: tesdf has a bug: {found}; please report it", mesh.path.display())))
        });
        let (state, result) = match result {
            Ok((state, asset)) => (state, Ok(asset)),
            Err(failure) => (State::Failed, Err(failure.message)),
        };
        Done { state, seconds: start.elapsed().as_secs_f64(), result }
    }

    fn asset(&self, mesh: &Mesh, stop: &Progress) -> Result<(State, Asset), Failure> {
        let path = &mesh.path;
        if let Some(reason) = &mesh.unreadable {
            return Err(Failure::new(reason));
        }
        let (expected, surface, load) = match &mesh.content {
            Content::File => {
                let expected = self.expected(Source::of_file(path, hash_of(path)?));
                if let Some(asset) = self.present(&expected) {
                    return Ok((State::Present, asset));
                }
                let LoadedMesh { mesh: surface, report, .. } = self.read(path)?;
                (expected, surface, report)
            }
            Content::Part(part) => {
                let label = mesh.entry.part.as_deref().unwrap_or_default();
                let source = labelled(path, part.load.source_blake3.clone(), Some(label));
                (self.named(source, &part.asset), part.mesh.clone(), part.load.clone())
            }
            Content::Placed(placed) => {
                hash_of(path)?;
                let LoadedMesh { mesh: surface, report, .. } = self.read(path)?;
                let source = labelled(path, report.source_blake3.clone(), placed.label.as_deref());
                let surface =
                    placed.apply(surface).map_err(|e| Failure::new(format!("{}: {e}", path.display())))?;
                let unit = placed.unit.clone().or(report.unit.clone());
                (self.named(source, &placed.asset), surface, LoadReport { unit, ..report })
            }
        };
        if load.source_blake3 != expected.source.blake3 {
            let found = format!("{} changed while it was read; encode it again", path.display());
            return Err(Failure::new(found));
        }
        let (solid, repaired) = SolidMesh::with_repair(surface, self.options.inside, self.repair)
            .map_err(|e| Failure::new(format!("{}: {e}", mesh.name_in(path))))?;
        let source = expected.source.clone().repaired(repaired.as_ref());
        let options = self.options.clone().or_unit(load.unit.as_deref());
        let encoder = Encoder::new().options(options).source(source).progress(stop);
        let asset = encode(&solid, path, &self.choices, encoder, stop)?;
        let bytes = asset.to_bytes().map_err(Failure::new)?;
        save_atomic(&expected.path, &bytes).map_err(Failure::new)?;
        Ok((State::Encoded, expected.asset(&asset, bytes.len())))
    }

    fn read(&self, path: &Path) -> Result<LoadedMesh, Failure> {
        let is_cad = MeshFormat::of_path(path).is_ok_and(MeshFormat::is_cad);
        if is_cad { self.cad.read(path) } else { mesh_file::read(path) }
    }

    /// An asset with a name of its own. It is encoded whether it is there or not, because its name
    /// does not say with which version and options.
    fn named(&self, source: Source, name: &str) -> Expected {
        Expected { path: self.output.join(name), source, name: name.to_owned() }
    }

    /// The asset of the mesh file `source`. Its name is a hash of all that its bytes depend on:
    /// the mesh, the name of its file (which the asset records), the options and the version. So
    /// one name stands for one sequence of bytes.
    fn expected(&self, source: Source) -> Expected {
        let mut hasher = blake3::Hasher::new();
        let options = serde_json::to_string(&self.options).unwrap_or_default();
        let version = format!("{} {FORMAT_VERSION}", env!("CARGO_PKG_VERSION"));
        let cad = format!("{:?}", self.cad);
        let mut parts = vec![&*version, self.domain(), &options, &source.name, &source.blake3];
        if self.cad.is_given() {
            parts.push(&cad);
        }
        // Without a repair, the name is what it was before there was one.
        parts.extend((self.repair == RepairMode::Auto).then_some("repair auto"));
        for part in parts {
            // The length keeps two parts apart.
            hasher.update(&(part.len() as u64).to_le_bytes()).update(part.as_bytes());
        }
        let name = format!("{}.tesdf", &hasher.finalize().to_hex()[..32]);
        Expected { path: self.output.join(&name), source, name }
    }

    /// The asset if it is there and whole.
    fn present(&self, expected: &Expected) -> Option<Asset> {
        let asset = asset_file::open_intact(&expected.path).ok()?;
        let about = asset.about();
        // Without a unit of the user, it is that of the file.
        let options = self.options.clone().or_unit(about.options.unit.as_deref());
        let same = about.source.is_same_file(&expected.source) && about.options == options;
        same.then(|| expected.asset(&asset, asset.as_bytes().len()))
    }
}

/// BLAKE3 of a mesh file.
fn hash_of(path: &Path) -> Result<String, Failure> {
    // A pipe would give its bytes once, and they are read twice.
    if path.exists() && !path.is_file() {
        return Err(Failure::new(format!("{} is not a file; expected a mesh file", path.display())));
    }
    tesdf::mesh::source_blake3(path).map_err(|e| Failure::new(e.in_file(path)))
}

/// A source whose name says which part, or which transform, of the file it is.
fn labelled(path: &Path, blake3: String, label: Option<&str>) -> Source {
    let mut source = Source::of_file(path, blake3);
    if let Some(label) = label {
        source.name = format!("{}#{label}", source.name);
    }
    source
}

impl Placed {
    /// The mesh after the transform. If that mirrors, faces are turned over, so outward stays
    /// outward.
    fn apply(&self, mesh: TriangleMesh) -> Result<TriangleMesh, MeshError> {
        if self.pose == DAffine3::IDENTITY {
            return Ok(mesh);
        }
        let vertices = mesh.vertices().iter().map(|&p| self.pose.transform_point3(p)).collect();
        let mirrored = self.pose.matrix3.determinant() < 0.0;
        let turned = |&[a, b, c]: &[u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
        TriangleMesh::new(vertices, mesh.faces().iter().map(turned).collect())
    }
}

impl Mesh {
    /// The file, and the object in it.
    fn name_in(&self, path: &Path) -> String {
        match &self.entry.part {
            Some(part) => format!("{}: object '{part}'", path.display()),
            None => path.display().to_string(),
        }
    }
}

impl Expected {
    fn asset(&self, asset: &TeSdf, bytes: usize) -> Asset {
        let about = asset.about();
        Asset {
            mesh_blake3: self.source.blake3.clone(),
            asset: self.name.clone(),
            bytes: bytes as u64,
            faces: about.statistics.faces,
            certificate: about.certificate().clone(),
            repair: about.source.repair.clone(),
        }
    }
}

fn message(panic: &dyn Any) -> String {
    let text = panic.downcast_ref::<&str>().map(ToString::to_string);
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "it panicked".into())
}
