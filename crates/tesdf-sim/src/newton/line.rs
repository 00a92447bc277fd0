//! Rows as the interior point method sees them: in units of their own, with their friction, and in
//! bundles of four that share their bodies.
//!
//! All rows of a pair of bodies act on the motion of one body relative to the other, so they are
//! summed up for it, and the sum is passed on to the two bodies. A coupling acts on its rate.
use std::collections::BTreeMap;
use std::ops::Range;

use glam::DVec3;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

use super::group::{Coupled, Group};
use super::lanes::{Lanes, WIDTH};
use super::pattern::Pattern;
use super::relative::Relative;
use super::rows::{Resistance, Row, RowForce, Stiffness};

/// Rigid rows give way by this share of the way by which their force would move their bodies in the
/// step: 1 / κ∞. It lets rows that contradict each other have a solution, and bounds the numbers in
/// the matrix. With 1e-10, the links of a chain whose end weighs a thousand times as much as a link
/// gave way by 25 pm, enough for contacts at the bottom of a bend to let go. With 1e-12 a wall of
/// bricks sank by 2 fm a step, unevenly, and rose again where it tilted: it gained 2e-9 J in 10 s.
const RIGID: f64 = 1e-13;

/// Rows are of one group when the vectors between the centres of their bodies differ by less than
/// this share of the smaller body. They differ where rows are from poses at different times.
const SAME_OFFSET: f64 = 1e-9;

/// A turn counts as a way at this multiple of a body's lever: so a box that torsional friction holds
/// at nine tenths of its limit creeps by so little that it falls asleep, as one that friction holds.
const TORSION: f64 = 2.0;

/// The bodies of an island, in a step.
#[derive(Clone, Debug)]
pub struct Bodies {
    /// Mass and inertia in the world frame, as [`FreeBody::inertia`](super::rows::FreeBody).
    pub inertia: Vec<Matrix6<f64>>,
    /// The inverses of mass and inertia.
    pub inverse: Vec<Inverse>,
    /// Velocities without rows.
    pub target: Vec<Vector6<f64>>,
    /// The length at which a body's rotation counts as a way, m.
    pub levers: Vec<f64>,
    /// The duration of the step, s.
    pub time_step: f64,
}

/// The inverse of a mass, and of an inertia in the world frame.
#[derive(Clone, Copy, Debug)]
pub struct Inverse {
    mass: f64,
    inertia: Matrix3<f64>,
}

/// A row of an island.
#[derive(Clone, Debug)]
pub struct Placed<'a> {
    pub row: &'a Row,
    /// The index of the body of each side in the island, ...
    pub bodies: [Option<usize>; 2],
    /// ... and of those of a coupling.
    pub coupled: Vec<usize>,
    /// The gap at the end of the step when the velocities are zero, m or rad.
    pub gap: f64,
    pub resistance: Resistance,
}

/// Four rows of a group. Each has units in which a force of 1 changes its rate by 1 in the step:
/// the gap is multiplied by `k = 1 / (h √w)` with `w = J M⁻¹ Jᵀ`, and the force divided by it.
/// Both are then √J. Missing rows have no derivatives, no gap and no bounds, so nothing acts along them.
#[derive(Clone, Debug)]
pub struct Bundle {
    /// The numbers of its rows in the island; one to four.
    rows: [usize; WIDTH],
    count: usize,
    /// The derivatives of the gap by the relative velocity of the group.
    pub normal: [Lanes; 6],
    pub gap: Lanes,
    /// The gap that is left, divided by the force.
    pub compliance: Lanes,
    /// The least and the greatest force.
    pub bounds: [Lanes; 2],
    /// k
    pub scale: Lanes,
    /// Friction, if its rows have it.
    pub slip: Option<Slips>,
}

/// Friction in units of its own, with the mean of `w` over two tangents.
///
/// Torsional friction is a bundle of its own, in which nothing pushes. Its first tangent is the turn
/// about the normal, with its own `w`, and its second one is nothing.
#[derive(Clone, Debug)]
pub struct Slips {
    /// `None`: sliding friction, which the pushes of its bundle limit.
    pub torsion: Option<Torsion>,
    /// The derivatives of the ways along two tangents by the relative velocity.
    pub tangents: [[Lanes; 6]; 2],
    /// The ways when the velocities are zero.
    pub way: [Lanes; 2],
    /// μ, for these units.
    pub coefficient: Lanes,
    /// k of the ways.
    pub scale: Lanes,
}

