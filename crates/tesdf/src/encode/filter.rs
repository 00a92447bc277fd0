//! The certified filter: which faces can be closest somewhere in a cell.

use glam::DVec3;

use super::surface::{Requirement, Surface};
use crate::domain::Cell;
use crate::geometry::{Feature, Regions, triangle_meets_tetrahedron};

/// Rounding margin of the rules, in the local frame, where the body's diagonal is 0.5 to 1.
///
/// A computed distance is off by a few 2^-53 of the coordinates' size, which is the cube's side. A face is dropped only
/// when another one is closer by more than this times the side (at least 1), so that rounding cannot make two
/// faces drop each other.
pub const MARGIN: f64 = 4e-15;

/// How near to a cell a face counts as meeting it, in the local frame.
///
/// More than the rounding of point location (2^-52 of the cube), and more than the 1e-9 × diagonal
/// under which the gradient comes from the faces around the closest feature: those are listed, too.
pub const PAD: f64 = 2.5e-9;

/// A face's distance at one point.
#[derive(Clone, Copy, Debug)]
pub struct Probe {
    distance: f64,
    point: DVec3,
    regions: Regions,
}

/// A face that may be closest somewhere in the cell at hand, with its distance at the cell's corners.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    /// Face id.
    pub face: u32,
    /// Distances at the four corners of the cell.
    pub at: [Probe; 4],
}

/// A candidate that the rules did not drop.
#[derive(Clone, Copy, Debug)]
pub struct Survivor {
    /// Index among the candidates.
    pub index: u32,
    /// What of the face the cell needs.
    pub requirement: Requirement,
    /// Whether the face comes within [`PAD`] of the cell.
    pub meets: bool,
}

/// What the filter found out about a cell.
#[derive(Debug)]
pub struct Filtered {
    /// Faces that may be closest somewhere in the cell, or that meet it.
    pub survivors: Vec<Survivor>,
    /// Whether a face comes within [`PAD`] of the cell.
    pub crossing: bool,
    /// Least distance at the centroid.
    pub distance: f64,
    /// The closest candidate, and what of it, at each corner and the centroid.
    pub closest: [(u32, Feature); 5],
}

/// Buffers that one thread uses again from cell to cell.
#[derive(Debug, Default)]
pub struct Scratch {
    centroid: Vec<Probe>,
    chord: [Vec<f64>; 4],
    alive: Vec<u32>,
}

/// Rule C compares all pairs; cells with more survivors than this are bisected anyway, and compared below.
const MAX_SHARING: usize = 256;

/// More candidates than this are only thinned out by [`by_points`].
const MANY: usize = 1 << 12;

/// At most this many faces stand against each candidate in the plane rule; the nearest ones.
const MAX_RIVALS: usize = 96;

/// Distance of `face` at `p`.
pub fn probe(surface: &Surface, face: u32, p: DVec3) -> Probe {
    let (closest, regions) = surface.triangles[face as usize].closest_and_regions(p);
    Probe { distance: closest.distance, point: closest.point, regions }
}

/// Applies rules A (point), B (plane) and C (shared feature) to the candidates of a cell.
///
/// See `docs/math.md` for the proofs. Rules A and B drop a face only for one that is closer in all of
/// the cell by [`MARGIN`], a strict partial order, so that their sequence does not matter; rule C then
/// goes through the rest in order. Faces that meet the cell are kept whole whatever the rules say.
pub fn filter(surface: &Surface, cell: &Cell, candidates: &[Candidate], scratch: &mut Scratch) -> Filtered {
    let m = cell.centroid();
    let c = &cell.corners;
    let margin = surface.margin;
    scratch.centroid.clear();
    scratch.centroid.extend(candidates.iter().map(|g| probe(surface, g.face, m)));

    // The closest points seen from the corners and the centroid: the strongest rivals for rule A.
    let nearest = |d: &dyn Fn(usize) -> f64| {
        (0..candidates.len()).fold((f64::INFINITY, 0), |b, i| if d(i) < b.0 { (d(i), i) } else { b })
    };
    let mut reach = [[0.0; 4]; 5];
    let mut closest = [(0, Feature::Face); 5];
    let mut distance = f64::INFINITY;
    for k in 0..5 {
        let at = |i: usize| if k < 4 { &candidates[i].at[k] } else { &scratch.centroid[i] };
        let (d, i) = nearest(&|i| at(i).distance);
        closest[k] = (i as u32, at(i).regions.least());
        reach[k] = c.map(|c| c.distance(at(i).point) + margin);
        distance = d;
    }

    scratch.alive.clear();
    scratch.alive.extend((0..candidates.len() as u32).filter(|&i| {
        let g = &candidates[i as usize];
        !reach.iter().any(|r| (0..4).all(|k| g.at[k].distance >= r[k]))
    }));

    if candidates.len() > MANY {
        return by_points(surface, candidates, scratch, distance, radius(cell), closest);
    }
    for (k, chord) in scratch.chord.iter_mut().enumerate() {
        chord.clear();
        chord.extend(scratch.alive.iter().map(|&i| candidates[i as usize].at[k].distance));
    }
    keep_rivals(&mut scratch.chord);
    let least: [f64; 4] =
        std::array::from_fn(|k| scratch.chord[k].iter().copied().fold(f64::INFINITY, f64::min));

    let width = cell.width();
    let radius = radius(cell);
    let mut filtered = Filtered { survivors: Vec::new(), crossing: false, distance, closest };
    let mut kept_whole = |index: u32| {
        let meets = triangle_meets_tetrahedron(
            &surface.triangles[candidates[index as usize].face as usize].corners,
            c,
            PAD,
        );
        filtered.crossing |= meets;
        meets
    };
    let mut dropped_but_meeting = Vec::new();
    let mut survivors = Vec::with_capacity(scratch.alive.len());
    let mut next_alive = scratch.alive.iter().copied().peekable();
    for index in 0..candidates.len() as u32 {
        let g = &candidates[index as usize];
        let alive = next_alive.next_if_eq(&index).is_some();
        if !alive && scratch.centroid[index as usize].distance > radius + PAD {
            continue;
        }
        let tangents = tangents(g, &scratch.centroid[index as usize], cell, width, margin);
        let low = tangents
            .iter()
            .map(|t| t.iter().copied().fold(f64::INFINITY, f64::min))
            .fold(f64::NEG_INFINITY, f64::max);
        let meets = low <= PAD && kept_whole(index);
        if alive && !beaten(&tangents, &scratch.chord, &least) {
            let regions = g.at.iter().fold(Regions(0x7f), |r, p| r.and(p.regions));
            let feature = if meets { Feature::Face } else { regions.least() };
            survivors.push(Survivor { index, requirement: surface.requirement(g.face, feature), meets });
        } else if meets {
            let requirement = surface.requirement(g.face, Feature::Face);
            dropped_but_meeting.push(Survivor { index, requirement, meets });
        }
    }
    share_features(surface, candidates, &mut survivors);
    survivors.extend(dropped_but_meeting);
    filtered.survivors = survivors;
    filtered
}

