//! The velocity of a body relative to another one, and what acts on it.
use glam::DVec3;
use nalgebra::{Matrix6, Vector6};

use super::pattern::Pattern;

/// The velocity of `body` relative to `other`, or to the world, at the centre of mass of `body`:
/// `V = v − T v'` with `T (v, ω) = (v + ω × offset, ω)`.
#[derive(Clone, Debug)]
pub struct Relative {
    pub body: usize,
    pub other: Option<Other>,
    /// From the centre of mass of the other body to that of `body`, m.
    pub offset: DVec3,
}

/// The other body of a pair.
#[derive(Clone, Copy, Debug)]
pub struct Other {
    pub body: usize,
    /// The index of the pair in the pattern of the matrix.
    pub pair: usize,
}

impl Relative {
    /// Both bodies are different, and their pair is one of the pattern.
    pub fn new(body: usize, other: Option<usize>, offset: DVec3, pattern: &Pattern) -> Self {
        let other = other.and_then(|other| Some(Other { body: other, pair: pattern.pair(body, other)? }));
        Self { body, other, offset }
    }

    /// Its linear and angular components.
    #[inline]
    pub fn of(&self, velocity: &[Vector6<f64>]) -> [f64; 6] {
        let [mut a, mut b, mut c, mut d, mut e, mut f] = velocity[self.body].data.0[0];
        if let Some(Other { body, .. }) = self.other {
            let [u, v, w, x, y, z] = velocity[body].data.0[0];
            let turned = DVec3::new(x, y, z).cross(self.offset);
            (a, b, c) = (a - (u + turned.x), b - (v + turned.y), c - (w + turned.z));
            (d, e, f) = (d - x, e - y, f - z);
        }
        [a, b, c, d, e, f]
    }

    /// Adds the momentum that a momentum of this velocity is for the bodies.
    #[inline]
    pub fn act(&self, momentum: [f64; 6], to: &mut [Vector6<f64>]) {
        let [a, b, c, d, e, f] = momentum;
        to[self.body] += Vector6::new(a, b, c, d, e, f);
        if let Some(Other { body, .. }) = self.other {
            let moved = self.offset.cross(DVec3::new(a, b, c));
            to[body] -= Vector6::new(a, b, c, d + moved.x, e + moved.y, f + moved.z);
        }
    }

    /// `A T`
    #[inline]
    pub fn times_transport(&self, a: &Matrix6<f64>) -> Matrix6<f64> {
        let mut product = *a;
        for (j, of_column) in self.cross().into_iter().enumerate() {
            for (i, s) in of_column {
                let column: Vector6<f64> = a.column(i).into();
                product.data.0[3 + j].iter_mut().zip(&column.data.0[0]).for_each(|(to, a)| *to += s * a);
            }
        }
        product
    }

    /// `Tᵀ A`
    #[inline]
    pub fn transported(&self, a: &Matrix6<f64>) -> Matrix6<f64> {
        let mut product = *a;
        let cross = self.cross();
        for (to, column) in product.data.0.iter_mut().zip(&a.data.0) {
            for (j, of_column) in cross.iter().enumerate() {
                for &(i, s) in of_column {
                    to[3 + j] += s * column[i];
                }
            }
        }
        product
    }

    /// The columns of the matrix of `ω × offset`: each the rows and values that are not zero.
    fn cross(&self) -> [[(usize, f64); 2]; 3] {
        let DVec3 { x, y, z } = self.offset;
        [[(1, -z), (2, y)], [(0, z), (2, -x)], [(0, -y), (1, x)]]
    }
}
