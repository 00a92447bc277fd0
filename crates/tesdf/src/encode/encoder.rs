use std::fmt;
use std::path::{Path, PathBuf};

use super::pipeline;
use super::placed::Request;
use super::sampled::Processor;
use super::{Domain, EncodeError, EncodeOptions, Preset, Sampler, Source};
use crate::asset::TeSdf;
use crate::base::{Inside, Length, Progress};
use crate::mesh::{ReadSolidError, RepairMode, SolidMesh, SolidOptions};

/// Encodes solids.
///
/// [`Encoder::new`] has the default options. Each method changes one setting and returns the
/// encoder. One encoder may encode many solids.
///
/// # Example
///
/// ```
/// use tesdf::{Encoder, Length, Preset, SolidMesh};
/// # use tesdf::mesh::{MeshFormat, read_bytes};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
/// # let mesh = read_bytes(obj.as_bytes(), MeshFormat::Obj)?.mesh;
/// let solid = SolidMesh::new(mesh)?;
/// let asset =
///     Encoder::new().preset(Preset::Fast).band(Length::Absolute(0.2)).unit("mm").encode(&solid)?;
/// assert_eq!(asset.unit(), Some("mm"));
/// # Ok(())
/// # }
/// ```
#[derive(Clone)]
pub struct Encoder<'a> {
    options: EncodeOptions,
    band: Option<Length>,
    unit: Option<String>,
    inside: Option<Inside>,
    domain: Domain<'a>,
    source: Source,
    repair: RepairMode,
    sampler: &'a dyn Sampler,
    progress: Option<&'a Progress>,
}

impl fmt::Debug for Encoder<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Encoder")
            .field("options", &self.resolved())
            .field("domain", &self.domain)
            .field("source", &self.source)
            .field("repair", &self.repair)
            .field("sampler", &self.sampler.name())
            .field("progress", &self.progress)
            .finish()
    }
}

impl Default for Encoder<'_> {
    fn default() -> Self {
        Self::new()
    }
}

impl<'a> Encoder<'a> {
    /// An encoder with the defaults: [`Preset::Default`], the bisection domain, no source, and
    /// samples on the processor.
    pub fn new() -> Self {
        Self {
            options: EncodeOptions::default(),
            band: None,
            unit: None,
            inside: None,
            domain: Domain::Bisection,
            source: Source::default(),
            repair: RepairMode::Never,
            sampler: &Processor,
            progress: None,
        }
    }

    /// Sets the options of a preset: [`EncodeOptions::preset`].
    ///
    /// [`Preset::Paper`] and [`Preset::SampledSafe`] need a conforming [`domain`](Self::domain).
    pub fn preset(self, preset: Preset) -> Self {
        self.options(EncodeOptions::preset(preset))
    }

    /// Sets all options, in place of those of a preset. The last call of `preset` or `options`
    /// counts.
    pub fn options(self, options: EncodeOptions) -> Self {
        Self { options, ..self }
    }

    /// Sets the width of the layer outside of the solid that belongs to the domain. The default is
    /// 5 % of the diagonal. It replaces [`EncodeOptions::band`], whether it is called before or
    /// after `preset` and `options`.
    ///
    /// Points farther out are answered just as exactly, but more slowly. A conforming domain
    /// consists of its tetrahedra and has no band.
    pub fn band(self, band: Length) -> Self {
        Self { band: Some(band), ..self }
    }

    /// Records the name of the unit of the mesh. Nothing is scaled. It replaces
    /// [`EncodeOptions::unit`], in the same way as `band`.
    pub fn unit(self, unit: impl Into<String>) -> Self {
        Self { unit: Some(unit.into()), ..self }
    }

    /// Sets what is inside of meshes that [`encode_file`](Self::encode_file) reads. A solid that is
    /// passed to [`encode`](Self::encode) brings its own rule. It replaces
    /// [`EncodeOptions::inside`], in the same way as `band`.
    pub fn inside(self, inside: impl Into<Inside>) -> Self {
        Self { inside: Some(inside.into()), ..self }
    }

    /// Sets the domain, from which the cells come. The default is [`Domain::Bisection`].
    pub fn domain(self, domain: Domain<'a>) -> Self {
        Self { domain, ..self }
    }

    /// Records the file that the mesh came from. [`encode_file`](Self::encode_file) records its own
    /// file instead.
    pub fn source(self, source: Source) -> Self {
        Self { source, ..self }
    }

    /// Sets whether [`encode_file`](Self::encode_file) repairs a mesh without a well-defined inside
    /// ([`SolidMesh::with_repair`]). The asset records what was changed
    /// ([`Source::repair`](crate::asset::about::Source::repair)). The default is
    /// [`RepairMode::Never`].
    pub fn repair(self, repair: RepairMode) -> Self {
        Self { repair, ..self }
    }

    /// Sets the sampler for [`Method::Sampled`](super::Method::Sampled). The default is the
    /// [`Processor`], in `f64`.
    pub fn sampler(self, sampler: &'a dyn Sampler) -> Self {
        Self { sampler, ..self }
    }

