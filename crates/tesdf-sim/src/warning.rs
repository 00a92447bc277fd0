//! What a run did not do as its scene asks: warnings for users.
use serde::{Deserialize, Serialize};
use tesdf::base::elementary;
use tesdf::collide::{CollideError, InstancePair, PenetrationOptions, deepest_penetration, instance_pairs};

use crate::criterion::JointDrift;
use crate::scene_file::SceneFile;
use crate::totals::Totals;
use crate::{HiddenPair, JointKind, Mass, Residual, System};

/// Joints that come farther apart than this fraction of the diagonal of their child are told.
const APART: f64 = 1e-3;

/// Joints that turn farther apart than this are told, rad.
const TWISTED: f64 = 1e-2;

/// A gain of energy is told from this fraction of the greatest kinetic energy on.
const GAIN: f64 = 0.05;

/// A gain is visible if it lets all bodies move by more than this fraction of the smallest one in a
/// step.
const VISIBLE: f64 = 1e-3;

/// Error of the measured overlaps, as a fraction of the depth that is told.
const TOLERANCE: f64 = 0.1;

/// What a [`Warning`] is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum WarningKind {
    /// Bodies overlapped, and no contact showed it. The value is a lower bound of the depth, m.
    Hidden,
    /// Bodies overlap deeply at the end. The value is the depth by the exact clearance, m.
    Overlap,
    /// A joint came apart, or its coupling with another one does not hold. The value is the
    /// distance, m.
    Joint,
    /// Energy grew while nothing drove the bodies. The value is the gain, J.
    Energy,
    /// Steps did not converge. The value is their part of all steps.
    NotConverged,
}

/// What a run did not do as its scene asks. There is one of each kind but
/// [`Hidden`](WarningKind::Hidden), of which there is one for each pair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Warning {
    /// What it is about.
    pub kind: WarningKind,
    /// The bodies, or the joint, with the greatest value.
    pub names: Vec<String>,
    /// When it was first so, s: the time of the state, or of the beginning of the step. An overlap
    /// is measured at the end only.
    pub time: f64,
    /// How much, as the kind says.
    pub value: f64,
    /// Number of pairs of bodies, of joints, or of steps.
    pub count: u64,
    /// A line for users: what, where, how much, and what to do.
    pub message: String,
}

/// Watches the steps of a run.
#[derive(Clone, Debug)]
pub(crate) struct Watch {
    /// `None` where detection is off: a depth from which an overlap is told, as a fraction of the
    /// diagonal of the smaller body.
    deep: Option<f64>,
    /// For each joint: how far it came apart.
    joints: Vec<Apart>,
    energy: Energy,
    /// Diagonals of the bodies, m.
    sizes: Vec<f64>,
    /// Duration of a step, s.
    time_step: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Apart {
    /// The greatest distance and angle so far, m and rad.
    distance: f64,
    angle: f64,
    /// When the distance was greatest, s.
    time: f64,
    /// The greater of both, as a multiple of that from which on a joint is told.
    share: f64,
    /// When that was first above 1, s.
    first: Option<f64>,
}

/// Energy that bodies gained while nothing drove them, J.
#[derive(Clone, Copy, Debug, Default)]
struct Energy {
    /// What was gained less what was lost, and the least that this has been.
    change: f64,
    least: f64,
    gain: f64,
    /// When the gain was greatest, s.
    time: f64,
    /// When the gain was first one that is told, s.
    first: Option<f64>,
    /// The greatest kinetic energy.
    kinetic: f64,
    /// A gain up to this is not visible.
    visible: f64,
}

/// Kinetic and potential energy, J.
pub(crate) fn energies(system: &System) -> [f64; 2] {
    [system.kinetic_energy(), system.potential_energy()]
}

impl Watch {
    pub(crate) fn new(scene: &SceneFile, system: &System) -> Self {
        let sizes: Vec<f64> =
            system.bodies().iter().map(|body| system.diagonal(body).unwrap_or(0.0)).collect();
        let masses = system.bodies().iter().zip(&sizes).filter_map(|(body, size)| match body.mass {
            Mass::Free(mass) => Some((mass.mass, *size)),
            Mass::Fixed | Mass::Kinematic => None,
        });
        let (mass, size) =
            masses.fold((0.0, f64::INFINITY), |(m, least), (mass, size)| (m + mass, size.min(least)));
        let visible = 0.5 * mass * elementary::powi(VISIBLE * size / scene.time_step, 2);
        Self {
            deep: scene.detector.mode.map(|_| scene.solver.deep),
            joints: vec![Apart::default(); system.joints().len()],
            energy: Energy { visible, ..Energy::default() },
            sizes,
            time_step: scene.time_step,
        }
    }

