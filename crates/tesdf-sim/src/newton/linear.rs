//! Matrices of 6 × 6 blocks, with one block row per body, and their sparse factorisation.
//!
//! Crates for sparse matrices (faer, nalgebra-sparse) know single numbers only, and would have to
//! find the blocks again. With blocks the order and the fill are those of a graph of bodies, and
//! the arithmetic is that of nalgebra's 6 × 6 matrices.
use nalgebra::{Cholesky, LU, Matrix6, U6, Vector6};

use super::group::{Coupled, Group};
use super::pattern::{Column, Pattern};
use super::relative::{Other, Relative};

/// A block matrix. Of a symmetric one it stores one of each pair of mirrored blocks.
#[derive(Clone, Debug)]
pub struct BlockMatrix<'a> {
    pattern: &'a Pattern,
    diagonal: Vec<Matrix6<f64>>,
    /// The rows are of the lower body of the pair, the columns of the higher one.
    upper: Vec<Matrix6<f64>>,
    /// The blocks below the diagonal; `None` where the matrix is symmetric.
    lower: Option<Vec<Matrix6<f64>>>,
}

/// The factors of a matrix.
pub struct Factor<'a> {
    pattern: &'a Pattern,
    blocks: Blocks,
}

enum Blocks {
    /// `L` of `L Lᵀ`: its diagonal blocks by body, and the others in the order of the pattern.
    Cholesky { diagonal: Vec<Matrix6<f64>>, below: Vec<Matrix6<f64>> },
    /// The block `L` has ones on its diagonal; `beside` is `D⁻¹ U` right of it. Rows are exchanged
    /// within the blocks of the diagonal only.
    Lu { diagonal: Vec<Lu6>, below: Vec<Matrix6<f64>>, beside: Vec<Matrix6<f64>> },
}

type Lu6 = LU<f64, U6, U6>;

impl<'a> BlockMatrix<'a> {
    /// A symmetric block-diagonal matrix; the blocks of `pattern` are zero.
    pub fn symmetric(pattern: &'a Pattern, diagonal: Vec<Matrix6<f64>>) -> Self {
        Self { pattern, diagonal, upper: vec![Matrix6::zeros(); pattern.pairs.len()], lower: None }
    }

    /// The same for a matrix that need not stay symmetric.
    pub fn general(pattern: &'a Pattern, diagonal: Vec<Matrix6<f64>>) -> Self {
        Self {
            lower: Some(vec![Matrix6::zeros(); pattern.pairs.len()]),
            ..Self::symmetric(pattern, diagonal)
        }
    }

    /// Adds a matrix of the velocity of a group.
    pub fn add(&mut self, of: &Group, matrix: &Matrix6<f64>) {
        match of {
            Group::Relative(relative) => self.add_relative(relative, matrix),
            Group::Coupled(coupled) => self.add_coupled(coupled, matrix[(0, 0)]),
        }
    }

    /// Adds `Jᵀ stiffness J` of the rate of a coupling.
    fn add_coupled(&mut self, Coupled { bodies, pairs }: &Coupled, stiffness: f64) {
        for (body, j) in bodies {
            self.diagonal[*body] += (stiffness * j) * j.transpose();
        }
        for &([low, high], pair) in pairs {
            let (low, high) = (bodies[low].1, bodies[high].1);
            self.upper[pair] += (stiffness * low) * high.transpose();
            if let Some(lower) = &mut self.lower {
                lower[pair] += (stiffness * high) * low.transpose();
            }
        }
    }

    fn add_relative(&mut self, of: &Relative, matrix: &Matrix6<f64>) {
        self.diagonal[of.body] += matrix;
        if let Some(Other { body, pair }) = of.other {
            let beside = of.times_transport(matrix);
            let below = of.transported(matrix);
            self.diagonal[body] += of.transported(&beside);
            let [low, high] = if of.body < body { [beside, below] } else { [below, beside] };
            self.upper[pair] -= low;
            if let Some(lower) = &mut self.lower {
                lower[pair] -= high;
            }
        }
    }

    /// Factors the matrix: by Cholesky where it is symmetric, else by elimination without pivoting
    /// between bodies. Returns `None` when rounding made it indefinite or singular.
    pub fn factor(self) -> Option<Factor<'a>> {
        let pattern = self.pattern;
        let blocks = match self.lower {
            None => cholesky(pattern, self.diagonal, &self.upper)?,
            Some(lower) => lu(pattern, self.diagonal, &self.upper, &lower)?,
        };
        Some(Factor { pattern, blocks })
    }
}