/// Whose torsional friction it is.
#[derive(Clone, Copy, Debug)]
pub struct Torsion {
    /// The number of the bundle whose pushes limit it. It comes before.
    pub of: usize,
    /// The length at which a turn counts as a way, m: what sticks turns by as little as others slide.
    lever: f64,
}

/// What acts along the rows of a bundle, in their units.
#[derive(Clone, Copy, Debug, Default)]
pub struct Forces {
    pub push: Lanes,
    /// Along the tangents.
    pub friction: [Lanes; 2],
}

/// The derivatives of rows by the velocities of the two bodies of a group.
type Sides = [[Lanes; 6]; 2];

/// The inverse masses of a group.
struct Masses {
    /// Of the body whose velocity counts, and of the other one. A coupling has the inverse mass of
    /// its rate as the first one.
    inverse: [Option<Inverse>; 2],
    time_step: f64,
}

/// A row of a batch.
#[derive(Clone, Copy)]
struct Member {
    group: usize,
    /// Whether it has friction, ...
    slips: bool,
    /// ... and torsional friction.
    turns: bool,
    number: usize,
    /// The side whose velocity counts.
    reference: usize,
}

/// Bundles of one group, all with friction or all without.
#[derive(Clone, Debug)]
pub struct Batch {
    pub group: usize,
    /// Whether they have friction.
    pub slips: bool,
    pub bundles: Range<usize>,
}

/// Rows in bundles.
#[derive(Clone, Debug, Default)]
pub struct Lines {
    pub groups: Vec<Group>,
    pub batches: Vec<Batch>,
    pub bundles: Vec<Bundle>,
    /// The groups of each pair of bodies; of a single body, with itself.
    of_pair: BTreeMap<(usize, usize), Vec<usize>>,
}

impl Inverse {
    /// Of a matrix as [`FreeBody::inertia`](super::rows::FreeBody), which is positive definite.
    pub fn of(matrix: &Matrix6<f64>) -> Self {
        let inertia = matrix.fixed_view::<3, 3>(3, 3).into_owned();
        let inertia = inertia.cholesky().map_or_else(Matrix3::zeros, |inertia| inertia.inverse());
        Self { mass: 1.0 / matrix[(0, 0)], inertia }
    }

    /// The inverses of the mass and of the inertia.
    pub fn parts(&self) -> (f64, &Matrix3<f64>) {
        (self.mass, &self.inertia)
    }

    /// The velocity that a momentum gives.
    #[inline]
    pub fn times(&self, momentum: &Vector6<f64>) -> Vector6<f64> {
        let [a, b, c, d, e, f] = momentum.data.0[0];
        let turned = self.inertia * Vector3::new(d, e, f);
        Vector6::new(self.mass * a, self.mass * b, self.mass * c, turned.x, turned.y, turned.z)
    }

    /// `J M⁻¹ Jᵀ`
    #[inline]
    fn weight(&self, [a, b, c, d, e, f]: &[Lanes; 6]) -> Lanes {
        let turned = |i: usize| {
            let row = |j: usize| self.inertia[(i, j)];
            *d * row(0) + *e * row(1) + *f * row(2)
        };
        let along = *a * (*a * self.mass) + *b * (*b * self.mass) + *c * (*c * self.mass);
        along + (*d * turned(0) + *e * turned(1) + *f * turned(2))
    }
}

impl Masses {
    fn of(group: &Group, bodies: &Bodies) -> Self {
        let inverse = match group {
            Group::Relative(Relative { body, other, .. }) => {
                let inverse = [Some(*body), other.map(|other| other.body)];
                inverse.map(|body| body.map(|body| bodies.inverse[body]))
            }
            Group::Coupled(Coupled { bodies: coupled, .. }) => {
                let weight = |(body, j): &(usize, Vector6<f64>)| j.dot(&bodies.inverse[*body].times(j));
                let mass = coupled.iter().map(weight).sum();
                [Some(Inverse { mass, inertia: Matrix3::zeros() }), None]
            }
        };
        Self { inverse, time_step: bodies.time_step }
    }

