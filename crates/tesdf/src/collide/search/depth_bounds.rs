//! Upper bounds of the depth over a triangle, and the place where they leave room for the most.
use arrayvec::ArrayVec;

use crate::collide::search::greatest_minimum::{
    CORNERS, difference, equal_inside, equal_on_edges, margin, value,
};

/// Largest number of bounds of one triangle.
const MOST: usize = 8;

/// A linear function over a triangle. At no point of the triangle is the depth greater.
#[derive(Clone, Copy, Debug)]
pub struct Bound {
    /// The face that it comes from.
    pub face: u32,
    /// The kind of function.
    pub kind: Kind,
    /// Its values at the corners.
    pub at: [f64; 3],
}

/// The origin of a [`Bound`]. Each holds unchanged on a part of the triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The interpolated distances of the corners from a face. The distance from a face is convex,
    /// so the distances of other points are not greater. On a part of the triangle, the bound of
    /// that part is lower.
    Chord,
    /// The interpolated heights over the plane of a face, or a tangent of a convex function.
    Plane,
}

/// The least of several [`Bound`]s, and its greatest value over the triangle.
#[derive(Clone, Debug)]
pub struct DepthBounds {
    bounds: ArrayVec<Bound, MOST>,
    /// No point of the triangle is deeper.
    pub greatest: f64,
    /// The barycentric coordinates where the least bound is greatest.
    pub at: [f64; 3],
}

impl DepthBounds {
    /// Without a bound, the depth can have any value.
    pub const NONE: Self =
        Self { bounds: ArrayVec::new_const(), greatest: f64::INFINITY, at: [1.0 / 3.0; 3] };

    /// The bounds.
    pub fn iter(&self) -> impl Iterator<Item = &Bound> {
        self.bounds.iter()
    }

    /// The bound that comes from a face, if there is one, and its value at [`at`](Self::at).
    pub fn of_face(&self, face: u32) -> Option<(Bound, f64)> {
        self.bounds.iter().find(|b| b.face == face).map(|b| (*b, value(&b.at, self.at)))
    }

    /// Whether there is a bound of a face.
    pub fn holds(&self, face: u32) -> bool {
        self.bounds.iter().any(|b| b.face == face)
    }

    /// Adds a bound. It replaces that of the same face, or the one that is farthest from mattering
    /// where the least bound is greatest, when there is no more room.
    pub fn add(&mut self, bound: Bound) {
        let same = self.bounds.iter().position(|b| b.face == bound.face);
        let farthest = || {
            let at = |b: &Bound| value(&b.at, self.at);
            (0..MOST).max_by(|&i, &j| at(&self.bounds[i]).total_cmp(&at(&self.bounds[j]))).unwrap_or(0)
        };
        match same.or_else(|| self.bounds.is_full().then(farthest)) {
            Some(k) => {
                self.bounds[k] = bound;
                let all = std::mem::replace(self, Self::NONE).bounds;
                all.into_iter().for_each(|b| self.push(b));
            }
            None => self.push(bound),
        }
    }

    /// Adds a bound and finds the new greatest value.
    ///
    /// The least bound is concave. Where the new bound cuts off its greatest value, the new
    /// greatest value is on the new bound: at a corner, on an edge where another bound is equal, or
    /// inside where two others are equal.
    fn push(&mut self, bound: Bound) {
        self.bounds.push(bound);
        if value(&bound.at, self.at) >= self.greatest {
            return;
        }
        let (new, others) = match self.bounds.split_last() {
            Some((new, others)) => (new.at, others),
            None => return,
        };
        let mut best = (f64::NEG_INFINITY, self.at);
        let mut offer = |weights: [f64; 3]| {
            let own = value(&new, weights);
            if own > best.0 {
                let least = others.iter().map(|b| value(&b.at, weights)).fold(own, f64::min);
                if least > best.0 {
                    best = (least, weights);
                }
            }
        };
        CORNERS.into_iter().for_each(&mut offer);
        for (k, other) in others.iter().enumerate() {
            let d = difference(new, other.at);
            equal_on_edges(d).for_each(&mut offer);
            for third in &others[k + 1..] {
                equal_inside(d, difference(new, third.at)).into_iter().for_each(&mut offer);
            }
        }
        let margin = margin(self.bounds.iter().map(|b| &b.at));
        self.greatest = self.greatest.min(best.0 + margin);
        self.at = best.1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_greatest_value_is_that_of_dense_samples() {
        // Numbers without a pattern.
        let number = |k: u32| f64::from(k.wrapping_mul(2_654_435_761) >> 16) / 65536.0;
        for case in 0..200u32 {
            let count = 1 + case % MOST as u32;
            let mut bounds = DepthBounds::NONE;
            for face in 0..count {
                let at = std::array::from_fn(|i| number(case * 24 + 3 * face + i as u32));
                bounds.add(Bound { face, kind: Kind::Plane, at });
            }
            const N: u32 = 60;
            let least = |w: [f64; 3]| bounds.iter().map(|b| value(&b.at, w)).fold(f64::INFINITY, f64::min);
            let mut sampled = f64::NEG_INFINITY;
            for i in 0..=N {
                for j in 0..=N - i {
                    sampled = sampled.max(least([i, j, N - i - j].map(|n| f64::from(n) / f64::from(N))));
                }
            }
            let found = bounds.greatest;
            assert!(found >= sampled && found <= sampled + 2.0 / f64::from(N), "{found} {sampled}");
            assert!((least(bounds.at) - found).abs() < 1e-14);
        }
    }

    #[test]
    fn a_bound_replaces_that_of_its_face_or_the_one_that_matters_least() {
        let mut bounds = DepthBounds::NONE;
        for face in 0..MOST as u32 {
            bounds.add(Bound { face, kind: Kind::Chord, at: [f64::from(face + 1); 3] });
        }
        bounds.add(Bound { face: 3, kind: Kind::Plane, at: [0.5; 3] });
        assert!((bounds.greatest - 0.5).abs() < 1e-13);
        bounds.add(Bound { face: 99, kind: Kind::Chord, at: [0.25; 3] });
        assert!((bounds.greatest - 0.25).abs() < 1e-13);
        let faces: Vec<u32> = bounds.iter().map(|b| b.face).collect();
        assert_eq!(faces, [0, 1, 2, 3, 4, 5, 6, 99]);
    }
}
