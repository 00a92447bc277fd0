//! Symmetric positive definite matrices of 6 × 6 blocks, with one block row per body, and their
//! sparse Cholesky factorisation.
//!
//! Crates for sparse matrices (faer, nalgebra-sparse) know single numbers only, and would have to
//! find the blocks again. With blocks the order and the fill are those of a graph of bodies, and
//! the arithmetic is that of nalgebra's 6 × 6 matrices.
use std::collections::BTreeSet;

use glam::{DMat3, DVec3};
use nalgebra::{Cholesky, Matrix3, Matrix6, Vector6};

/// Which off-diagonal blocks may be nonzero, and the order in which bodies are eliminated.
#[derive(Clone, Debug)]
pub struct Pattern {
    /// Pairs of different bodies, the lower one first; sorted.
    pairs: Vec<(usize, usize)>,
    /// For each pair its block in the factor.
    of_pair: Vec<Place>,
    /// The columns of the factor, in the order of elimination.
    columns: Vec<Column>,
    /// Number of blocks of the factor below the diagonal.
    blocks: usize,
}

/// A block of the factor below the diagonal.
#[derive(Clone, Copy, Debug)]
struct Place {
    block: usize,
    /// Whether the lower body of the pair is the row. Otherwise it is the column.
    is_lower_row: bool,
}

#[derive(Clone, Debug)]
struct Column {
    body: usize,
    /// The bodies of the nonzero blocks below the diagonal; their blocks are `first..`.
    rows: Vec<usize>,
    first: usize,
    /// For each two of these rows, the first in front of the second: the block that their product
    /// changes.
    products: Vec<Place>,
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

/// A symmetric block matrix. Of each pair of mirrored blocks it stores the upper one.
#[derive(Clone, Debug)]
pub struct BlockMatrix<'a> {
    pattern: &'a Pattern,
    diagonal: Vec<Matrix6<f64>>,
    upper: Vec<Matrix6<f64>>,
}

impl<'a> BlockMatrix<'a> {
    /// A block-diagonal matrix; the blocks of `pattern` are zero.
    pub fn new(pattern: &'a Pattern, diagonal: Vec<Matrix6<f64>>) -> Self {
        Self { pattern, diagonal, upper: vec![Matrix6::zeros(); pattern.pairs.len()] }
    }

    /// Adds `k j jᵀ`, where `j` is zero except at the bodies of `sides`. `pair` is the index of
    /// these two bodies in the pattern.
    #[inline]
    pub fn add(&mut self, sides: &[Option<(usize, Vector6<f64>)>; 2], pair: Option<usize>, k: f64) {
        for (body, j) in sides.iter().flatten() {
            self.diagonal[*body].ger(k, j, j, 1.0);
        }
        if let ([Some((a, ja)), Some((b, jb))], Some(pair)) = (sides, pair) {
            let (low, high) = if a < b { (ja, jb) } else { (jb, ja) };
            self.upper[pair].ger(k, low, high, 1.0);
        }
    }

    /// Adds `Jᵀ S J`, where `J` gives the velocity of the first body at its arm relative to that of
    /// the second one at its own, and `S` is symmetric. A side is a body and its arm, the vector
    /// from the centre of mass, m.
    pub fn add_point(&mut self, sides: [Option<(usize, DVec3)>; 2], pair: Option<usize>, s: DMat3) {
        let s = Matrix3::from(s.to_cols_array_2d());
        let products = sides.map(|side| side.map(|(body, arm)| (body, cross(arm), s * cross(arm))));
        for (body, r, sr) in products.iter().flatten() {
            add_blocks(&mut self.diagonal[*body], 1.0, [s, -sr, sr.transpose() * -1.0, -(r * sr)]);
        }
        if let ([Some((a, ra, sra)), Some((b, rb, srb))], Some(pair)) = (products, pair) {
            let (rl, srl, srh) = if a < b { (ra, sra, srb) } else { (rb, srb, sra) };
            add_blocks(&mut self.upper[pair], -1.0, [s, -srh, srl.transpose() * -1.0, -(rl * srh)]);
        }
    }

