//! Islands: groups of free bodies that no row connects to another group.
use super::rows::Row;

/// Free bodies and the rows between them, both in ascending order.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Island {
    /// Indices of the free bodies.
    pub bodies: Vec<usize>,
    /// Indices of the rows in the list of rows.
    pub rows: Vec<usize>,
}

/// The islands, sorted by their lowest body. A body without rows is in no island.
pub fn islands(bodies: usize, rows: &[Row]) -> Vec<Island> {
    let mut parent: Vec<usize> = (0..bodies).collect();
    for row in rows {
        let mut bodies = row.bodies();
        if let Some(&(a, _)) = bodies.next() {
            bodies.for_each(|&(b, _)| join(&mut parent, a, b));
        }
    }
    let mut of_root: Vec<Option<usize>> = vec![None; bodies];
    let mut islands: Vec<Island> = Vec::new();
    let mut touched = vec![false; bodies];
    for row in rows {
        row.bodies().for_each(|&(body, _)| touched[body] = true);
    }
    for body in (0..bodies).filter(|&body| touched[body]) {
        let root = root(&mut parent, body);
        let island = *of_root[root].get_or_insert_with(|| {
            islands.push(Island::default());
            islands.len() - 1
        });
        islands[island].bodies.push(body);
    }
    for (k, row) in rows.iter().enumerate() {
        if let Some(&(body, _)) = row.bodies().next()
            && let Some(island) = of_root[root(&mut parent, body)]
        {
            islands[island].rows.push(k);
        }
    }
    islands
}

/// Marks all bodies of each island that rows make of a marked one.
pub fn spread(marked: &mut [bool], rows: &[Row]) {
    for island in islands(marked.len(), rows) {
        if island.bodies.iter().any(|&k| marked[k]) {
            island.bodies.iter().for_each(|&k| marked[k] = true);
        }
    }
}

/// Makes one group of those of `a` and `b`.
pub fn join(parent: &mut [usize], a: usize, b: usize) {
    let (a, b) = (root(parent, a), root(parent, b));
    // The root is the lowest body, so the result does not depend on the order of the pairs.
    parent[a.max(b)] = a.min(b);
}

/// The lowest body of the group that `k` belongs to.
pub fn root(parent: &mut [usize], mut k: usize) -> usize {
    while parent[k] != k {
        parent[k] = parent[parent[k]];
        k = parent[k];
    }
    k
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector6;

    use glam::DVec3;

    use super::*;
    use crate::newton::rows::{Resistance, RowId, Stiffness};

    fn row(a: Option<usize>, b: Option<usize>) -> Row {
        let side = |k: Option<usize>| k.map(|k| (k, Vector6::zeros()));
        Row {
            id: RowId::Joint(0),
            arms: [DVec3::ZERO; 2],
            sides: [side(a), side(b)],
            coupled: Vec::new(),
            point: DVec3::ZERO,
            gap: 0.0,
            relaxed_gap: 0.0,
            stiffness: Stiffness::Relative(1.0),
            bounds: [0.0, f64::INFINITY],
            resistance: Resistance::Rigid,
            friction: None,
        }
    }

    #[test]
    fn fixed_bodies_do_not_connect_islands() {
        let rows = [
            row(Some(4), None),
            row(Some(0), None),
            row(Some(5), Some(2)),
            row(None, Some(2)),
            row(Some(0), Some(5)),
        ];
        let found = islands(6, &rows);
        let expected = [
            Island { bodies: vec![0, 2, 5], rows: vec![1, 2, 3, 4] },
            Island { bodies: vec![4], rows: vec![0] },
        ];
        assert_eq!(found, expected);
    }
}
