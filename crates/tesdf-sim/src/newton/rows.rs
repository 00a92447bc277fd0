//! Converts contacts to rows of the convex problem.
use glam::{DQuat, DVec3};
use nalgebra::{Matrix6, Vector6};
use tesdf::collide::{Contact, InstanceId, Pose};

use super::integrate::pack;
use super::runs::sort_runs;
use crate::{MassProperties, System};

/// A free body and its inertia, in the middle of its free rotation in a step.
#[derive(Clone, Debug)]
pub struct FreeBody {
    /// Index of the body in the system.
    pub body: usize,
    /// Mass and inertia in the world frame: linear components first, then angular.
    pub inertia: Matrix6<f64>,
    /// Inverse of `inertia`.
    pub inverse: Matrix6<f64>,
}

impl FreeBody {
    /// The free body of index `body` in the orientation `rotation`.
    pub fn new(body: usize, mass: &MassProperties, rotation: DQuat) -> Self {
        let world = mass.inertia_in_world(Pose { translation: DVec3::ZERO, rotation });
        let blocks = |linear: f64, angular: glam::DMat3| {
            let mut m = Matrix6::zeros();
            for k in 0..3 {
                m[(k, k)] = linear;
                for l in 0..3 {
                    m[(3 + k, 3 + l)] = angular.col(l)[k];
                }
            }
            m
        };
        Self { body, inertia: blocks(mass.mass, world), inverse: blocks(1.0 / mass.mass, world.inverse()) }
    }
}

/// The bounds of the force of a contact, and of the lower limit of a joint: it pushes only.
pub const PUSHES: [f64; 2] = [0.0, f64::INFINITY];

/// What a row is about. Rows of the same id in two minimisations have nearly the same force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RowId {
    /// The instances of a contact, and the face or vertex of the first one.
    Contact([InstanceId; 2], u32),
    /// The number of a row among those of all joints.
    Joint(usize),
}

/// What a row does to its first side.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RowForce {
    /// Along the row, N or N m.
    pub along: f64,
    /// N
    pub friction: DVec3,
    /// The moment of torsional friction about the normal, N m.
    pub torsion: f64,
}

/// A condition on the velocities of two bodies: a force acts between them, along `sides`, so that
/// `gap + h Σ jacobian · v` becomes zero, as far as the force stays within its bounds.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// What it is about.
    pub id: RowId,
    /// Up to two free bodies: the index of each in the list of free bodies, and the derivative of
    /// the gap by its velocity.
    pub sides: [Option<(usize, Vector6<f64>)>; 2],
    /// Of a coupling of joints, which has no sides: its free bodies, in ascending order, and the
    /// derivatives of the gap by their velocities.
    pub coupled: Vec<(usize, Vector6<f64>)>,
    /// Where the force acts in the world, with the bodies where the row was found, m.
    pub point: DVec3,
    /// The vectors from the centres of mass of the two sides to the point where the force acts, m.
    /// Of no account for a torque.
    pub arms: [DVec3; 2],
    /// Gap at the beginning of the step, with the motion of kinematic bodies in the step, m or rad.
    pub gap: f64,
    /// The gap without the correction that pushes penetrating bodies apart.
    pub relaxed_gap: f64,
    /// Of a spring.
    pub stiffness: Stiffness,
    /// The least and the greatest force, N or N m; positive forces open the gap. A contact pushes
    /// only: 0 to infinity.
    pub bounds: [f64; 2],
    /// How the row resists in an island that does not overlap deeply.
    pub resistance: Resistance,
    /// Friction of a contact, if it has any.
    pub friction: Option<Friction>,
}

/// The two gaps of a row.
#[derive(Clone, Copy)]
pub enum Gap {
    /// Includes the correction that pushes penetrating bodies apart.
    Position,
    /// Without that correction.
    Relaxed,
}

/// Friction of a contact. It acts against the velocity of the first body relative to the second one
/// in the tangent plane, and against the spin of the first one relative to the second about the
/// normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Friction {
    /// Unit normal of the tangent plane.
    pub normal: DVec3,
    /// Coefficient of friction.
    pub coefficient: f64,
    /// The way in the step that kinematic bodies add to that of the free ones, in the tangent
    /// plane, m.
    pub way: DVec3,
    /// Coefficient of torsional friction, m.
    pub torsional: f64,
    /// The angle in the step that kinematic bodies add to that of the free ones about the normal,
    /// rad.
    pub turn: f64,
}

/// The stiffness of a spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stiffness {
    /// N/m or N m/rad
    Absolute(f64),
    /// κ: as a multiple of that which the inertia of the bodies gives within the step, `1 / (w h²)`.
    Relative(f64),
}

/// How a row resists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Resistance {
    /// As a spring, which gives way under load.
    Spring,
    /// As `Spring`: a contact of bodies that overlap deeply. What parts them is [`Row::parting`].
    Parting,
    /// It does not give way.
    Rigid,
}

impl Row {
    /// Whether the row is a contact, or a lower limit: it pushes only.
    pub fn is_contact(&self) -> bool {
        self.bounds == PUSHES
    }

