//! What rows act on: the velocity of a body relative to another one, or the rate of a coupling.
use nalgebra::Vector6;

use super::pattern::Pattern;
use super::relative::Relative;

/// A velocity of six components that is linear in those of bodies.
#[derive(Clone, Debug)]
pub enum Group {
    /// Of one body relative to another one.
    Relative(Relative),
    /// Of a coupling.
    Coupled(Coupled),
}

/// The rate of a coupling of joints, `Σ J v` over its bodies, as the first of six components; the
/// others are zero.
#[derive(Clone, Debug)]
pub struct Coupled {
    /// The bodies, in ascending order, with their `J`.
    pub bodies: Vec<(usize, Vector6<f64>)>,
    /// For each two of them, of which the second one is later: their places here, and the index of
    /// their pair in the pattern of the matrix.
    pub pairs: Vec<([usize; 2], usize)>,
}

impl Coupled {
    /// All pairs of `bodies` are of the pattern.
    pub fn new(bodies: Vec<(usize, Vector6<f64>)>, pattern: &Pattern) -> Self {
        let two = (0..bodies.len()).flat_map(|j| (0..j).map(move |i| [i, j]));
        let pairs =
            two.filter_map(|[i, j]| Some(([i, j], pattern.pair(bodies[i].0, bodies[j].0)?))).collect();
        Self { bodies, pairs }
    }
}

impl Group {
    /// Its linear and angular components.
    #[inline]
    pub fn of(&self, velocity: &[Vector6<f64>]) -> [f64; 6] {
        match self {
            Self::Relative(relative) => relative.of(velocity),
            Self::Coupled(Coupled { bodies, .. }) => {
                let rate = bodies.iter().map(|(body, j)| j.dot(&velocity[*body])).sum();
                [rate, 0.0, 0.0, 0.0, 0.0, 0.0]
            }
        }
    }

    /// Adds the momentum that a momentum of this velocity is for the bodies.
    #[inline]
    pub fn act(&self, momentum: [f64; 6], to: &mut [Vector6<f64>]) {
        match self {
            Self::Relative(relative) => relative.act(momentum, to),
            Self::Coupled(Coupled { bodies, .. }) => {
                bodies.iter().for_each(|(body, j)| to[*body] += j * momentum[0]);
            }
        }
    }
}