    /// Records the state after a step that ends at `time`, s. `before` are the energies at its
    /// beginning.
    pub(crate) fn observe(&mut self, system: &System, before: [f64; 2], time: f64) {
        for (apart, joint) in self.joints.iter_mut().zip(system.joints()) {
            let (distance, angle) = joint.error(System::poses_of(joint, system.states()));
            let size = self.sizes.get(joint.child).copied().unwrap_or(0.0);
            apart.observe(distance, angle, size, time);
        }
        for coupling in system.couplings() {
            let coordinates = system.coordinates();
            let error = (coordinates[coupling.joint] - coupling.target(coordinates)).abs();
            let joint = &system.joints()[coupling.joint];
            let size = self.sizes.get(joint.child).copied().unwrap_or(0.0);
            let [distance, angle] = if joint.kind == JointKind::Slider { [error, 0.0] } else { [0.0, error] };
            self.joints[coupling.joint].observe(distance, angle, size, time);
        }
        self.energy.observe(system, before, time);
    }

    /// How far the joints came apart; `None` when there are none.
    pub(crate) fn drift(&self) -> Option<JointDrift> {
        let drifts = self.joints.iter().map(|&Apart { distance, angle, .. }| JointDrift { distance, angle });
        drifts.reduce(|one, other| JointDrift {
            distance: one.distance.max(other.distance),
            angle: one.angle.max(other.angle),
        })
    }

    /// What the steps so far did not do as the scene asks, but overlaps. `system` is that after the
    /// last step.
    pub(crate) fn so_far(&self, system: &System, totals: &Totals) -> Vec<Warning> {
        let warnings = [self.joint(system), self.energy(), not_converged(totals, self.time_step)];
        warnings.into_iter().flatten().collect()
    }

    /// Of bodies that overlap in this state at the end, at `time`, s. Of pairs that cannot be
    /// measured nothing is said.
    pub(crate) fn overlap(&self, system: &System, time: f64) -> Option<Warning> {
        let deep = self.overlaps(system, self.deep?).unwrap_or_default();
        let worst = deep.iter().max_by(|x, y| x.1.total_cmp(&y.1))?;
        let names = worst.0.map(|body| system.bodies()[body].name.clone());
        let [a, b] = &names;
        let message = format!(
            "bodies {a} and {b} overlap by {:.3e} m at the end{}: start them apart, or press them less",
            worst.1,
            among(deep.len(), "pairs that overlap deeply")
        );
        let count = deep.len() as u64;
        Some(Warning {
            kind: WarningKind::Overlap,
            names: names.into(),
            time,
            value: worst.1,
            count,
            message,
        })
    }

    /// The pairs of bodies, of which one is free at least, that overlap deeper than this fraction
    /// of the smaller one, and how deep, m.
    fn overlaps(&self, system: &System, deep: f64) -> Result<Vec<([usize; 2], f64)>, CollideError> {
        // The instances of the system have the poses of the last detection.
        let mut system = system.clone();
        let states = system.states().to_vec();
        system.scene_at(&states)?;
        let scene = system.scene();
        let mut found = Vec::new();
        for InstancePair { first, second, .. } in instance_pairs(scene, 0.0, 0.0)? {
            let (Some(a), Some(b)) = (system.body_of(first), system.body_of(second)) else { continue };
            let is_free = |body: usize| matches!(system.bodies()[body].mass, Mass::Free(_));
            let bound = deep * self.sizes[a].min(self.sizes[b]);
            if bound <= 0.0 || !(is_free(a) || is_free(b)) {
                continue;
            }
            let options = PenetrationOptions { above: bound, tolerance: TOLERANCE * bound };
            let measured = deepest_penetration(scene, &[[first, second]], &options)?;
            if let Some((_, clearance)) = measured.deepest {
                found.push(([a, b], -clearance.distance));
            }
        }
        Ok(found)
    }

