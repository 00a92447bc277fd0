//! Reports what an asset costs in memory and how much a query of it reads.
use crate::parallel::*;
use glam::DVec3;
use serde::Serialize;

use crate::TeSdf;
use crate::asset::CellView;
use crate::domain::Classes;
use crate::geometry::{Aabb, Triangle, tetrahedron_volume};
use crate::sampling::{Random, Weighted};

/// How many random points [`inspect`] takes, and their seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct InspectOptions {
    /// Number of points near the surface. As many points are taken in cells that the face tree
    /// answers.
    pub samples: usize,
    /// The same seed gives the same points.
    pub seed: u64,
}

impl Default for InspectOptions {
    fn default() -> Self {
        Self { samples: 20_000, seed: 1 }
    }
}

/// The result of [`inspect`].
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Inspection {
    /// Numbers of faces, vertices, cells and list entries.
    pub counts: Counts,
    /// Number of tetrahedra in each class; `None` when the domain is not conforming.
    pub classes: Option<Classes>,
    /// Statistics of the list lengths. Each cell counts once.
    pub lists: ListLengths,
    /// Mean number of faces and nodes that a query reads.
    pub reads: MeanReads,
    /// Memory of the open asset, in bytes.
    pub memory: Memory,
}

/// Numbers of faces, vertices, cells and list entries.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Faces of the mesh.
    pub faces: usize,
    /// Vertices of the mesh.
    pub vertices: usize,
    /// Cells with a list.
    pub listed_cells: usize,
    /// Cells with a list that the surface enters or comes close to.
    pub crossing_cells: usize,
    /// Cells of the domain without a list: the face tree answers their points.
    pub far_cells: usize,
    /// Cells of the cube that do not belong to the domain.
    pub outside_cells: usize,
    /// Number of bisections from a root tetrahedron to the deepest cell.
    pub depth: u32,
    /// Sum of the lengths of the lists of all cells.
    pub entries: usize,
}

/// Statistics of the list lengths. Each cell counts once.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ListLengths {
    /// Mean over the cells.
    pub mean: f64,
    /// Median: half of the lists are at most this long.
    pub p50: usize,
    /// 90 % of the lists are at most this long.
    pub p90: usize,
    /// 99 % of the lists are at most this long.
    pub p99: usize,
    /// Length of the longest list.
    pub longest: usize,
}

/// Mean number of faces and nodes that a query reads.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MeanReads {
    /// Mean over points within 2 % of the diagonal from the surface. The points are random points
    /// of the surface, moved along the normal.
    pub near_surface: f64,
    /// Fraction of these points that the face tree answers.
    pub near_surface_fallback: f64,
    /// Mean over the volume of the domain, including the part that the face tree answers.
    pub volume_weighted: f64,
    /// Fraction of the domain's volume that the face tree answers.
    pub fallback_volume: f64,
    /// Mean over the volume that the face tree answers.
    pub fallback: f64,
    /// Number of points sampled near the surface. As many are sampled where the face tree answers.
    pub samples: usize,
}

/// Memory of an open asset, in bytes.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Memory {
    /// Name and size of each part: header and sections of the file, then the data that opening
    /// computes.
    pub parts: Vec<(String, usize)>,
    /// Size of the file.
    pub file: usize,
    /// Total: the file and the data that opening computes.
    pub whole: usize,
    /// `whole` divided by the number of faces.
    pub whole_per_face: f64,
    /// Data that locates a point and lists its faces: the sections `domain.*` and `lists.*`, and
    /// the table of entries.
    pub lists_and_tree: usize,
    /// Memory as the paper counts it: 4 bytes for each list entry, 16 bytes for each cell with a list,
    /// and 12 bytes for each vertex of a conforming domain that is none of the mesh.
    pub paper: usize,
    /// `paper` in MiB.
    pub paper_mib: f64,
}

/// Half width of the layer that counts as near the surface, as a fraction of the diagonal.
const NEAR: f64 = 0.02;

