//! Anderson's acceleration of an iteration `x ← g(x)` (Walker and Ni, *Anderson acceleration for
//! fixed-point iterations*, SIAM J. Numer. Anal. 2011).
use nalgebra::{DMatrix, DVector};

use crate::newton::lanes::Lanes;

/// So many changes are combined.
const DEPTH: usize = 5;
/// What keeps the weights of changes that are nearly parallel bounded, as a share.
const REGULAR: f64 = 1e-12;

/// `g(x) − x` and `g(x)`, or changes of both.
struct Seen {
    left: Vec<Lanes>,
    to: Vec<Lanes>,
}

/// What an iteration over values that are not negative has seen.
#[derive(Default)]
pub struct Anderson {
    changes: Vec<Seen>,
    last: Option<Seen>,
}

impl Anderson {
    /// The values that are to follow `from`, of which the iteration makes `to`.
    pub fn next(&mut self, from: &[Lanes], to: Vec<Lanes>) -> Vec<Lanes> {
        let seen = Seen { left: difference(&to, from), to };
        if let Some(last) = self.last.take() {
            self.changes.truncate(DEPTH - 1);
            let change =
                Seen { left: difference(&seen.left, &last.left), to: difference(&seen.to, &last.to) };
            self.changes.insert(0, change);
        }
        let mut next = seen.to.clone();
        if let Some(weights) = self.weights(&seen.left) {
            for (change, weight) in self.changes.iter().zip(&weights) {
                next.iter_mut().zip(&change.to).for_each(|(next, change)| *next -= *change * *weight);
            }
        }
        self.last = Some(seen);
        next.into_iter().map(|value| value.max(Lanes::ZERO)).collect()
    }

    /// Those with which the changes leave least of `left`.
    fn weights(&self, left: &[Lanes]) -> Option<DVector<f64>> {
        let changes = || self.changes.iter().map(|change| &change.left);
        let count = self.changes.len();
        let products = changes().flat_map(|a| changes().map(|b| dot(a, b)));
        let mut products = DMatrix::from_iterator(count, count, products);
        let regular = REGULAR * products.trace();
        (0..count).for_each(|k| products[(k, k)] += regular);
        let aims = DVector::from_iterator(count, changes().map(|change| dot(change, left)));
        Some(products.cholesky()?.solve(&aims))
    }
}

fn difference(a: &[Lanes], b: &[Lanes]) -> Vec<Lanes> {
    a.iter().zip(b).map(|(a, b)| *a - *b).collect()
}

fn dot(a: &[Lanes], b: &[Lanes]) -> f64 {
    a.iter().zip(b).fold(Lanes::ZERO, |sum, (a, b)| sum + *a * *b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The numbers of iterations until this share is left: plain, and accelerated.
    fn iterations(g: impl Fn(Lanes) -> Lanes, share: f64) -> [usize; 2] {
        let left = |x: Lanes| (g(x) - x).map(f64::abs).sum();
        [false, true].map(|accelerated| {
            let (mut x, mut history) = (Lanes([1.0, 2.0, 3.0, 4.0]), Anderson::default());
            let first = left(x);
            let mut count = 0;
            while left(x) > share * first {
                count += 1;
                x = if accelerated { history.next(&[x], vec![g(x)])[0] } else { g(x) };
            }
            count
        })
    }

    #[test]
    fn linear_iterations_end_after_as_many_rounds_as_they_have_rates() {
        let rates = Lanes([0.5, 0.9, 0.95, 0.99]);
        let [plain, accelerated] = iterations(|x| x * rates + Lanes::splat(1.0), 1e-6);
        assert!(plain > 500, "{plain}");
        assert!(accelerated <= 6, "{accelerated}");
    }

    #[test]
    fn iterations_that_slow_down_take_less_than_half_as_long() {
        // As limits of friction that vanish: x falls by a share of x.
        let [plain, accelerated] = iterations(|x| x - x * x * 0.1, 1e-4);
        assert!(2 * accelerated < plain, "{accelerated} of {plain}");
    }

    #[test]
    fn a_solution_stays() {
        let mut history = Anderson::default();
        let at = vec![Lanes([0.0, 1.0, 2.0, 3.0])];
        for _ in 0..10 {
            assert_eq!(history.next(&at, at.clone()), at);
        }
    }
}
