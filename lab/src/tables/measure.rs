//! Encodes a mesh with one set of options, and compares the asset with exact distances.
use std::sync::atomic::AtomicBool;
use std::time::Instant;
use tesdf::base::Named as _;

use serde::Serialize;
use tesdf::encode::{Deformation, EncodeOptions, Encoder, Method, Refinement, Sampler, Sampling, Threshold};
use tesdf::inspect::{InspectOptions, inspect};
use tesdf::{Progress, TeSdf};

use super::domains::Subject;
use super::output;
use crate::on_grid::{self, BandReport};
use tesdf::encode::Preset;
use tesdf_cli::terminal::progress::{Bar, watched};
use tesdf_cli::terminal::report::Failure;

/// The encoder, domain and options of a row.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Name of the encoder in the rows: `certified`, or Q / ε.
    pub encoder: String,
    /// Name of the domain in the rows.
    pub domain: String,
    /// Options of the library.
    pub options: EncodeOptions,
}

/// Treatment of the tetrahedra of a conforming domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cells {
    /// The tetrahedra stay as they are.
    Plain,
    /// The tetrahedra are bisected where that reduces the cost.
    Bisected,
}

impl Setup {
    /// The certified encoder.
    pub fn certified(subject: &Subject, cells: Cells, deformation: Deformation) -> Self {
        let plain = subject.conforming.is_some() && cells == Cells::Plain;
        let refinement = if plain { Refinement::None } else { Refinement::ByCost };
        let domain = match subject.conforming {
            Some(_) if !plain => format!("{}, bisected", subject.name),
            _ => subject.name.clone(),
        };
        let options = EncodeOptions { refinement, deformation, ..EncodeOptions::default() };
        Self { encoder: "certified".into(), domain, options }
    }

    /// Algorithm 1 with the paper's α, in tetrahedra that are not bisected.
    pub fn sampled(subject: &Subject, resolution: u32, threshold: f64, deformation: Deformation) -> Self {
        let certified = Self::certified(subject, Cells::Plain, deformation);
        let sampling = Sampling { resolution, threshold: Threshold::Absolute(threshold), ..Sampling::PAPER };
        Self {
            encoder: format!("{resolution} / {}", output::threshold(threshold)),
            options: EncodeOptions { method: Method::Sampled(sampling), ..certified.options.clone() },
            ..certified
        }
    }

    /// The same, with the cells of another preset. Rows name presets other than the default.
    pub fn with_preset(self, preset: Preset) -> Self {
        let Self { encoder, domain, options } = self;
        let EncodeOptions { method, refinement, deformation, .. } = options;
        let encoder = match preset {
            Preset::Default => encoder,
            _ => format!("{encoder}, {}", preset.name()),
        };
        Self {
            encoder,
            domain,
            options: EncodeOptions { method, refinement, deformation, ..EncodeOptions::preset(preset) },
        }
    }

    /// The same options, with lists of at most `max_entries` faces.
    pub fn truncated(&self, max_entries: u32) -> Self {
        let options = EncodeOptions { max_entries: Some(max_entries), ..self.options.clone() };
        Self { options, ..self.clone() }
    }

    /// Encodes, where `sampler` evaluates the samples of Algorithm 1. Returns the asset and the
    /// time, s.
    ///
    /// # Errors
    /// The errors of the encoder.
    pub fn encode(&self, subject: &Subject, sampler: &dyn Sampler) -> Result<(TeSdf, f64), Failure> {
        let start = Instant::now();
        let progress = Progress::default();
        let never = AtomicBool::new(false);
        let asset = watched(&progress, &never, || {
            Encoder::new()
                .options(self.options.clone())
                .domain(subject.domain())
                .source(subject.source.clone())
                .sampler(sampler)
                .progress(&progress)
                .encode(&subject.solid)
        });
        let asset = asset.map_err(|e| Failure::new(format!("{}: {e}", subject.source.name)))?;
        Ok((asset, start.elapsed().as_secs_f64()))
    }
}

/// Size and query cost of an asset.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Cost {
    /// Number of tetrahedra, with and without a list.
    pub tetrahedra: usize,
    /// Mean length of the lists.
    pub list_mean: f64,
    /// Length of the longest list.
    pub longest_list: usize,
    /// Mean length of the lists, weighted by volume.
    pub list_by_volume: f64,
    /// Mean number of faces and nodes that a query reads, weighted by volume.
    pub read_by_volume: f64,
    /// Memory in the paper's account, MiB.
    pub memory_mib: f64,
    /// All resident bytes.
    pub whole_bytes: usize,
}

impl Cost {
    pub fn of(asset: &TeSdf) -> Self {
        let found = inspect(asset, &InspectOptions::default());
        // `volume_weighted` includes the reads of far cells; this mean is over the lists alone.
        let reads = &found.reads;
        let listed = 1.0 - reads.fallback_volume;
        Self {
            tetrahedra: found.counts.listed_cells + found.counts.far_cells,
            list_mean: found.lists.mean,
            longest_list: found.lists.longest,
            list_by_volume: (reads.volume_weighted - reads.fallback_volume * reads.fallback) / listed,
            read_by_volume: reads.volume_weighted,
            memory_mib: found.memory.paper_mib,
            whole_bytes: found.memory.whole,
        }
    }
}

/// Compares assets of the same mesh with exact distances.
///
/// # Errors
/// The same errors as [`on_grid::compare`].
pub fn compare(assets: &[&TeSdf], fineness: u32) -> Result<Vec<BandReport>, Failure> {
    let bar = Bar::new("comparing with exact distances");
    on_grid::compare(assets, fineness, |share| bar.set(share)).map_err(Failure::new)
}