    /// `w`
    #[inline]
    fn weight(&self, sides: &Sides) -> Lanes {
        let of_side = |(inverse, j): (&Option<Inverse>, _)| inverse.as_ref().map(|inverse| inverse.weight(j));
        self.inverse.iter().zip(sides).filter_map(of_side).fold(Lanes::ZERO, |sum, weight| sum + weight)
    }

    /// `1 / (h √w)` of `count` rows, and 1 for missing ones.
    #[inline]
    fn scale(&self, weight: Lanes, count: usize) -> Lanes {
        let mut scale = Lanes::splat(1.0) / (weight.sqrt() * self.time_step);
        scale.0[count..].fill(1.0);
        scale
    }

    /// The derivatives by the velocity that counts, in units with this scale.
    #[inline]
    fn scaled(&self, j: [Lanes; 6], scale: Lanes) -> [Lanes; 6] {
        let factor = scale * self.time_step;
        j.map(|j| factor * j)
    }
}

/// The derivatives of ways along `t` at an arm from the centre of mass.
#[inline]
fn signed(sign: &Lanes, t: &[Lanes; 3], arm: &[Lanes; 3]) -> [Lanes; 6] {
    let cross = |i: usize, j: usize| arm[i] * t[j] - t[i] * arm[j];
    [t[0], t[1], t[2], cross(1, 2), cross(2, 0), cross(0, 1)].map(|j| *sign * j)
}

impl Placed<'_> {
    /// The gap at the end of the step at these velocities, m or rad.
    pub fn at(&self, velocity: &[Vector6<f64>], time_step: f64) -> f64 {
        let rate = |(side, body): (&Option<(usize, Vector6<f64>)>, &Option<usize>)| match (side, body) {
            (Some((_, j)), Some(body)) => dot6(j, &velocity[*body]),
            _ => 0.0,
        };
        let coupled = self.of_coupling().map(|(body, j)| dot6(j, &velocity[body])).sum::<f64>();
        let of_sides = self.row.sides.iter().zip(&self.bodies).map(rate).sum::<f64>();
        self.gap + time_step * (of_sides + coupled)
    }

    /// The bodies of a coupling and the derivatives by their velocities.
    pub fn of_coupling(&self) -> impl Iterator<Item = (usize, &Vector6<f64>)> {
        self.coupled.iter().copied().zip(self.row.coupled.iter().map(|(_, j)| j))
    }

    /// The side whose velocity, relative to the other one, counts: that of the smaller body, near
    /// which the numbers of both are exact.
    fn reference(&self, bodies: &Bodies) -> usize {
        match self.bodies {
            [Some(a), Some(b)] => usize::from(bodies.levers[b] < bodies.levers[a]),
            [None, _] => 1,
            [_, None] => 0,
        }
    }
}

