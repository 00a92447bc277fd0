//! Merges vertices at the same position.
use std::collections::HashMap;

use glam::DVec3;

/// The distinct positions of the used vertices, and the position of each vertex.
pub(super) struct Welded {
    /// Distinct positions, in the order of their first vertices; `-0.0` becomes `0.0`.
    pub positions: Vec<DVec3>,
    /// For each distinct position, the first vertex there.
    pub first: Vec<u32>,
    /// For each vertex the index of its position; `None` when it is not used.
    pub target: Vec<Option<u32>>,
}

/// Merges vertices whose coordinates are bitwise equal; `-0.0` equals `0.0`.
///
/// There is no tolerance: any fixed tolerance would be wrong for small parts, such as a part of a
/// few millimetres given in metres.
pub(super) fn weld_equal(positions: &[DVec3], used: &[bool]) -> Welded {
    let mut welded =
        Welded { positions: Vec::new(), first: Vec::new(), target: Vec::with_capacity(positions.len()) };
    let mut ids: HashMap<[u64; 3], u32> = HashMap::with_capacity(positions.len() / 4);
    for (i, (&p, &is_used)) in positions.iter().zip(used).enumerate() {
        welded.target.push(is_used.then(|| {
            // Adding +0.0 turns -0.0 into 0.0 and changes no other value.
            let p = p + DVec3::ZERO;
            *ids.entry(p.to_array().map(f64::to_bits)).or_insert_with(|| {
                welded.positions.push(p);
                welded.first.push(i as u32);
                welded.positions.len() as u32 - 1
            })
        }));
    }
    welded
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_positions_merge_and_neighbouring_floats_do_not() {
        let p = DVec3::new(0.0, 0.1, 1e-30);
        let near = DVec3::new(0.0, 0.1f64.next_up(), 1e-30);
        let minus = DVec3::new(-0.0, 0.1, 1e-30);
        let welded = weld_equal(&[p, DVec3::NAN, near, minus, p], &[true, false, true, true, true]);
        assert_eq!(welded.target, [Some(0), None, Some(1), Some(0), Some(0)]);
        assert_eq!(welded.positions, [p, near]);
        assert_eq!(welded.first, [0, 2]);
    }
}
