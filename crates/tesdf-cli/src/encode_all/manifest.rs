//! The files that say what became of each mesh. docs/many-meshes.md describes their fields.
use serde::Serialize;
use tesdf::asset::FORMAT_VERSION;
use tesdf::encode::EncodeOptions;

use super::Shard;
use super::job::{Asset, Done, Job, State};
use super::meshes::{Details, Mesh};
use crate::terminal::report::Failure;

/// `manifest.json`: all that does not change from run to run.
#[derive(Serialize)]
pub struct Manifest<'a> {
    tesdf: &'static str,
    format_version: u32,
    domain: &'static str,
    options: &'a EncodeOptions,
    shard: Option<[u32; 2]>,
    assets: usize,
    failed: usize,
    bytes: u64,
    meshes: Vec<Entry<'a>>,
}

#[derive(Serialize)]
struct Entry<'a> {
    mesh: &'a str,
    #[serde(flatten)]
    details: &'a Details,
    #[serde(flatten)]
    asset: Option<&'a Asset>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<&'a str>,
}

/// `times.json`: what changes from run to run.
#[derive(Serialize)]
pub struct Times<'a> {
    pub seconds: f64,
    pub threads: usize,
    pub jobs: usize,
    pub meshes: Vec<Time<'a>>,
}

#[derive(Serialize)]
pub struct Time<'a> {
    mesh: &'a str,
    state: State,
    seconds: f64,
}

impl<'a> Manifest<'a> {
    /// The manifest, and the times of the meshes. `done` has the results in the order of `meshes`.
    pub fn new(
        job: &'a Job,
        shard: Option<Shard>,
        meshes: &'a [Mesh],
        done: &'a [Done],
    ) -> (Self, Vec<Time<'a>>) {
        let both = || meshes.iter().zip(done);
        let entry = |(mesh, done): (&'a Mesh, &'a Done)| {
            let (asset, error) = (done.result.as_ref().ok(), done.result.as_ref().err());
            let error = error.map(String::as_str);
            Entry { mesh: &mesh.name, details: &mesh.entry, asset, error }
        };
        let assets = || done.iter().filter_map(|done| done.result.as_ref().ok());
        let manifest = Self {
            tesdf: env!("CARGO_PKG_VERSION"),
            format_version: FORMAT_VERSION,
            domain: job.domain(),
            options: job.options(),
            shard: shard.map(Shard::numbers),
            assets: assets().count(),
            failed: done.len() - assets().count(),
            bytes: assets().map(|asset| asset.bytes).sum(),
            meshes: both().map(entry).collect(),
        };
        let time = |(mesh, done): (&'a Mesh, &Done)| Time {
            mesh: &mesh.name,
            state: done.state,
            seconds: done.seconds,
        };
        (manifest, both().map(time).collect())
    }

    /// The meshes without an asset, with their errors.
    pub fn failures(&self) -> impl Iterator<Item = (&'a str, &'a str)> {
        self.meshes.iter().filter_map(|entry| Some((entry.mesh, entry.error?)))
    }

    /// Sum of the sizes of the assets.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// The name of a file of this run. Parts have files of their own.
pub fn file_name(name: &str, shard: Option<Shard>) -> String {
    match shard.map(Shard::numbers) {
        Some([number, of]) => format!("{name}-{number}-of-{of}.json"),
        None => format!("{name}.json"),
    }
}

/// The bytes of a JSON file.
///
/// # Errors
/// A value has no JSON.
pub fn to_json(value: &impl Serialize) -> Result<Vec<u8>, Failure> {
    let mut bytes =
        serde_json::to_vec_pretty(value).map_err(|e| Failure::new(format!("cannot write JSON: {e}")))?;
    bytes.push(b'\n');
    Ok(bytes)
}