impl Member {
    /// Of torsional friction on its body, m.
    fn lever(&self, rows: &[Placed<'_>], bodies: &Bodies) -> f64 {
        rows[self.number].bodies[self.reference].map_or(1.0, |body| TORSION * bodies.levers[body])
    }
}

impl Lines {
    /// Adds those of `rows` with these numbers.
    pub fn add(&mut self, numbers: &[usize], rows: &[Placed<'_>], bodies: &Bodies, pattern: &Pattern) {
        let mut members = Vec::with_capacity(numbers.len());
        for &number in numbers {
            let row = &rows[number];
            let reference = row.reference(bodies);
            let group = self.group(row, reference, bodies, pattern);
            let friction = row.row.friction.as_ref();
            let slips = friction.is_some_and(|friction| friction.coefficient > 0.0);
            let turns = friction.is_some_and(|friction| friction.torsional > 0.0);
            members.push(Member { group, slips, turns, number, reference });
        }
        let kind = |member: &Member| (member.group, member.slips, member.turns);
        members.sort_by_key(kind);
        self.bundles.reserve(members.len() / WIDTH + self.groups.len());
        for batch in members.chunk_by(|a, b| kind(a) == kind(b)) {
            let (first, Member { group, slips, turns, .. }) = (self.bundles.len(), batch[0]);
            let masses = Masses::of(&self.groups[group], bodies);
            self.bundles.extend(batch.chunks(WIDTH).map(|four| Bundle::new(four, rows, &masses)));
            let last = self.bundles.len();
            self.batches.push(Batch { group, slips, bundles: first..last });
            if turns {
                let lever = batch[0].lever(rows, bodies);
                for (of, four) in (first..last).zip(batch.chunks(WIDTH)) {
                    let torsion = Torsion { of, lever };
                    self.bundles.push(Bundle::torsional(four, rows, &masses, torsion, &self.bundles[of]));
                }
                self.batches.push(Batch { group, slips: true, bundles: last..self.bundles.len() });
            }
        }
    }

    /// The number of the bundle whose pushes limit the friction of bundle `k`.
    #[inline(always)]
    pub fn pushing(&self, k: usize) -> usize {
        self.bundles[k].slip.as_ref().and_then(|slip| slip.torsion).map_or(k, |torsion| torsion.of)
    }

    /// The group of a row.
    fn group(&mut self, row: &Placed<'_>, reference: usize, bodies: &Bodies, pattern: &Pattern) -> usize {
        if !row.coupled.is_empty() {
            let coupled = row.of_coupling().map(|(body, j)| (body, *j)).collect();
            self.groups.push(Group::Coupled(Coupled::new(coupled, pattern)));
            return self.groups.len() - 1;
        }
        // One of the sides has a body.
        let body = row.bodies[reference].unwrap_or_default();
        let other = row.bodies[1 - reference];
        let offset = other.map_or(DVec3::ZERO, |_| row.row.arms[1 - reference] - row.row.arms[reference]);
        let is_same = |group: &Group| match group {
            Group::Relative(group) => {
                group.body == body
                    && group.other.map(|other| other.body) == other
                    && group.offset.distance(offset) <= SAME_OFFSET * bodies.levers[body]
            }
            Group::Coupled(_) => false,
        };
        // Rows of a pair come together.
        if let Some(last) = self.groups.len().checked_sub(1).filter(|&last| is_same(&self.groups[last])) {
            return last;
        }
        let of_pair = self.of_pair.entry((body, other.unwrap_or(body))).or_default();
        if let Some(&group) = of_pair.iter().find(|&&group| is_same(&self.groups[group])) {
            return group;
        }
        of_pair.push(self.groups.len());
        self.groups.push(Group::Relative(Relative::new(body, other, offset, pattern)));
        self.groups.len() - 1
    }

    /// Forces of rows, by their numbers, in their bundles.
    pub fn forces<'a>(&self, of_row: impl Fn(usize) -> (&'a Row, RowForce)) -> Vec<Forces> {
        let of_bundle = |bundle: &Bundle| {
            let mut forces = Forces::default();
            for (lane, &k) in bundle.rows().iter().enumerate() {
                let (row, force) = of_row(k);
                if let Some(Slips { torsion: Some(torsion), scale, .. }) = &bundle.slip {
                    forces.friction[0].0[lane] = force.torsion / (torsion.lever * scale.0[lane]);
                    continue;
                }
                forces.push.0[lane] = force.along / bundle.scale.0[lane];
                if let (Some(slip), Some(friction)) = (&bundle.slip, &row.friction) {
                    let along = tangents(friction.normal).map(|t| t.dot(force.friction) / slip.scale.0[lane]);
                    forces.friction.iter_mut().zip(along).for_each(|(to, along)| to.0[lane] = along);
                }
            }
            forces
        };
        self.bundles.iter().map(of_bundle).collect()
    }
}

/// The directions of friction.
fn tangents(normal: DVec3) -> [DVec3; 2] {
    normal.any_orthonormal_pair().into()
}