/// Measures an asset. The same asset and options always give the same result.
pub fn inspect(asset: &TeSdf, options: &InspectOptions) -> Inspection {
    let mut counts =
        Counts { faces: asset.face_count(), vertices: asset.vertices.len(), ..Counts::default() };
    let mut far: Vec<[DVec3; 4]> = Vec::new();
    let mut lengths = Vec::new();
    // In the local frame, volumes stay within the range of f64.
    let volume = |cell: &CellView| tetrahedron_volume(&cell.corners.map(|p| asset.frame.to_local(p))).abs();
    let (mut listed_volume, mut weighted_length) = (0.0, 0.0);
    asset.visit_cells(|cell| {
        use crate::asset::CellKind::*;
        counts.depth = counts.depth.max(cell.depth);
        match cell.kind {
            Inside | Outside | Crossing => {
                counts.listed_cells += 1;
                counts.crossing_cells += usize::from(cell.kind == Crossing);
                counts.entries += cell.list_length;
                lengths.push(cell.list_length);
                listed_volume += volume(cell);
                weighted_length += volume(cell) * cell.list_length as f64;
            }
            FarInside | FarOutside => {
                counts.far_cells += 1;
                far.push(cell.corners.map(|p| asset.frame.to_local(p)));
            }
            NotOfDomain => counts.outside_cells += 1,
        }
    });
    let far_weights = Weighted::new(far.iter().map(|c| tetrahedron_volume(c).abs()));
    let whole_volume = listed_volume + far_weights.total();
    let fallback = mean_fallback_reads(asset, &far, &far_weights, options);
    let (near_surface, near_surface_fallback) = near_surface(asset, options);
    let reads = MeanReads {
        near_surface,
        near_surface_fallback,
        volume_weighted: (weighted_length + far_weights.total() * fallback)
            / whole_volume.max(f64::MIN_POSITIVE),
        fallback_volume: far_weights.total() / whole_volume.max(f64::MIN_POSITIVE),
        fallback,
        samples: options.samples,
    };
    let classes = asset.classes();
    Inspection { classes, memory: memory(asset, &counts), lists: list_lengths(lengths), reads, counts }
}

fn list_lengths(mut lengths: Vec<usize>) -> ListLengths {
    lengths.sort_unstable();
    let at = |share: f64| {
        let rank = (share * lengths.len() as f64).ceil() as usize;
        lengths.get(rank.saturating_sub(1)).copied().unwrap_or(0)
    };
    ListLengths {
        mean: lengths.iter().sum::<usize>() as f64 / lengths.len().max(1) as f64,
        p50: at(0.5),
        p90: at(0.9),
        p99: at(0.99),
        longest: lengths.last().copied().unwrap_or(0),
    }
}

fn mean_fallback_reads(
    asset: &TeSdf,
    cells: &[[DVec3; 4]],
    weights: &Weighted,
    options: &InspectOptions,
) -> f64 {
    let reads: usize = (0..options.samples as u64)
        .into_par_iter()
        .filter_map(|i| {
            let mut random = Random::new(options.seed, i);
            let cell = cells.get(weights.pick(&mut random)?)?;
            Some(asset.reads(asset.frame.to_world(random.in_simplex(cell))).total())
        })
        .sum();
    reads as f64 / options.samples.max(1) as f64
}

/// Mean number of reads near the surface, and the fraction of points without a list.
fn near_surface(asset: &TeSdf, options: &InspectOptions) -> (f64, f64) {
    let triangle = |face: usize| asset.local_triangle(face);
    let area = |t: &Triangle| {
        let [a, b, c] = t.corners;
        0.5 * (b - a).cross(c - a).length()
    };
    let weights = Weighted::new((0..asset.face_count()).map(|f| area(&triangle(f))));
    let bounds = (0..asset.face_count()).fold(Aabb::EMPTY, |b, f| b.union(Aabb::of(&triangle(f).corners)));
    let reach = NEAR * bounds.extent().length();
    let counts = (0..options.samples as u64).into_par_iter().filter_map(|i| {
        let mut random = Random::new(options.seed, i);
        let face = triangle(weights.pick(&mut random)?);
        let point = random.in_simplex(&face.corners) + random.between(-reach, reach) * face.normal;
        let reads = asset.reads(asset.frame.to_world(point));
        Some((reads.total(), usize::from(reads.list_entries == 0)))
    });
    let (reads, fallback) = reduce(counts, || (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
    let samples = options.samples.max(1) as f64;
    (reads as f64 / samples, fallback as f64 / samples)
}

fn memory(asset: &TeSdf, counts: &Counts) -> Memory {
    let container = asset.container();
    let (records, entries) = asset.derived_bytes();
    let mut parts = vec![("header".to_string(), container.header_size())];
    parts.extend(container.sections().map(|s| (s.spec.name.to_string(), s.bytes.len())));
    let named = |prefix: &str| -> usize {
        parts.iter().filter(|(name, _)| name.starts_with(prefix)).map(|(_, bytes)| bytes).sum()
    };
    let lists_and_tree = named("domain.") + named("lists.") + entries;
    parts.push(("made on opening: faces in f32".into(), records));
    parts.push(("made on opening: entries".into(), entries));
    let file = asset.as_bytes().len();
    let whole = file + records + entries;
    let nodes = asset.conforming.as_ref().map_or(0, |domain| domain.vertices().len());
    let paper = 4 * counts.entries + 16 * counts.listed_cells + 12 * nodes;
    Memory {
        parts,
        file,
        whole,
        whole_per_face: whole as f64 / counts.faces as f64,
        lists_and_tree,
        paper,
        paper_mib: paper as f64 / f64::from(1 << 20),
    }
}
