//! Encoded meshes of scenes, kept from one run to the next.
use std::env;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use tesdf::TeSdf;
use tesdf::base::Inside;
use tesdf::mesh::{LoadedMesh, RepairMode, TriangleMesh, read};

/// Part of the keys: it is raised when the encoder makes other bytes of the same mesh.
const ENCODER: u32 = 1;

/// A folder of encoded meshes. Their names are hashes of the mesh file, of its mesh, of the options
/// and of the version of this program. Several programs may use it at once, and any file in it may
/// be removed at any time; one whose checksums are wrong is made anew.
#[derive(Clone, Debug)]
pub struct AssetCache {
    folder: PathBuf,
    encoded: Arc<Mutex<Vec<PathBuf>>>,
}

impl AssetCache {
    /// A cache in a folder, which is made when the first mesh is kept.
    pub fn at(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), encoded: Arc::default() }
    }

    /// The cache of the user: the folder that the environment variable `TESDF_CACHE` names, or `tesdf`
    /// in the folder for caches of the system. `None` where the variable is empty, or the user has no
    /// such folder.
    pub fn of_user() -> Option<Self> {
        let folder = |name: &str| env::var_os(name).map(PathBuf::from);
        if let Some(folder) = folder("TESDF_CACHE") {
            return (!folder.as_os_str().is_empty()).then(|| Self::at(folder));
        }
        let of_system = match env::consts::OS {
            "windows" => folder("LOCALAPPDATA"),
            "macos" => env::home_dir().map(|home| home.join("Library/Caches")),
            _ => folder("XDG_CACHE_HOME")
                .filter(|folder| folder.is_absolute())
                .or_else(|| env::home_dir().map(|home| home.join(".cache"))),
        };
        of_system.map(|folder| Self::at(folder.join("tesdf")))
    }

    /// Its folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The mesh files, or names of meshes in memory, that were encoded so far because they were not
    /// in it.
    pub fn encoded(&self) -> Vec<PathBuf> {
        self.encoded.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// The hash of a mesh in memory, in hexadecimal digits.
    pub fn blake3_of(mesh: &TriangleMesh) -> String {
        hashed("", mesh)
    }

    /// The asset of a mesh file: that of the cache, or what `encode` makes, which is kept: an asset
    /// of this file under the rule and the repair, with the preset "fast". A cache that cannot be read
    /// or written costs the time of encoding, and nothing else.
    ///
    /// # Errors
    /// Those of `encode`.
    pub fn get<E>(
        &self,
        file: &Path,
        inside: Inside,
        repair: RepairMode,
        encode: impl FnOnce() -> Result<TeSdf, E>,
    ) -> Result<TeSdf, E> {
        self.keep(file, || read(file).ok().map(|mesh| key(file, &mesh, inside, repair)), encode)
    }

    /// As [`get`](Self::get), for a mesh in memory; [`encoded`](Self::encoded) tells its `name`.
    ///
    /// # Errors
    /// Those of `encode`.
    pub fn of_mesh<E>(
        &self,
        name: &str,
        mesh: &TriangleMesh,
        inside: Inside,
        encode: impl FnOnce() -> Result<TeSdf, E>,
    ) -> Result<TeSdf, E> {
        let key = || {
            let options = format!("{} {ENCODER} {inside} parts", env!("CARGO_PKG_VERSION"));
            Some(hashed(&options, mesh))
        };
        self.keep(Path::new(name), key, encode)
    }

    fn keep<E>(
        &self,
        file: &Path,
        key: impl Fn() -> Option<String>,
        encode: impl FnOnce() -> Result<TeSdf, E>,
    ) -> Result<TeSdf, E> {
        // A file that cannot be read has no key, and `encode` says why.
        let before = key();
        let path = before.as_ref().map(|key| self.folder.join(format!("{key}.tesdf")));
        let whole = |path: &PathBuf| {
            let asset = TeSdf::open(path).ok()?;
            asset.verify_checksums().is_ok().then_some(asset)
        };
        if let Some(asset) = path.as_ref().and_then(whole) {
            return Ok(asset);
        }
        let asset = encode()?;
        self.encoded.lock().unwrap_or_else(PoisonError::into_inner).push(file.to_owned());
        // The file may have changed meanwhile.
        if let Some(path) = path.filter(|_| before == key()) {
            let _ = fs::create_dir_all(&self.folder);
            let _ = asset.save(path);
        }
        Ok(asset)
    }
}

/// The name of the asset of a mesh.
fn key(
    file: &Path,
    LoadedMesh { mesh, report, .. }: &LoadedMesh,
    inside: Inside,
    repair: RepairMode,
) -> String {
    let mut options = format!("{} {ENCODER} {inside} {repair:?}", env!("CARGO_PKG_VERSION"));
    // The asset tells the name of its file.
    let _ = write!(options, " {} {}", report.source_blake3, file.display());
    // What Gmsh makes of a file depends on its version.
    hashed(&options, mesh)
}

fn hashed(options: &str, mesh: &TriangleMesh) -> String {
    let mut hash = blake3::Hasher::new();
    hash.update(options.as_bytes());
    hash.update(bytemuck::cast_slice(mesh.vertices()));
    hash.update(bytemuck::cast_slice(mesh.faces()));
    hash.finalize().to_hex().to_string()
}