    /// Solves by Cholesky factorisation. Returns `None` when rounding made the matrix indefinite.
    pub fn solve(&self, rhs: &[Vector6<f64>]) -> Option<Vec<Vector6<f64>>> {
        let mut diagonal = self.diagonal.clone();
        let mut below = vec![Matrix6::zeros(); self.pattern.blocks];
        for (place, upper) in self.pattern.of_pair.iter().zip(&self.upper) {
            below[place.block] = if place.is_lower_row { *upper } else { upper.transpose() };
        }
        let mut x = rhs.to_vec();
        for Column { body, rows, first, products } in &self.pattern.columns {
            let factor = Cholesky::new(diagonal[*body])?.unpack();
            let blocks = *first..first + rows.len();
            for block in &mut below[blocks.clone()] {
                *block = factor.solve_lower_triangular_unchecked(&block.transpose()).transpose();
            }
            let eliminated = factor.solve_lower_triangular_unchecked(&x[*body]);
            x[*body] = eliminated;
            diagonal[*body] = factor;
            let mut products = products.iter();
            for (j, (&row, block)) in rows.iter().zip(blocks.clone()).enumerate() {
                let of_row = below[block];
                diagonal[row] -= of_row * of_row.transpose();
                x[row] -= of_row * eliminated;
                for (i, place) in (0..j).zip(&mut products) {
                    // `rows` is sorted, so `i` is the lower body.
                    let lower = below[first + i];
                    below[place.block] -= match place.is_lower_row {
                        true => lower * of_row.transpose(),
                        false => of_row * lower.transpose(),
                    };
                }
            }
        }
        for Column { body, rows, first, .. } in self.pattern.columns.iter().rev() {
            let mut left = x[*body];
            for (row, block) in rows.iter().zip(&below[*first..]) {
                left -= block.tr_mul(&x[*row]);
            }
            x[*body] = diagonal[*body].tr_solve_lower_triangular_unchecked(&left);
        }
        Some(x)
    }
}