fn cholesky(pattern: &Pattern, mut diagonal: Vec<Matrix6<f64>>, upper: &[Matrix6<f64>]) -> Option<Blocks> {
    let mut below = vec![Matrix6::zeros(); pattern.blocks];
    for (place, upper) in pattern.of_pair.iter().zip(upper) {
        below[place.block] = if place.is_lower_row { *upper } else { upper.transpose() };
    }
    for Column { body, rows, first, products } in &pattern.columns {
        let factor = Cholesky::new(diagonal[*body])?.unpack();
        let blocks = *first..first + rows.len();
        for block in &mut below[blocks.clone()] {
            *block = factor.solve_lower_triangular_unchecked(&block.transpose()).transpose();
        }
        diagonal[*body] = factor;
        let mut products = products.iter();
        for (j, (&row, block)) in rows.iter().zip(blocks.clone()).enumerate() {
            let of_row = below[block];
            diagonal[row] -= of_row * of_row.transpose();
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
    Some(Blocks::Cholesky { diagonal, below })
}

fn lu(
    pattern: &Pattern,
    mut full: Vec<Matrix6<f64>>,
    upper: &[Matrix6<f64>],
    lower: &[Matrix6<f64>],
) -> Option<Blocks> {
    let mut below = vec![Matrix6::zeros(); pattern.blocks];
    let mut beside = below.clone();
    for (place, (upper, lower)) in pattern.of_pair.iter().zip(upper.iter().zip(lower)) {
        let (row, column) = if place.is_lower_row { (upper, lower) } else { (lower, upper) };
        below[place.block] = *row;
        beside[place.block] = *column;
    }
    let mut diagonal: Vec<Option<Lu6>> = vec![None; full.len()];
    for Column { body, rows, first, products } in &pattern.columns {
        let factor = LU::new(full[*body]);
        for block in &mut beside[*first..first + rows.len()] {
            if !factor.solve_mut(block) {
                return None;
            }
        }
        let mut products = products.iter();
        for (j, &row) in rows.iter().enumerate() {
            let (of_row, of_column) = (below[first + j], beside[first + j]);
            full[row] -= of_row * of_column;
            for (i, place) in (0..j).zip(&mut products) {
                // Between `rows[i]`, the lower body, and `rows[j]`.
                let upper = below[first + i] * of_column;
                let lower = of_row * beside[first + i];
                let (row, column) = if place.is_lower_row { (upper, lower) } else { (lower, upper) };
                below[place.block] -= row;
                beside[place.block] -= column;
            }
        }
        if !factor.is_invertible() {
            return None;
        }
        diagonal[*body] = Some(factor);
    }
    let diagonal = diagonal.into_iter().collect::<Option<_>>()?;
    Some(Blocks::Lu { diagonal, below, beside })
}

impl Factor<'_> {
    /// Solves for one right-hand side.
    pub fn solve(&self, rhs: &[Vector6<f64>]) -> Vec<Vector6<f64>> {
        let mut x = rhs.to_vec();
        let columns = &self.pattern.columns;
        match &self.blocks {
            Blocks::Cholesky { diagonal, below } => {
                for Column { body, rows, first, .. } in columns {
                    let eliminated = diagonal[*body].solve_lower_triangular_unchecked(&x[*body]);
                    x[*body] = eliminated;
                    rows.iter().zip(&below[*first..]).for_each(|(&row, block)| x[row] -= block * eliminated);
                }
                for Column { body, rows, first, .. } in columns.iter().rev() {
                    let mut left = x[*body];
                    rows.iter().zip(&below[*first..]).for_each(|(&row, block)| left -= block.tr_mul(&x[row]));
                    x[*body] = diagonal[*body].tr_solve_lower_triangular_unchecked(&left);
                }
            }
            Blocks::Lu { diagonal, below, beside } => {
                for Column { body, rows, first, .. } in columns {
                    // The matrix is known to be invertible.
                    diagonal[*body].solve_mut(&mut x[*body]);
                    let eliminated = x[*body];
                    rows.iter().zip(&below[*first..]).for_each(|(&row, block)| x[row] -= block * eliminated);
                }
                for Column { body, rows, first, .. } in columns.iter().rev() {
                    let mut left = x[*body];
                    rows.iter().zip(&beside[*first..]).for_each(|(&row, block)| left -= block * x[row]);
                    x[*body] = left;
                }
            }
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use nalgebra::{DMatrix, DVector};

    use super::*;

    fn dense(matrix: &BlockMatrix<'_>) -> DMatrix<f64> {
        let n = 6 * matrix.diagonal.len();
        let mut dense = DMatrix::zeros(n, n);
        for (k, block) in matrix.diagonal.iter().enumerate() {
            dense.fixed_view_mut::<6, 6>(6 * k, 6 * k).copy_from(block);
        }
        for (k, &(a, b)) in matrix.pattern.pairs.iter().enumerate() {
            let upper = matrix.upper[k];
            let lower = matrix.lower.as_ref().map_or_else(|| upper.transpose(), |lower| lower[k]);
            dense.fixed_view_mut::<6, 6>(6 * a, 6 * b).copy_from(&upper);
            dense.fixed_view_mut::<6, 6>(6 * b, 6 * a).copy_from(&lower);
        }
        dense
    }

    fn vector(random: &mut fastrand::Rng) -> Vector6<f64> {
        Vector6::from_fn(|_, _| random.f64() - 0.5)
    }

    fn offset(random: &mut fastrand::Rng) -> DVec3 {
        DVec3::from_array([(); 3].map(|()| random.f64() - 0.5))
    }

    /// Adds random matrices of relative velocities to the pairs of a pattern, which are symmetric
    /// where the matrix is.
    fn fill(mut matrix: BlockMatrix<'_>, seed: u64) -> BlockMatrix<'_> {
        let random = &mut fastrand::Rng::with_seed(seed);
        let turned = if matrix.lower.is_some() { 0.3 } else { 0.0 };
        let pattern = matrix.pattern;
        for &(low, high) in &pattern.pairs {
            for (body, other) in [(low, Some(high)), (high, Some(low)), (low, None)] {
                let root = Matrix6::from_fn(|_, _| random.f64() - 0.5);
                let skew = Matrix6::from_fn(|_, _| random.f64() - 0.5);
                let of = Group::Relative(Relative::new(body, other, offset(random), pattern));
                matrix.add(&of, &(root * root.transpose() + turned * (skew - skew.transpose())));
            }
        }
        matrix
    }

    /// A ring, a chain, a grid, a clique, a star and bodies without any pair; symmetric and not.
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
            let diagonal = vec![Matrix6::identity() * 0.01; bodies];
            let random = &mut fastrand::Rng::with_seed(99);
            let rhs: Vec<_> = (0..bodies).map(|_| vector(random)).collect();
            let flat = DVector::from_iterator(6 * bodies, rhs.iter().flat_map(|v| v.iter().copied()));
            for empty in [BlockMatrix::symmetric, BlockMatrix::general] {
                let matrix = fill(empty(&pattern, diagonal.clone()), seed as u64);
                let expected = dense(&matrix).lu().solve(&flat).unwrap();
                let found = matrix.factor().unwrap().solve(&rhs);
                let worst =
                    (0..6 * bodies).map(|k| (found[k / 6][k % 6] - expected[k]).abs()).fold(0.0, f64::max);
                assert!(worst < 1e-12 * expected.amax(), "case {seed}: {worst:e} of {:e}", expected.amax());
            }
        }
    }

    #[test]
    fn a_chain_has_no_fill() {
        let pattern = Pattern::new(100, (1..100).map(|k| (k - 1, k)).collect());
        assert_eq!(pattern.blocks, 99);
    }

    #[test]
    fn an_indefinite_matrix_has_no_factor() {
        let pattern = Pattern::new(2, vec![(0, 1)]);
        let mut matrix = BlockMatrix::symmetric(&pattern, vec![Matrix6::identity(); 2]);
        let of = Group::Relative(Relative::new(0, Some(1), DVec3::ZERO, &pattern));
        matrix.add(&of, &-Matrix6::repeat(1.0));
        assert!(matrix.factor().is_none());
        assert!(BlockMatrix::general(&pattern, vec![Matrix6::zeros(); 2]).factor().is_none());
    }

    /// The matrix of a group is that of its derivatives by the velocities, and what acts on it is
    /// their transpose. Relative velocities with bodies in either order and alone; couplings of one
    /// to three bodies.
    #[test]
    fn groups_have_their_derivatives() {
        let pattern = Pattern::new(3, vec![(0, 1), (0, 2), (1, 2)]);
        let random = &mut fastrand::Rng::with_seed(7);
        let relative = [(0, Some(1)), (1, Some(0)), (1, None)]
            .map(|(body, other)| Group::Relative(Relative::new(body, other, offset(random), &pattern)));
        let coupled = [vec![0, 1, 2], vec![0, 2], vec![1]].map(|bodies| {
            let bodies = bodies.into_iter().map(|body| (body, vector(random))).collect();
            Group::Coupled(Coupled::new(bodies, &pattern))
        });
        for of in relative.into_iter().chain(coupled) {
            let mut derivatives = DMatrix::zeros(6, 18);
            for k in 0..18 {
                let mut velocity = [Vector6::zeros(); 3];
                velocity[k / 6][k % 6] = 1.0;
                derivatives.column_mut(k).copy_from_slice(&of.of(&velocity));
            }
            let matrix = Matrix6::from_fn(|_, _| random.f64() - 0.5);
            let mut sum = BlockMatrix::general(&pattern, vec![Matrix6::zeros(); 3]);
            sum.add(&of, &matrix);
            let expected = derivatives.transpose() * matrix * &derivatives;
            assert!((dense(&sum) - &expected).amax() < 1e-14, "{of:?}");
            let momentum = vector(random);
            let mut to = [Vector6::zeros(); 3];
            of.act(momentum.into(), &mut to);
            let expected = derivatives.transpose() * momentum;
            let off = (0..18).map(|k| (to[k / 6][k % 6] - expected[k]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-15, "{of:?}");
        }
    }
}