/// Radius of the least ball around the centroid that holds the cell.
pub fn radius(cell: &Cell) -> f64 {
    let m = cell.centroid();
    cell.corners.iter().map(|c| c.distance(m)).fold(0.0, f64::max)
}

/// Rule A alone, for the shallow cells: they are bisected anyway, and rules B and C compare pairs.
///
/// Whatever may come within the padding of the cell stays.
fn by_points(
    surface: &Surface,
    candidates: &[Candidate],
    scratch: &Scratch,
    distance: f64,
    radius: f64,
    closest: [(u32, Feature); 5],
) -> Filtered {
    let mut alive = scratch.alive.iter().copied().peekable();
    let survivors = (0..candidates.len() as u32)
        .filter(|i| alive.next_if_eq(i).is_some() | (scratch.centroid[*i as usize].distance <= radius + PAD))
        .map(|index| {
            let requirement = surface.requirement(candidates[index as usize].face, Feature::Face);
            Survivor { index, requirement, meets: true }
        })
        .collect();
    Filtered { survivors, crossing: distance <= radius + PAD, distance, closest }
}

/// Linear lower bounds of d(·, g) over the cell, each by its values at the corners.
///
/// d(·, g) is convex, so it lies above its tangent at the centroid and at each corner. The slope is off by the rounding
/// of the closest point over the distance, so the bound is lowered by as much times the width of the cell, and once more
/// by the margin that rule B asks for.
fn tangents(g: &Candidate, centroid: &Probe, cell: &Cell, width: f64, margin: f64) -> [[f64; 4]; 5] {
    let c = &cell.corners;
    let tangent = |at: DVec3, p: &Probe| {
        if p.distance <= margin {
            return [-margin; 4];
        }
        let slope = (at - p.point) / p.distance;
        let lowered = p.distance - margin - margin * width / p.distance;
        c.map(|c| lowered + slope.dot(c - at))
    };
    [
        tangent(cell.centroid(), centroid),
        tangent(c[0], &g.at[0]),
        tangent(c[1], &g.at[1]),
        tangent(c[2], &g.at[2]),
        tangent(c[3], &g.at[3]),
    ]
}

/// Rule B: some rival's chord lies below one of the tangents at all four corners.
fn beaten(tangents: &[[f64; 4]; 5], chord: &[Vec<f64>; 4], least: &[f64; 4]) -> bool {
    tangents.iter().any(|t| (0..4).all(|k| t[k] >= least[k]) && any_below(t, chord))
}

fn any_below(t: &[f64; 4], chord: &[Vec<f64>; 4]) -> bool {
    let n = chord[0].len();
    let (c0, c1, c2, c3) = (&chord[0][..n], &chord[1][..n], &chord[2][..n], &chord[3][..n]);
    (0..n).any(|h| c0[h] <= t[0] && c1[h] <= t[1] && c2[h] <= t[2] && c3[h] <= t[3])
}

/// Keeps the [`MAX_RIVALS`] chords of least sum.
fn keep_rivals(chord: &mut [Vec<f64>; 4]) {
    let n = chord[0].len();
    if n <= MAX_RIVALS {
        return;
    }
    let sum = |h: usize| chord[0][h] + chord[1][h] + chord[2][h] + chord[3][h];
    let mut order: Vec<usize> = (0..n).collect();
    order.select_nth_unstable_by(MAX_RIVALS, |&a, &b| sum(a).total_cmp(&sum(b)).then(a.cmp(&b)));
    order.truncate(MAX_RIVALS);
    *chord = std::array::from_fn(|k| order.iter().map(|&h| chord[k][h]).collect());
}

/// Rule C: of the faces that are one and the same edge or vertex to the whole cell, one is enough.
fn share_features(surface: &Surface, candidates: &[Candidate], survivors: &mut Vec<Survivor>) {
    if survivors.len() > MAX_SHARING {
        return;
    }
    let mut i = 0;
    while i < survivors.len() {
        let g = survivors[i];
        let shared = !surface.is_face(g.requirement)
            && survivors.iter().any(|h| {
                h.index != g.index && surface.holds(candidates[h.index as usize].face, g.requirement)
            });
        if shared {
            survivors.remove(i);
        } else {
            i += 1;
        }
    }
}