/// The matrix whose product with a vector is the cross product of `a` with it.
fn cross(a: DVec3) -> Matrix3<f64> {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// Adds `k` times the 3 × 3 blocks, row by row.
fn add_blocks(to: &mut Matrix6<f64>, k: f64, [a, b, c, d]: [Matrix3<f64>; 4]) {
    for (block, (row, column)) in [(a, (0, 0)), (b, (0, 3)), (c, (3, 0)), (d, (3, 3))] {
        let mut view = to.fixed_view_mut::<3, 3>(row, column);
        view += block * k;
    }
}

/// Scalar product of two block vectors.
pub fn dot(a: &[Vector6<f64>], b: &[Vector6<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;

    fn dense(matrix: &BlockMatrix<'_>) -> DMatrix<f64> {
        let n = 6 * matrix.diagonal.len();
        let mut dense = DMatrix::zeros(n, n);
        for (k, block) in matrix.diagonal.iter().enumerate() {
            dense.fixed_view_mut::<6, 6>(6 * k, 6 * k).copy_from(block);
        }
        for (&(a, b), block) in matrix.pattern.pairs.iter().zip(&matrix.upper) {
            dense.fixed_view_mut::<6, 6>(6 * a, 6 * b).copy_from(block);
            dense.fixed_view_mut::<6, 6>(6 * b, 6 * a).copy_from(&block.transpose());
        }
        dense
    }

    /// A matrix of `bodies` bodies with random rows between those of `pairs`.
    fn random_matrix(pattern: &Pattern, bodies: usize, seed: u64) -> BlockMatrix<'_> {
        let random = &mut fastrand::Rng::with_seed(seed);
        let mut vector = || Vector6::from_fn(|_, _| random.f64() - 0.5);
        let mut matrix = BlockMatrix::new(pattern, vec![Matrix6::identity() * 0.01; bodies]);
        for (k, &(a, b)) in pattern.pairs.iter().enumerate() {
            for _ in 0..20 {
                matrix.add(&[Some((b, vector())), Some((a, vector()))], Some(k), 3.0);
            }
            matrix.add(&[Some((a, vector())), None], None, 5.0);
        }
        matrix
    }

    /// A ring, a chain, a grid, a clique, a star and bodies without any pair.
    #[test]
    fn the_sparse_solution_is_the_dense_one() {
        let chain = |n: usize| (1..n).map(|k| (k - 1, k)).collect::<Vec<_>>();
        let ring = [chain(7), vec![(0, 6)]].concat();
        let grid = (0..20).flat_map(|k| [(k, k + 1), (k, k + 5)]).filter(|&(_, b)| b < 20).collect();
        let clique = (0..6).flat_map(|b| (0..b).map(move |a| (a, b))).collect();
        let star = (1..9).map(|k| (0, k)).collect();
        let cases =
            [(1, vec![]), (4, vec![]), (7, ring), (30, chain(30)), (20, grid), (6, clique), (9, star)];
        for (seed, (bodies, pairs)) in cases.into_iter().enumerate() {
            let pattern = Pattern::new(bodies, pairs);
            let matrix = random_matrix(&pattern, bodies, seed as u64);
            let random = &mut fastrand::Rng::with_seed(99);
            let rhs: Vec<_> = (0..bodies).map(|_| Vector6::from_fn(|_, _| random.f64() - 0.5)).collect();
            let found = matrix.solve(&rhs).unwrap();
            let flat = DVector::from_iterator(6 * bodies, rhs.iter().flat_map(|v| v.iter().copied()));
            let expected = dense(&matrix).cholesky().unwrap().solve(&flat);
            let worst =
                (0..6 * bodies).map(|k| (found[k / 6][k % 6] - expected[k]).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-12 * expected.amax(), "case {seed}: {worst:e} of {:e}", expected.amax());
        }
    }

    #[test]
    fn a_chain_has_no_fill() {
        let pattern = Pattern::new(100, (1..100).map(|k| (k - 1, k)).collect());
        assert_eq!(pattern.blocks, 99);
    }

    #[test]
    fn an_indefinite_matrix_has_no_solution() {
        let pattern = Pattern::new(2, vec![(0, 1)]);
        let mut matrix = BlockMatrix::new(&pattern, vec![Matrix6::identity(); 2]);
        matrix.add(&[Some((0, Vector6::repeat(1.0))), Some((1, Vector6::repeat(1.0)))], Some(0), -1.0);
        assert_eq!(matrix.solve(&[Vector6::zeros(); 2]), None);
    }

    /// Three rows, one for each axis of the world, have the same effect as a point.
    #[test]
    fn a_point_is_three_rows() {
        let pattern = Pattern::new(2, vec![(0, 1)]);
        let arms = [DVec3::new(0.3, -0.2, 0.9), DVec3::new(-1.3, 0.4, 0.1)];
        let s = DMat3::from_cols(
            DVec3::new(3.0, 0.5, 0.2),
            DVec3::new(0.5, 2.0, -0.3),
            DVec3::new(0.2, -0.3, 1.0),
        );
        for sides in [
            [Some((0, arms[0])), Some((1, arms[1]))],
            [Some((1, arms[0])), Some((0, arms[1]))],
            [None, Some((1, arms[1]))],
        ] {
            let mut points = BlockMatrix::new(&pattern, vec![Matrix6::zeros(); 2]);
            points.add_point(sides, Some(0), s);
            // J has a row for each axis; S mixes them.
            let row = |axis: DVec3| {
                let side = |k: usize, sign: f64| {
                    sides[k].map(|(body, arm)| {
                        (body, sign * super::super::integrate::pack(axis, arm.cross(axis)))
                    })
                };
                [side(0, 1.0), side(1, -1.0)]
            };
            let mut expected = DMatrix::zeros(12, 12);
            for (i, p) in DVec3::AXES.into_iter().enumerate() {
                for (j, q) in DVec3::AXES.into_iter().enumerate() {
                    for (a, ja) in row(p).into_iter().flatten() {
                        for (b, jb) in row(q).into_iter().flatten() {
                            let mut view = expected.fixed_view_mut::<6, 6>(6 * a, 6 * b);
                            view += ja * jb.transpose() * s.col(j)[i];
                        }
                    }
                }
            }
            assert!((dense(&points) - &expected).amax() < 1e-14, "{sides:?}");
        }
    }
}
