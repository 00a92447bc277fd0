//! A row as the interior point method sees it: in units of its own, with its friction.
use std::array;

use glam::DVec3;
use nalgebra::{Matrix6, Vector6};

use super::integrate::pack;
use super::linear::{Sides, dot};
use super::rows::{Resistance, Row, RowForce};

/// Rigid rows give way by this share of the way by which their force would move their bodies in the
/// step: 1 / κ∞. It lets rows that contradict each other have a solution, and bounds the numbers in
/// the matrix. With 1e-10, the links of a chain whose end weighs a thousand times as much as a link
/// gave way by 25 pm, enough for contacts at the bottom of a bend to let go.
const RIGID: f64 = 1e-12;

/// A row in units in which a force of 1 changes its rate by 1 in the step: the gap is multiplied by
/// `k = 1 / (h √w)` with `w = J M⁻¹ Jᵀ`, and the force divided by it. Both are then √J.
#[derive(Clone, Debug)]
pub struct Line {
    /// The derivative of the gap by the velocities.
    pub sides: Sides<1>,
    /// The index of its two bodies in the pattern of the matrix.
    pub pair: Option<usize>,
    /// The gap at the end of the step when the velocities are zero.
    pub gap: f64,
    /// The gap that is left, divided by the force.
    pub compliance: f64,
    /// The least and the greatest force.
    pub bounds: [f64; 2],
    /// k
    pub scale: f64,
    /// Friction of a contact.
    pub slip: Option<Box<Slip>>,
}

/// Friction in units of its own, with the mean of `w` over two tangents.
#[derive(Clone, Debug)]
pub struct Slip {
    /// Unit vectors.
    pub tangents: [DVec3; 2],
    /// The derivatives of the gap in units of the row, and of the ways along the tangents, by the
    /// velocities.
    pub sides: Sides<3>,
    /// The ways when the velocities are zero.
    pub way: [f64; 2],
    /// μ, for these units.
    pub coefficient: f64,
    /// k of the ways.
    pub scale: f64,
}

/// What acts along a row, in its units.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Force {
    pub push: f64,
    /// On the first side, along the tangents.
    pub friction: [f64; 2],
}

/// The bodies of an island, in a step.
#[derive(Clone, Debug)]
pub struct Bodies {
    /// Mass and inertia in the world frame, as [`FreeBody::inertia`](super::rows::FreeBody).
    pub inertia: Vec<Matrix6<f64>>,
    /// The inverses of `inertia`.
    pub inverse: Vec<Matrix6<f64>>,
    /// Velocities without rows.
    pub target: Vec<Vector6<f64>>,
    /// The length at which a body's rotation counts as a way, m.
    pub levers: Vec<f64>,
    /// The duration of the step, s.
    pub time_step: f64,
}

impl Bodies {
    /// `1 / (h √w)`
    fn scale(&self, weight: f64) -> f64 {
        1.0 / (self.time_step * weight.sqrt())
    }

    /// `w`
    fn weight(&self, sides: &[Option<(usize, Vector6<f64>)>; 2]) -> f64 {
        sides.iter().flatten().map(|(body, j)| j.dot(&(self.inverse[*body] * j))).sum()
    }
}

