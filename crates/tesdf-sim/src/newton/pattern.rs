//! Which blocks of a matrix of pairs of bodies may be nonzero, and the order of its elimination.
use std::collections::BTreeSet;

/// Which off-diagonal blocks may be nonzero, and the order in which bodies are eliminated.
#[derive(Clone, Debug)]
pub struct Pattern {
    /// Pairs of different bodies, the lower one first; sorted.
    pub pairs: Vec<(usize, usize)>,
    /// For each pair its block in the factor.
    pub of_pair: Vec<Place>,
    /// The columns of the factor, in the order of elimination.
    pub columns: Vec<Column>,
    /// Number of blocks of the factor below the diagonal.
    pub blocks: usize,
}

/// A block of the factor below the diagonal.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub block: usize,
    /// Whether the lower body of the pair is the row. Otherwise it is the column.
    pub is_lower_row: bool,
}

#[derive(Clone, Debug)]
pub struct Column {
    pub body: usize,
    /// The bodies of the nonzero blocks below the diagonal; their blocks are `first..`.
    pub rows: Vec<usize>,
    pub first: usize,
    /// For each two of these rows, the first in front of the second: the block that their product
    /// changes.
    pub products: Vec<Place>,
}

impl Pattern {
    /// The pattern of a matrix whose off-diagonal blocks are at `pairs`: pairs of different bodies,
    /// the lower one first. Bodies are eliminated in the order of least degree (Tinney and Walker
    /// 1967), of equal ones the lowest first.
    pub fn new(bodies: usize, mut pairs: Vec<(usize, usize)>) -> Self {
        pairs.sort_unstable();
        pairs.dedup();
        let mut neighbours = vec![BTreeSet::new(); bodies];
        for &(a, b) in &pairs {
            neighbours[a].insert(b);
            neighbours[b].insert(a);
        }
        let mut left: BTreeSet<(usize, usize)> = neighbours.iter().map(BTreeSet::len).zip(0..).collect();
        let (mut columns, mut blocks) = (Vec::with_capacity(bodies), 0);
        let mut rank = vec![0; bodies];
        while let Some((_, body)) = left.pop_first() {
            rank[body] = columns.len();
            let rows: Vec<usize> = std::mem::take(&mut neighbours[body]).into_iter().collect();
            for &row in &rows {
                left.remove(&(neighbours[row].len(), row));
                neighbours[row].remove(&body);
                neighbours[row].extend(rows.iter().filter(|&&other| other != row));
                left.insert((neighbours[row].len(), row));
            }
            let first = blocks;
            blocks += rows.len();
            columns.push(Column { body, rows, first, products: Vec::new() });
        }
        let place = |columns: &[Column], a: usize, b: usize| {
            let (column, row) = if rank[a] < rank[b] { (a, b) } else { (b, a) };
            let column = &columns[rank[column]];
            let block = column.first + column.rows.partition_point(|&other| other < row);
            Place { block, is_lower_row: row == a.min(b) }
        };
        for k in 0..columns.len() {
            let rows = &columns[k].rows;
            let two = (0..rows.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
            columns[k].products = two.map(|(i, j)| place(&columns, rows[i], rows[j])).collect();
        }
        let of_pair = pairs.iter().map(|&(a, b)| place(&columns, a, b)).collect();
        Self { pairs, of_pair, columns, blocks }
    }

    /// The index of the pair of bodies `a` and `b`, in any order.
    pub fn pair(&self, a: usize, b: usize) -> Option<usize> {
        self.pairs.binary_search(&(a.min(b), a.max(b))).ok()
    }
}
