//! One way to encode a mesh: made, counted and compared with exact distances.
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use serde::Serialize;
use tesdf::encode::{Deformation, EncodeOptions, Encoder, Method, Refinement, Sampler, Sampling, Threshold};
use tesdf::evaluate::{BandReport, EvaluateOptions, evaluate};
use tesdf::inspect::{InspectOptions, inspect};
use tesdf::{Progress, TeSdf};

use super::domains::Place;
use super::output;
use tesdf_terminal::progress::{Bar, watched};
use tesdf_terminal::report::Failure;

/// How lists are made.
#[derive(Clone, Debug)]
pub struct Way {
    /// As rows name the encoder: `certified`, or Q / ε.
    pub encoder: String,
    /// As rows name the domain.
    pub domain: String,
    /// What the library is asked for.
    pub options: EncodeOptions,
}

/// What is done with the tetrahedra of a conforming domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cells {
    /// Nothing.
    Plain,
    /// They are bisected where that pays.
    Bisected,
}

impl Way {
    /// With the certified encoder.
    pub fn certified(place: &Place, cells: Cells, deformation: Deformation) -> Self {
        let plain = place.conforming.is_some() && cells == Cells::Plain;
        let refinement = if plain { Refinement::None } else { Refinement::ByCost };
        let domain = match place.conforming {
            Some(_) if !plain => format!("{}, bisected", place.name),
            _ => place.name.clone(),
        };
        let options = EncodeOptions { refinement, deformation, ..EncodeOptions::default() };
        Self { encoder: "certified".into(), domain, options }
    }

    /// With Algorithm 1 and the paper's α, in plain tetrahedra.
    pub fn sampled(place: &Place, resolution: u32, threshold: f64, deformation: Deformation) -> Self {
        let certified = Self::certified(place, Cells::Plain, deformation);
        let sampling = Sampling { resolution, threshold: Threshold::Absolute(threshold), ..Sampling::PAPER };
        Self {
            encoder: format!("{resolution} / {}", output::threshold(threshold)),
            options: EncodeOptions { method: Method::Sampled(sampling), ..certified.options.clone() },
            ..certified
        }
    }

    /// The same with lists of at most so many faces.
    pub fn truncated(&self, max_entries: u32) -> Self {
        let options = EncodeOptions { max_entries: Some(max_entries), ..self.options.clone() };
        Self { options, ..self.clone() }
    }

    /// Encodes, the samples of Algorithm 1 looked at by `sampler`; also the seconds that it took.
    ///
    /// # Errors
    /// What the library refused.
    pub fn encode(&self, place: &Place, sampler: &dyn Sampler) -> Result<(TeSdf, f64), Failure> {
        let start = Instant::now();
        let progress = Progress::default();
        let never = AtomicBool::new(false);
        let asset = watched(&progress, &never, || {
            Encoder::new()
                .options(self.options.clone())
                .domain(place.domain())
                .source(place.source.clone())
                .sampler(sampler)
                .progress(&progress)
                .encode(&place.solid)
        });
        let asset = asset.map_err(|e| Failure::new(format!("{}: {e}", place.source.name)))?;
        Ok((asset, start.elapsed().as_secs_f64()))
    }
}

/// What an asset costs.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Cost {
    /// Tetrahedra with a list or without.
    pub tetrahedra: usize,
    /// Mean length of the lists.
    pub list_mean: f64,
    /// Length of the longest.
    pub longest_list: usize,
    /// Mean length of the lists by volume.
    pub list_by_volume: f64,
    /// Faces and nodes that a query reads, by volume.
    pub read_by_volume: f64,
    /// The paper account, MiB.
    pub memory_mib: f64,
    /// Every byte that is resident.
    pub whole_bytes: usize,
}

impl Cost {
    pub fn of(asset: &TeSdf) -> Self {
        let found = inspect(asset, &InspectOptions::default());
        // Reads of far cells are part of the other mean; this one is of lists alone.
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
/// As [`evaluate`].
pub fn compare(assets: &[&TeSdf], options: &EvaluateOptions) -> Result<Vec<BandReport>, Failure> {
    let bar = Bar::new("comparing with exact distances");
    evaluate(assets, options, |share| bar.set(share)).map_err(Failure::new)
}