    fn joint(&self, system: &System) -> Option<Warning> {
        let first = self.joints.iter().filter_map(|apart| apart.first).reduce(f64::min)?;
        let count = self.joints.iter().filter(|apart| apart.first.is_some()).count();
        let of_all = self.joints.iter().zip(system.joints());
        let (apart, joint) = of_all.max_by(|x, y| x.0.share.total_cmp(&y.0.share))?;
        let Apart { distance, angle, time, .. } = apart;
        let message = format!(
            "joint {} came apart by {distance:.3e} m and {angle:.3e} rad, farthest at {time:.4} s{}: shorten the time \
             step, or see whether joints, limits and contacts contradict each other",
            joint.name,
            among(count, "joints that came apart")
        );
        Some(Warning {
            kind: WarningKind::Joint,
            names: vec![joint.name.clone()],
            time: first,
            value: *distance,
            count: count as u64,
            message,
        })
    }

    fn energy(&self) -> Option<Warning> {
        let Energy { gain, time, first, kinetic, .. } = self.energy;
        self.energy.is_told().then(|| Warning {
            kind: WarningKind::Energy,
            names: Vec::new(),
            time: first.unwrap_or(time),
            value: gain,
            count: 1,
            message: format!(
                "energy grew by {gain:.3e} J up to {time:.4} s, {:.0} % of the greatest kinetic energy, and nothing drives \
                 the bodies: shorten the time step",
                1e2 * gain / kinetic
            ),
        })
    }
}

impl Apart {
    /// A distance, m, and an angle, rad, of a joint whose child has this size, m.
    fn observe(&mut self, distance: f64, angle: f64, size: f64, time: f64) {
        if distance > self.distance {
            (self.distance, self.time) = (distance, time);
        }
        self.angle = self.angle.max(angle);
        self.share = (self.distance / (APART * size)).max(self.angle / TWISTED);
        if self.share > 1.0 {
            self.first.get_or_insert(time);
        }
    }
}

impl Energy {
    /// A push-out raises bodies without a velocity, so only what becomes kinetic energy counts.
    fn observe(&mut self, system: &System, before: [f64; 2], time: f64) {
        let [kinetic, potential] = energies(system);
        self.kinetic = self.kinetic.max(kinetic).max(before[0]);
        if is_driven(system) {
            (self.change, self.least) = (0.0, 0.0);
            return;
        }
        let (of_all, of_kinetic) = (kinetic + potential - before[0] - before[1], kinetic - before[0]);
        self.change += if of_all > 0.0 { of_all.min(of_kinetic).max(0.0) } else { of_all };
        self.least = self.least.min(self.change);
        if self.change - self.least > self.gain {
            (self.gain, self.time) = (self.change - self.least, time);
        }
        if self.is_told() {
            self.first.get_or_insert(time);
        }
    }

    fn is_told(&self) -> bool {
        self.gain > self.visible && self.gain > GAIN * self.kinetic
    }
}

/// Whether a motor, a wrench or a kinematic body may do work.
fn is_driven(system: &System) -> bool {
    system.joints().iter().any(|joint| joint.motor.is_some())
        || system.bodies().iter().any(|body| matches!(body.mass, Mass::Kinematic))
        || system.wrenches().iter().any(|wrench| wrench.force.length() > 0.0 || wrench.torque.length() > 0.0)
}

/// Of a pair whose first hidden overlap was at `time`, s.
pub(crate) fn of_hidden(pair: &HiddenPair, time: f64) -> Warning {
    Warning {
        kind: WarningKind::Hidden,
        names: pair.bodies.to_vec(),
        time,
        value: pair.depth,
        count: pair.steps,
        message: pair.message(),
    }
}

fn not_converged(totals: &Totals, time_step: f64) -> Option<Warning> {
    let &Totals { steps, unconverged, first_unconverged, residual, .. } = totals;
    let first = first_unconverged? as f64 * time_step;
    let why = if residual == Residual::default() {
        "fast bodies may have passed into each other".to_owned()
    } else {
        let Residual { way, force } = residual;
        let way = 1e6 * way;
        format!("contacts, friction and joints are off by {way:.3e} µm and {force:.3e} N at most")
    };
    let message = format!(
        "{unconverged} of {steps} steps did not converge, the first at {first:.4} s: {why}; shorten the time step"
    );
    let value = unconverged as f64 / steps as f64;
    let (kind, names) = (WarningKind::NotConverged, Vec::new());
    Some(Warning { kind, names, time: first, value, count: unconverged, message })
}

fn among(count: usize, what: &str) -> String {
    if count == 1 { String::new() } else { format!(", the most of {count} {what}") }
}