impl Line {
    /// The line of `row` with this gap, whose two bodies are this pair of the pattern.
    pub fn new(row: &Row, gap: f64, pair: Option<usize>, bodies: &Bodies) -> Self {
        let scale = bodies.scale(bodies.weight(&row.sides));
        let scaled = |j: Vector6<f64>, scale: f64| j * (bodies.time_step * scale);
        let slip = row.friction.map(|friction| {
            let tangents: [DVec3; 2] = friction.normal.any_orthonormal_pair().into();
            let side = |k: usize, t: DVec3| {
                let sign = if k == 0 { 1.0 } else { -1.0 };
                row.sides[k].map(|(body, _)| (body, sign * pack(t, row.arms[k].cross(t))))
            };
            let along = tangents.map(|t| [side(0, t), side(1, t)]);
            let of_slip = bodies.scale(along.iter().map(|sides| bodies.weight(sides)).sum::<f64>() / 2.0);
            let sides = array::from_fn(|k| {
                let ((body, normal), (_, x), (_, y)) = (row.sides[k]?, along[0][k]?, along[1][k]?);
                Some((body, [scaled(normal, scale), scaled(x, of_slip), scaled(y, of_slip)]))
            });
            Box::new(Slip {
                tangents,
                sides,
                way: tangents.map(|t| of_slip * t.dot(friction.way)),
                coefficient: friction.coefficient * scale / of_slip,
                scale: of_slip,
            })
        });
        let compliance = match row.resistance {
            Resistance::Rigid => RIGID,
            Resistance::Spring | Resistance::Parting => scale * scale / row.stiffness,
        };
        Self {
            sides: row.sides.map(|side| side.map(|(body, j)| (body, [scaled(j, scale)]))),
            pair,
            gap: scale * gap,
            compliance,
            bounds: row.bounds.map(|force| force / scale),
            scale,
            slip,
        }
    }

    /// Number of bounds of its force.
    pub fn count_bounds(&self) -> usize {
        self.bounds.iter().filter(|bound| bound.is_finite()).count()
    }

    /// The gap at the end of the step at these velocities.
    #[inline]
    pub fn at(&self, velocity: &[Vector6<f64>]) -> f64 {
        self.gap + self.change(velocity)
    }

    /// What velocities add to the gap.
    #[inline]
    pub fn change(&self, velocity: &[Vector6<f64>]) -> f64 {
        self.sides.iter().flatten().map(|(body, j)| dot(&j[0], &velocity[*body])).sum()
    }

    /// How far the gap at these velocities is from one that needs no force.
    pub fn violation(&self, velocity: &[Vector6<f64>]) -> f64 {
        let gap = self.at(velocity);
        match self.bounds {
            [0.0, _] => (-gap).max(0.0),
            [_, 0.0] => gap.max(0.0),
            _ => gap.abs(),
        }
    }

    /// Adds the momentum that a push and a friction give in the step.
    #[inline]
    pub fn act(&self, push: f64, friction: [f64; 2], to: &mut [Vector6<f64>]) {
        let add = |to: &mut Vector6<f64>, j: &Vector6<f64>, force: f64| {
            for (to, j) in to.data.0[0].iter_mut().zip(&j.data.0[0]) {
                *to += j * force;
            }
        };
        for (body, j) in self.sides.iter().flatten() {
            add(&mut to[*body], &j[0], push);
        }
        if let Some(slip) = &self.slip {
            for (body, [_, x, y]) in slip.sides.iter().flatten() {
                add(&mut to[*body], x, friction[0]);
                add(&mut to[*body], y, friction[1]);
            }
        }
    }

    /// A force in the units of the line.
    pub fn of_force(&self, force: &RowForce) -> Force {
        let friction = self
            .slip
            .as_ref()
            .map_or([0.0; 2], |slip| slip.tangents.map(|t| t.dot(force.friction) / slip.scale));
        Force { push: force.along / self.scale, friction }
    }

    /// A force in N or N m.
    pub fn to_force(&self, force: &Force) -> RowForce {
        let friction = self.slip.as_ref().map_or(DVec3::ZERO, |slip| {
            let [x, y] = slip.tangents;
            slip.scale * (force.friction[0] * x + force.friction[1] * y)
        });
        RowForce { along: force.push * self.scale, friction }
    }
}

impl Slip {
    /// What velocities add to the ways.
    #[inline]
    pub fn change(&self, velocity: &[Vector6<f64>]) -> [f64; 2] {
        self.sides.iter().flatten().fold([0.0; 2], |[x, y], (body, j)| {
            let v = &velocity[*body];
            [x + dot(&j[1], v), y + dot(&j[2], v)]
        })
    }
}