    /// The row that parts two bodies: it pushes at their centres of mass, without friction. So
    /// their overlap along a direction falls as fast as they move, because they do not turn, and
    /// what pushes on both sides of a body does not wedge it: with μ = 0.5 a torus in a nut stayed
    /// 140 µm deep.
    pub fn parting(&self) -> Self {
        let push = |(free, j): (usize, Vector6<f64>)| (free, Vector6::new(j[0], j[1], j[2], 0.0, 0.0, 0.0));
        let arms = [DVec3::ZERO; 2];
        Self { sides: self.sides.map(|side| side.map(push)), arms, friction: None, ..self.clone() }
    }

    /// Its free bodies: the index of each in the list of free bodies, and the derivative of the gap
    /// by its velocity.
    pub fn bodies(&self) -> impl Iterator<Item = &(usize, Vector6<f64>)> {
        self.sides.iter().flatten().chain(&self.coupled)
    }

    /// Rate of change of the gap at `velocity`, m/s or rad/s.
    #[inline]
    pub fn rate(&self, velocity: &[Vector6<f64>]) -> f64 {
        self.bodies().map(|(free, jacobian)| jacobian.dot(&velocity[*free])).sum()
    }

    /// Takes the mean of the directions of this row and of `other`, which has the same bodies.
    pub fn average(&mut self, other: &Self) {
        self.point = 0.5 * (self.point + other.point);
        self.arms = [0, 1].map(|k| 0.5 * (self.arms[k] + other.arms[k]));
        for (side, other) in self.sides.iter_mut().zip(&other.sides) {
            if let (Some((_, j)), Some((_, k))) = (side, other) {
                *j = 0.5 * (*j + k);
            }
        }
    }

    /// The row of a contact between two bodies, with the contact's distance as its gap. Returns
    /// `None` when neither body is free. It acts along `normal`, with these coefficients of friction
    /// and of torsional friction.
    pub fn of_contact(
        contact: &Contact,
        normal: DVec3,
        bodies: &[Option<Center>; 2],
        [coefficient, torsional]: [f64; 2],
        stiffness: f64,
    ) -> Option<Self> {
        let side = |k: usize, direction: DVec3| {
            let Center { free, place } = bodies[k]?;
            // Both sides use one point. The closest points lie on a line along the normal, so the
            // rate is the rate of the distance.
            let arm = contact.point_a - place;
            Some((arm, (free, pack(direction, arm.cross(direction)))))
        };
        let sides = [side(0, normal), side(1, -normal)];
        if sides == [None; 2] {
            return None;
        }
        let friction = Friction { normal, coefficient, way: DVec3::ZERO, torsional, turn: 0.0 };
        Some(Self {
            id: RowId::Contact([contact.instance_a, contact.instance_b], contact.feature.a),
            sides: sides.map(|side| side.map(|(_, side)| side)),
            coupled: Vec::new(),
            arms: sides.map(|side| side.map_or(DVec3::ZERO, |(arm, _)| arm)),
            point: contact.point_a,
            gap: contact.distance,
            relaxed_gap: contact.distance,
            stiffness: Stiffness::Relative(stiffness),
            bounds: PUSHES,
            resistance: Resistance::Rigid,
            friction: (coefficient > 0.0 || torsional > 0.0).then_some(friction),
        })
    }
}

/// The centre of mass of a free body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Center {
    /// Its index in the list of free bodies.
    pub free: usize,
    /// In the world, m.
    pub place: DVec3,
}

/// The bodies that rows connect.
#[derive(Clone, Copy, Debug)]
pub struct Bodies<'a> {
    /// All bodies.
    pub system: &'a System,
    /// For each body its index in the list of free bodies; `None` when it is not free.
    pub free_of: &'a [Option<usize>],
}

/// Of each of `rows`, the index of the row of the same id among those whose ids are `before`, in
/// the order in which these come.
pub fn matches(before: impl Iterator<Item = RowId> + Clone, rows: &[Row]) -> Vec<Option<usize>> {
    fn ordered(ids: impl Iterator<Item = RowId>) -> Vec<(RowId, usize)> {
        let pair = |(id, _): &(RowId, usize)| match id {
            RowId::Contact(pair, _) => Ok(*pair),
            RowId::Joint(_) => Err(()),
        };
        sort_runs(ids.zip(0..).collect(), pair, |(id, _)| *id)
    }
    // Mostly, nothing has come or gone.
    if rows.iter().map(|row| row.id).eq(before.clone()) {
        return (0..rows.len()).map(Some).collect();
    }
    let mut of_rows = vec![None; rows.len()];
    let before = ordered(before);
    let mut from = before.iter().peekable();
    for (id, k) in ordered(rows.iter().map(|row| row.id)) {
        while from.next_if(|(other, _)| *other < id).is_some() {}
        of_rows[k] = from.next_if(|(other, _)| *other == id).map(|(_, other)| *other);
    }
    of_rows
}

/// The forces of rows of which `of_rows` are the indices among `forces`.
pub fn carry(of_rows: &[Option<usize>], forces: &[RowForce]) -> Vec<RowForce> {
    of_rows.iter().map(|k| k.map_or(RowForce::default(), |k| forces[k])).collect()
}
