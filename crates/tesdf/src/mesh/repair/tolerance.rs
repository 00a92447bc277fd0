//! Finds the weld tolerance that closes the cracks of a mesh.
use super::{RepairOptions, join, orient::agree, split::open_lengths};
use crate::{
    mesh::{Topology, TriangleMesh},
    parallel::*,
};

/// The tolerances that are tried, relative to the diagonal.
const TRIED: [f64; 7] = [1e-7, 3e-7, 1e-6, 3e-6, 1e-5, 3e-5, 1e-4];
/// The tolerances of [`TRIED`] that show whether there are cracks: the largest one, and one in the
/// middle, since the largest may destroy details of a mesh.
const PROBED: [usize; 2] = [6, 3];
/// Where no tolerance closes all cracks, the least one that closes all but this share of the length
/// that any of them closes is taken.
const SHARE_LEFT: f64 = 0.05;
/// A tolerance that closes less than this share of the open edges' length closes no crack: it only
/// merges vertices of short edges.
const NOTHING: f64 = 1e-2;

/// The least weld tolerance that closes the cracks of a mesh, in the mesh's unit. Seven
/// tolerances are tried, from 1e-7 to 1e-4 of the diagonal, rounded to two digits.
///
/// It is the least one after which all edges are balanced. Where there is none, because the mesh
/// has holes as well, it is the least one that closes at least 95 % of the length of open edges
/// that any of them closes. `None` when no tolerance closes a crack, or the mesh is closed without.
pub fn closing_tolerance(mesh: &TriangleMesh) -> Option<f64> {
    let without = open_length(mesh, &RepairOptions::DEFAULT)?;
    if without == 0.0 {
        return None;
    }
    let tolerances = TRIED.map(|share| two_digits(share * mesh.diagonal()));
    let welded = |tolerance: &f64| {
        let options = RepairOptions { weld_tolerance: Some(*tolerance), ..RepairOptions::DEFAULT };
        open_length(mesh, &options)
    };
    let lengths = |tolerances: &[f64]| -> Vec<Option<f64>> { tolerances.par_iter().map(welded).collect() };
    // A mesh without cracks ends here, after two attempts.
    let closes = |length: Option<f64>| length.is_some_and(|l| l < without * (1.0 - NOTHING));
    if !lengths(&PROBED.map(|k| tolerances[k])).into_iter().any(closes) {
        return None;
    }
    let mut found: Vec<(f64, f64)> = Vec::with_capacity(TRIED.len());
    for (tolerance, length) in tolerances.into_iter().zip(lengths(&tolerances)) {
        match length {
            Some(0.0) => return Some(tolerance),
            // Nothing is left of the mesh with this tolerance, and with larger ones.
            None => break,
            Some(length) => found.push((tolerance, length)),
        }
    }
    let least = found.iter().map(|&(_, length)| length).fold(without, f64::min);
    let closed = without - least;
    let enough = |&&(_, length): &&(f64, f64)| length <= least + SHARE_LEFT * closed;
    found.iter().find(enough).filter(|_| closed > NOTHING * without).map(|&(tolerance, _)| tolerance)
}

/// A length with two significant digits, which people can type.
fn two_digits(length: f64) -> f64 {
    format!("{length:.1e}").parse().unwrap_or(length)
}

/// Total length of the unbalanced edges after the faces are joined and agree. `None` when that
/// fails.
fn open_length(mesh: &TriangleMesh, options: &RepairOptions) -> Option<f64> {
    let (mut draft, _) = join(mesh, options).ok()?;
    agree(&mut draft);
    Some(open_lengths(&draft.vertices, &Topology::new(&draft.faces))[1])
}