    /// Shares the progress with another thread, which can watch and cancel the encoding.
    pub fn progress(self, progress: &'a Progress) -> Self {
        Self { progress: Some(progress), ..self }
    }

    /// Encodes a solid, on all threads of the current rayon pool. The same solid and options give
    /// the same bytes on any number of threads.
    ///
    /// # Errors
    /// [`EncodeError`]: an option is not valid for the solid or the domain, the mesh is too large
    /// for the file format or has no short lists, or [`Progress::cancel`] was called. Nothing is
    /// written anywhere.
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::{Encoder, SolidMesh};
    /// # use tesdf::mesh::{MeshFormat, read_bytes};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    /// # let mesh = read_bytes(obj.as_bytes(), MeshFormat::Obj)?.mesh;
    /// let solid = SolidMesh::new(mesh)?;
    /// let asset = Encoder::new().encode(&solid)?;
    /// assert_eq!(asset.face_count(), 4);
    /// # Ok(())
    /// # }
    /// ```
    pub fn encode(&self, solid: &SolidMesh) -> Result<TeSdf, EncodeError> {
        self.encode_from(solid, &self.source, None)
    }

    /// Reads a mesh file, checks that the mesh is a solid, and encodes it.
    ///
    /// The asset records the name and the BLAKE3 of the file as its [`Source`], and the unit of a
    /// file that has one, unless [`unit`](Self::unit) was called. Warnings about a mesh that can be
    /// encoded ([`SolidMesh::warnings`]) are not reported.
    ///
    /// # Errors
    /// [`EncodeFileError`]: the file cannot be read, its mesh has no well-defined inside, or it
    /// cannot be [encoded](Self::encode).
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::{Encoder, Preset};
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let folder = tempfile::tempdir()?;
    /// # let path = folder.path().join("part.obj");
    /// # std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")?;
    /// // STL, OBJ, PLY, OFF, glTF, GLB or 3MF
    /// let asset = Encoder::new().preset(Preset::Compact).encode_file(&path)?;
    /// assert_eq!(asset.about().source.name, "part.obj");
    /// # Ok(())
    /// # }
    /// ```
    pub fn encode_file(&self, path: impl AsRef<Path>) -> Result<TeSdf, EncodeFileError> {
        self.encode_path(path.as_ref())
    }

    fn encode_path(&self, path: &Path) -> Result<TeSdf, EncodeFileError> {
        let inside = self.resolved().inside;
        let options = SolidOptions { inside, repair: self.repair, ..SolidOptions::default() };
        let loaded = SolidMesh::load(path, &options)?;
        self.encode_from(&loaded.solid, &loaded.source(), loaded.report.unit.as_deref())
            .map_err(|source| EncodeFileError::Encode { path: loaded.path, source })
    }

    fn encode_from(
        &self,
        solid: &SolidMesh,
        source: &Source,
        unit_of_file: Option<&str>,
    ) -> Result<TeSdf, EncodeError> {
        let unwatched = Progress::default();
        let request = Request {
            domain: self.domain,
            source,
            options: &self.resolved().or_unit(unit_of_file),
            sampler: self.sampler,
            progress: self.progress.unwrap_or(&unwatched),
        };
        pipeline::encode(solid, &request)
    }

    fn resolved(&self) -> EncodeOptions {
        let mut options = self.options.clone();
        options.band = self.band.unwrap_or(options.band);
        options.unit = self.unit.clone().or(options.unit);
        options.inside = self.inside.unwrap_or(options.inside);
        options
    }
}

impl TeSdf {
    /// Reads a mesh file, checks that the mesh is a solid, and encodes it with the defaults:
    /// [`Encoder::encode_file`] of [`Encoder::new`].
    ///
    /// # Errors
    /// [`EncodeFileError`]: the file cannot be read, its mesh has no well-defined inside, or it
    /// cannot be encoded.
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::TeSdf;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let folder = tempfile::tempdir()?;
    /// # let path = folder.path().join("part.obj");
    /// # std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")?;
    /// let asset = TeSdf::encode_file(&path)?; // STL, OBJ, PLY, OFF, glTF, GLB or 3MF
    /// asset.save(path.with_extension("tesdf"))?;
    /// # Ok(())
    /// # }
    /// ```
    pub fn encode_file(path: impl AsRef<Path>) -> Result<Self, EncodeFileError> {
        Encoder::new().encode_file(path)
    }
}

/// Why a mesh file cannot be encoded. The message names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EncodeFileError {
    /// The file gives no solid.
    #[error(transparent)]
    Solid(#[from] ReadSolidError),
    /// The solid cannot be encoded.
    #[error("{}: {source}", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// The error of the encoder.
        source: EncodeError,
    },
}

impl EncodeFileError {
    /// The file.
    pub fn path(&self) -> &Path {
        match self {
            Self::Solid(error) => error.path(),
            Self::Encode { path, .. } => path,
        }
    }
}
