//! Symmetric positive definite matrices of 6 × 6 blocks, with one block row per body.
use nalgebra::{Cholesky, DMatrix, DVector, Matrix6, Vector6};

/// The off-diagonal blocks that may be nonzero.
#[derive(Clone, Debug)]
pub struct Pattern {
    /// Pairs of different bodies, the lower one first; sorted.
    pub pairs: Vec<(usize, usize)>,
}

/// A symmetric block matrix. Of each pair of mirrored blocks it stores the upper one.
#[derive(Clone, Debug)]
pub struct BlockMatrix<'a> {
    pattern: &'a Pattern,
    diagonal: Vec<Matrix6<f64>>,
    upper: Vec<Matrix6<f64>>,
}

/// Conjugate gradients stop at this relative residual. The line search and the next Newton
/// iteration correct a smaller error.
const RESIDUAL: f64 = 1e-8;

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

    /// Solves by dense Cholesky factorisation. Returns `None` when rounding made the matrix
    /// indefinite.
    pub fn solve_dense(&self, rhs: &[Vector6<f64>]) -> Option<Vec<Vector6<f64>>> {
        if let ([block], [rhs]) = (self.diagonal.as_slice(), rhs) {
            return Some(vec![Cholesky::new(*block)?.solve(rhs)]);
        }
        let n = 6 * self.diagonal.len();
        let mut dense = DMatrix::zeros(n, n);
        for (k, block) in self.diagonal.iter().enumerate() {
            dense.fixed_view_mut::<6, 6>(6 * k, 6 * k).copy_from(block);
        }
        // The factorisation reads the lower triangle only.
        for (&(a, b), block) in self.pattern.pairs.iter().zip(&self.upper) {
            dense.fixed_view_mut::<6, 6>(6 * b, 6 * a).copy_from(&block.transpose());
        }
        let mut x = DVector::from_iterator(n, rhs.iter().flat_map(|v| v.iter().copied()));
        Cholesky::new(dense)?.solve_mut(&mut x);
        Some((0..rhs.len()).map(|k| x.fixed_rows::<6>(6 * k).into_owned()).collect())
    }

    /// Solves by conjugate gradients, preconditioned with the diagonal blocks. Returns `None` when
    /// rounding made one of these blocks indefinite.
    pub fn solve_iterative(&self, rhs: &[Vector6<f64>]) -> Option<Vec<Vector6<f64>>> {
        let factors: Vec<_> = self.diagonal.iter().map(|b| Cholesky::new(*b)).collect::<Option<_>>()?;
        let precondition =
            |r: &[Vector6<f64>]| factors.iter().zip(r).map(|(f, r)| f.solve(r)).collect::<Vec<_>>();
        let mut x = vec![Vector6::zeros(); rhs.len()];
        let mut r = rhs.to_vec();
        let mut z = precondition(&r);
        let mut p = z.clone();
        let mut rz = dot(&r, &z);
        let goal = RESIDUAL * RESIDUAL * rz;
        // In exact arithmetic one iteration per unknown suffices. Twice that number allows for
        // rounding.
        for _ in 0..12 * rhs.len() {
            if rz <= goal {
                break;
            }
            let ap = self.times(&p);
            let alpha = rz / dot(&p, &ap);
            if !alpha.is_finite() {
                break;
            }
            for k in 0..x.len() {
                x[k] += alpha * p[k];
                r[k] -= alpha * ap[k];
            }
            z = precondition(&r);
            let next = dot(&r, &z);
            let beta = next / rz;
            rz = next;
            for k in 0..p.len() {
                p[k] = z[k] + beta * p[k];
            }
        }
        Some(x)
    }

    fn times(&self, x: &[Vector6<f64>]) -> Vec<Vector6<f64>> {
        let mut y: Vec<_> = self.diagonal.iter().zip(x).map(|(block, x)| block * x).collect();
        for (&(a, b), block) in self.pattern.pairs.iter().zip(&self.upper) {
            y[a] += block * x[b];
            y[b] += block.tr_mul(&x[a]);
        }
        y
    }
}

/// Scalar product of two block vectors.
pub fn dot(a: &[Vector6<f64>], b: &[Vector6<f64>]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dense_and_iterative_solve_the_system() {
        let random = &mut fastrand::Rng::with_seed(7);
        let mut vector = || Vector6::from_fn(|_, _| random.f64() - 0.5);
        let pattern = Pattern { pairs: vec![(0, 1), (0, 3), (1, 2), (2, 3)] };
        let mut matrix = BlockMatrix::new(&pattern, vec![Matrix6::identity() * 0.01; 4]);
        for (k, &(a, b)) in pattern.pairs.iter().enumerate() {
            for _ in 0..20 {
                matrix.add(&[Some((b, vector())), Some((a, vector()))], Some(k), 3.0);
            }
            matrix.add(&[Some((a, vector())), None], None, 5.0);
        }
        let expected: Vec<_> = (0..4).map(|_| vector()).collect();
        let rhs = matrix.times(&expected);
        for found in [matrix.solve_dense(&rhs).unwrap(), matrix.solve_iterative(&rhs).unwrap()] {
            let worst = found.iter().zip(&expected).map(|(f, e)| (f - e).amax()).fold(0.0, f64::max);
            assert!(worst < 1e-6, "{worst}");
        }
    }
}