impl Bundle {
    /// One to four members of a batch, whose group has these `masses`.
    fn new(members: &[Member], rows: &[Placed<'_>], masses: &Masses) -> Self {
        let of = |member: &Member| (rows[member.number].row, [member.reference, 1 - member.reference]);
        let mut along = Sides::default();
        for (lane, member) in members.iter().enumerate() {
            let (row, sides) = of(member);
            for (to, side) in along.iter_mut().zip(sides) {
                if let Some((_, j)) = &row.sides[side] {
                    to.iter_mut().zip(&j.data.0[0]).for_each(|(to, j)| to.0[lane] = *j);
                }
            }
            if !row.coupled.is_empty() {
                along[0][0].0[lane] = 1.0;
            }
        }
        let count = members.len();
        let scale = masses.scale(masses.weight(&along), count);
        let (mut numbers, mut gap, mut compliance) = ([0; WIDTH], Lanes::ZERO, Lanes::splat(1.0));
        let mut bounds = [f64::NEG_INFINITY, f64::INFINITY].map(Lanes::splat);
        for (lane, member) in members.iter().enumerate() {
            let (placed, scale) = (&rows[member.number], scale.0[lane]);
            numbers[lane] = member.number;
            gap.0[lane] = scale * placed.gap;
            compliance.0[lane] = match (placed.resistance, placed.row.stiffness) {
                (Resistance::Rigid, _) => RIGID,
                (_, Stiffness::Absolute(stiffness)) => scale * scale / stiffness,
                (_, Stiffness::Relative(stiffness)) => 1.0 / stiffness,
            };
            bounds.iter_mut().zip(placed.row.bounds).for_each(|(to, bound)| to.0[lane] = bound / scale);
        }
        let slip = members[0].slips.then(|| {
            let (mut directions, mut arms, mut signs) =
                ([[Lanes::ZERO; 3]; 2], [[Lanes::ZERO; 3]; 2], [Lanes::ZERO; 2]);
            let (mut ways, mut coefficient) = ([Lanes::ZERO; 2], Lanes::ZERO);
            let set = |to: &mut [Lanes; 3], lane: usize, vector: DVec3| {
                to.iter_mut().zip(vector.to_array()).for_each(|(to, value)| to.0[lane] = value);
            };
            for (lane, member) in members.iter().enumerate() {
                let (row, sides) = of(member);
                let Some(friction) = &row.friction else { continue };
                for ((direction, way), tangent) in
                    directions.iter_mut().zip(&mut ways).zip(tangents(friction.normal))
                {
                    set(direction, lane, tangent);
                    way.0[lane] = tangent.dot(friction.way);
                }
                for ((arm, sign), side) in arms.iter_mut().zip(&mut signs).zip(sides) {
                    set(arm, lane, row.arms[side]);
                    sign.0[lane] = if side == 0 { 1.0 } else { -1.0 };
                }
                coefficient.0[lane] = friction.coefficient;
            }
            let along = directions.map(|t| [0, 1].map(|k| signed(&signs[k], &t, &arms[k])));
            let weight = masses.weight(&along[0]) + masses.weight(&along[1]);
            let of_slip = masses.scale(weight * 0.5, count);
            Slips {
                torsion: None,
                tangents: along.map(|[j, _]| masses.scaled(j, of_slip)),
                way: ways.map(|way| of_slip * way),
                coefficient: coefficient * scale / of_slip,
                scale: of_slip,
            }
        });
        let normal = masses.scaled(along[0], scale);
        Self { rows: numbers, count, normal, gap, compliance, bounds, scale, slip }
    }

    /// The torsional friction of `members`, whose pushes are those of `pushes`.
    fn torsional(
        members: &[Member],
        rows: &[Placed<'_>],
        masses: &Masses,
        torsion: Torsion,
        pushes: &Self,
    ) -> Self {
        let (mut along, mut way, mut coefficient) = (Sides::default(), Lanes::ZERO, Lanes::ZERO);
        for (lane, member) in members.iter().enumerate() {
            let Some(friction) = &rows[member.number].row.friction else { continue };
            for (to, side) in along.iter_mut().zip([member.reference, 1 - member.reference]) {
                let turn = if side == 0 { friction.normal } else { -friction.normal };
                to[3..].iter_mut().zip(turn.to_array()).for_each(|(to, value)| to.0[lane] = value);
            }
            way.0[lane] = friction.turn;
            coefficient.0[lane] = friction.torsional;
        }
        let scale = masses.scale(masses.weight(&along), members.len());
        let slip = Slips {
            torsion: Some(torsion),
            tangents: [masses.scaled(along[0], scale), [Lanes::ZERO; 6]],
            way: [scale * way, Lanes::ZERO],
            coefficient: coefficient * pushes.scale / scale,
            scale: scale * torsion.lever.recip(),
        };
        Self {
            normal: [Lanes::ZERO; 6],
            gap: Lanes::ZERO,
            bounds: [f64::NEG_INFINITY, f64::INFINITY].map(Lanes::splat),
            scale: Lanes::splat(1.0),
            slip: Some(slip),
            ..pushes.clone()
        }
    }

    /// The numbers of its rows.
    pub fn rows(&self) -> &[usize] {
        &self.rows[..self.count]
    }

    /// For each bound: whether a row has it.
    #[inline(always)]
    pub fn has(&self, bound: usize, lane: usize) -> bool {
        self.bounds[bound].0[lane].is_finite()
    }

    /// Number of bounds of the force of a row.
    pub fn count_bounds(&self, lane: usize) -> usize {
        usize::from(self.has(0, lane)) + usize::from(self.has(1, lane))
    }

    /// The gaps at the end of the step at this relative velocity.
    #[inline(always)]
    pub fn at(&self, relative: &[f64; 6]) -> Lanes {
        self.gap + dot(&self.normal, relative)
    }

    /// The gaps that these forces leave.
    #[inline(always)]
    pub fn left(&self, relative: &[f64; 6], push: Lanes) -> Lanes {
        self.at(relative) + self.compliance * push
    }

    /// How far a force is from being right, as a way, m: from the force that a spring that keeps it
    /// finds with the gap that is left.
    pub fn off(&self, lane: usize, left: Lanes, push: Lanes) -> f64 {
        let [low, high] = self.bounds.map(|bound| bound.0[lane]);
        let again = push.0[lane] - left.0[lane];
        (again.max(low).min(high) - push.0[lane]).abs() / self.scale.0[lane]
    }

    /// How far the gaps are from ones that need no force.
    pub fn violation(&self, relative: &[f64; 6]) -> f64 {
        let gap = self.at(relative);
        let of_row = |lane: usize| match (self.bounds[0].0[lane], self.bounds[1].0[lane]) {
            (0.0, _) => (-gap.0[lane]).max(0.0),
            (_, 0.0) => gap.0[lane].max(0.0),
            _ => gap.0[lane].abs(),
        };
        (0..self.count).map(of_row).fold(0.0, f64::max)
    }

    /// Adds the momentum that pushes and friction give in the step.
    #[inline(always)]
    pub fn act(&self, push: Lanes, friction: [Lanes; 2], to: &mut [Lanes; 6]) {
        to.iter_mut().zip(&self.normal).for_each(|(to, j)| *to += *j * push);
        if let Some(slip) = &self.slip {
            for (tangent, friction) in slip.tangents.iter().zip(friction) {
                to.iter_mut().zip(tangent).for_each(|(to, j)| *to += *j * friction);
            }
        }
    }

    /// Puts what it does of the force of a row, N or N m. Torsional friction comes after the rest.
    pub fn tell(&self, lane: usize, row: &Row, forces: &Forces, to: &mut RowForce) {
        if let Some(Slips { torsion: Some(torsion), scale, .. }) = &self.slip {
            to.torsion = torsion.lever * scale.0[lane] * forces.friction[0].0[lane];
            return;
        }
        let friction = match (&self.slip, &row.friction) {
            (Some(slip), Some(friction)) => {
                let [x, y] = tangents(friction.normal);
                let [along_x, along_y] = forces.friction.map(|friction| friction.0[lane]);
                slip.scale.0[lane] * (along_x * x + along_y * y)
            }
            _ => DVec3::ZERO,
        };
        *to = RowForce { along: forces.push.0[lane] * self.scale.0[lane], friction, torsion: 0.0 };
    }
}

/// The scalar product. nalgebra's is a loop.
#[inline]
fn dot6(a: &Vector6<f64>, b: &Vector6<f64>) -> f64 {
    let ([a, b, c, d, e, f], [u, v, w, x, y, z]) = (a.data.0[0], b.data.0[0]);
    (a * u + b * v + c * w) + (d * x + e * y + f * z)
}

/// `J v`
#[inline(always)]
pub fn dot(j: &[Lanes; 6], v: &[f64; 6]) -> Lanes {
    (j[0] * v[0] + j[1] * v[1] + j[2] * v[2]) + (j[3] * v[3] + j[4] * v[4] + j[5] * v[5])
}

impl Slips {
    /// What a relative velocity adds to the ways.
    #[inline(always)]
    pub fn change(&self, relative: &[f64; 6]) -> [Lanes; 2] {
        [dot(&self.tangents[0], relative), dot(&self.tangents[1], relative)]
    }
}
