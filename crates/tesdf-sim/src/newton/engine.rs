use std::sync::Arc;

use glam::DVec3;
use nalgebra::Vector6;
use tesdf::collide::internal::Ahead;
use tesdf::collide::{
    CollideError, CollideOptions, Contact, Contacts, HiddenOverlap, HiddenSearch, Pose, Shape, Velocity,
    instance_pairs,
};

use super::bounce::{Bounces, Meeting};
use super::deep::Surfaces;
use super::gaps::Gaps;
use super::integrate::{Outside, free_linear, moved, pack, unpack, velocity};
use super::kept::{FORGETS, Kept};
use super::look::Look;
use super::passing::{MOST_TURN, Passing};
use super::rotation::Rotation;
use super::rows::FreeBody;
use super::seen::{Detection, Seen, Unmoved};
use super::sleep::Sleep;
use super::step::{Step, set_velocities};
use super::stopwatch::Stopwatch;
use super::velocities::Solved;
use super::{Detect, Newton, NewtonOptions};
use crate::dynamics::Verdict;
use crate::forces::Forces;
use crate::{Dynamics, DynamicsError, Mass, MassProperties, Motor, State, StepReport, System, Wrench};

/// Maximum number of further detections in a step when bodies close faster than was foreseen.
const MORE_LOOKS: u32 = 8;

/// A step has at most as many parts because bodies turn far.
const MOST_PARTS: f64 = 1000.0;

/// Of the times of parts.
const ROUNDING: f64 = 1e-9;

/// Maximum number of times that a part of a step is divided because a fast pair would pass.
const MOST_DIVISIONS: u32 = 32;

/// The solution of a part of a step.
struct Part {
    /// The states at its end.
    states: Vec<State>,
    /// The contacts at its beginning.
    found: Contacts,
    /// Whether pairs pass in it.
    passing: Option<Passing>,
    /// Whether joints do not hold in it, but may in shorter parts.
    is_loose: bool,
    /// The forces in it.
    forces: Forces,
    /// What is reported of it.
    report: StepReport,
}

/// What came of an attempt to solve a part of a step.
enum Made {
    Part(Box<Part>),
    /// Bodies have woken, or have bounced off each other: it is to be solved anew.
    Again,
    /// The part must end after this time, s, where bodies bounce off each other.
    In(f64),
}

impl Newton {
    /// An engine for `system`.
    ///
    /// All values of `collide` are used except the speculative time, which follows from the time
    /// step. The contacts should not be reduced: with 64 contacts per pair, a nut of 50 µm
    /// clearance tunnelled.
    ///
    /// # Errors
    /// An option of `options` or `collide` is out of range, or a coupling does not hold at the
    /// start.
    pub fn new(
        system: System,
        detector: impl Detect + 'static,
        collide: CollideOptions,
        options: NewtonOptions,
    ) -> Result<Self, DynamicsError> {
        options.validate()?;
        collide.validate()?;
        system.check_couplings()?;
        let diagonals = system.bodies().iter().map(|body| system.diagonal(body));
        let sizes = diagonals.collect::<Result<_, CollideError>>()?;
        let reach = greatest_reach(&system)?;
        let (detector, found) = (Arc::new(detector), Contacts::default());
        let surfaces = Arc::new(Surfaces::new(system.scene(), collide.mode));
        let forces = Forces::none(system.joints().len());
        let (sleep, kept, seen) = (Sleep::new(system.states()), Kept::default(), Seen::default());
        Ok(Self {
            system,
            detector,
            collide,
            options,
            sizes,
            reach,
            surfaces,
            found,
            forces,
            sleep,
            kept,
            seen,
        })
    }

    /// Sets gravity, m/s², from now on. All bodies wake.
    ///
    /// # Errors
    /// [`DynamicsError::Option`] when a component is not finite.
    pub fn set_gravity(&mut self, gravity: DVec3) -> Result<(), DynamicsError> {
        if let Some(found) = gravity.to_array().into_iter().find(|c| !c.is_finite()) {
            return Err(DynamicsError::Option { option: "gravity", found, expected: "finite numbers" });
        }
        self.system.gravity = gravity;
        self.wake_all();
        Ok(())
    }

    /// Sets the mass properties of a free body from now on. It wakes. Its points keep their
    /// velocities.
    ///
    /// # Errors
    /// As [`System::set_mass`].
    pub fn set_mass(&mut self, body: usize, mass: MassProperties) -> Result<(), DynamicsError> {
        self.system.set_mass(body, mass)?;
        self.wake(body);
        Ok(())
    }

    /// Sets the coefficient of friction of a body from now on, as [`System::friction`] uses it. It
    /// wakes, with the bodies that it touches.
    ///
    /// # Errors
    /// As [`System::set_friction`].
    pub fn set_friction(&mut self, body: usize, coefficient: f64) -> Result<(), DynamicsError> {
        self.system.set_friction(body, coefficient)?;
        self.wake(body);
        Ok(())
    }

    /// Sets the coefficient of torsional friction of a body from now on, m, as
    /// [`System::friction_torsional`] uses it. It wakes, with the bodies that it touches.
    ///
    /// # Errors
    /// As [`System::set_friction`].
    pub fn set_friction_torsional(&mut self, body: usize, coefficient: f64) -> Result<(), DynamicsError> {
        self.system.set_friction_torsional(body, coefficient)?;
        self.wake(body);
        Ok(())
    }

    /// A part of a step, of `h` seconds of its `whole`. Nothing is known of it yet.
    pub(super) fn begin(&self, h: f64, whole: f64) -> Step {
        let states = self.system.states();
        let mut free_of = vec![None; states.len()];
        let (mut free, mut target, mut rotations) = (Vec::new(), Vec::new(), Vec::new());
        for (k, (body, state)) in self.system.bodies().iter().zip(states).enumerate() {
            if let Mass::Free(mass) = body.mass
                && !self.sleep.is_still(k)
            {
                free_of[k] = Some(free.len());
                let (gravity, wrench) = (self.system.gravity, self.system.wrenches()[k]);
                let outside = Outside {
                    gravity,
                    wrench,
                    linear_damping: body.linear_damping,
                    angular_damping: body.angular_damping,
                };
                let rotation = Rotation::new(&mass, state, &outside, h);
                let mean = rotation.mean(rotation.momentum);
                // Rows act in the middle of the rotation.
                free.push(FreeBody::new(k, &mass, rotation.middle(mean)));
                target.push(pack(free_linear(&mass, state, &outside, h), mean));
                rotations.push(rotation);
            }
        }
        let poses = states.iter().map(|state| state.pose).collect();
        let report = StepReport::begun();
        let [deep, resting] = [(); 2].map(|()| vec![false; free.len()]);
        Step { h, whole, poses, free, free_of, target, rotations, deep, resting, report }
    }

    /// The states after moving for one step at `velocities`. Their velocities are `velocities`.
    pub(super) fn moved(&self, step: &Step, velocities: &[Vector6<f64>]) -> Vec<State> {
        self.moved_for(step, velocities, step.h)
    }

    /// The same, after moving for `time` seconds.
    pub(super) fn moved_for(&self, step: &Step, velocities: &[Vector6<f64>], time: f64) -> Vec<State> {
        let mut states = self.system.states().to_vec();
        for (body, state) in states.iter_mut().enumerate() {
            if self.system.bodies()[body].mass == Mass::Kinematic {
                state.pose = self.pose_after(step, body, &velocity(state), time);
            }
        }
        for (free, v) in step.free.iter().zip(velocities) {
            let (linear, angular) = unpack(v);
            let pose = self.pose_after(step, free.body, v, time);
            states[free.body] = State { pose, linear, angular };
        }
        states
    }

    /// The pose of a body that has moved at a velocity for a time, s, since the part began.
    pub(super) fn pose_after(&self, step: &Step, body: usize, v: &Vector6<f64>, time: f64) -> Pose {
        let begin = step.poses[body];
        match self.system.bodies()[body].mass {
            Mass::Fixed => begin,
            // Without a velocity the pose stays bit for bit.
            Mass::Kinematic if *v == Vector6::zeros() => begin,
            Mass::Kinematic => moved(DVec3::ZERO, begin, v, time),
            Mass::Free(mass) => moved(mass.center, begin, v, time),
        }
    }

    /// The options of a detection. Within a step, gravity acts on one body of a pair while contacts
    /// hold the other, so it counts for all pairs.
    pub(super) fn options_of(&self, time_step: f64) -> CollideOptions {
        let speculative_time = self.options.speculation * time_step;
        let fall = speculative_time * time_step * self.system.gravity.length();
        let contact_distance = self.collide.contact_distance + fall;
        CollideOptions { contact_distance, speculative_time, ..self.collide }
    }

    /// What is detected with the bodies in these states, as far ahead as their velocities move them.
    pub(super) fn detect(
        &mut self,
        step: &mut Step,
        states: &[State],
        hidden: HiddenSearch,
    ) -> Result<Arc<Detection>, DynamicsError> {
        let start = Stopwatch::start();
        let options = CollideOptions { hidden, ..self.options_of(step.h) };
        self.system.scene_at(states)?;
        let unmoved = self.seen.unmoved(&self.system, &options);
        let detection = match unmoved.as_ref().and_then(Unmoved::whole) {
            Some(same) => same,
            None => {
                let contacts = self.detect_moved(unmoved, &options)?;
                let detection = Detection::new(&self.system, &options, contacts);
                self.seen.add(detection.clone());
                detection
            }
        };
        step.report.detections += 1;
        step.report.detection += start.elapsed();
        Ok(detection)
    }

    /// What is detected in the scene, of which the detector looks only at what has moved.
    fn detect_moved(
        &mut self,
        unmoved: Option<Unmoved>,
        options: &CollideOptions,
    ) -> Result<Contacts, DynamicsError> {
        let Some(unmoved) = unmoved else { return Ok(self.detector.detect(self.system.scene(), options)?) };
        let found = match unmoved.is_all() {
            true => Contacts::default(),
            false => {
                self.mark(unmoved.bodies());
                let found = self.detector.detect(self.system.scene(), options);
                self.mark(unmoved.still());
                found?
            }
        };
        Ok(unmoved.with(found, &self.system))
    }

    pub(super) fn gaps<'a>(&'a self, step: &'a Step) -> Gaps<'a> {
        let Self { system, options, sizes, collide: CollideOptions { mode, .. }, .. } = self;
        Gaps { system, options, sizes, mode: *mode, step }
    }

    /// Detects as far ahead as the velocities of `ahead` move the bodies.
    fn look(&mut self, step: &mut Step, ahead: &[State]) -> Result<Arc<Detection>, DynamicsError> {
        self.detect(step, ahead, HiddenSearch::On)
    }

    /// Whether no body moves so far with the velocities of `ahead` that a look would have to be
    /// extended, wherever it looked: each pair closes by less than the contact distance.
    ///
    /// The origins of two bodies whose boxes meet are at most `2 √3 r` apart, where `r` is the
    /// greatest distance of a point from its origin. So with the greatest way `w` of an origin and
    /// the greatest rotation `t`, points move by at most `2 w + 6 r t` as seen from the other body,
    /// and by terms of second order.
    fn is_slow(&self, step: &Step, ahead: &[State]) -> bool {
        let (mut way, mut turn) = (0.0, 0.0);
        for (k, (body, state)) in self.system.bodies().iter().zip(ahead).enumerate() {
            let Velocity { linear, angular } = System::velocity_of_origin(body, state);
            way = f64::max(way, step.h * linear.length());
            turn = f64::max(turn, step.h * angular.length());
            // A plane that turns moves far away without bounds.
            if angular != DVec3::ZERO && self.sizes[k].is_infinite() {
                return false;
            }
        }
        turn <= 0.1 && 4.0 * (way + 4.0 * turn * self.reach) <= self.options_of(step.h).contact_distance
    }

    /// The pairs of bodies that move closer at the velocities of `ahead` than `look` has looked.
    fn outrun(
        &mut self,
        step: &Step,
        look: &Look,
        ahead: &[State],
    ) -> Result<Vec<[usize; 2]>, DynamicsError> {
        let pairs = look.outrun(self.system.scene_at(ahead)?, step.h)?;
        let bodies = pairs.into_iter().filter_map(|(a, b)| {
            let bodies = [self.system.body_of(a)?, self.system.body_of(b)?];
            // Bodies that overlap deeply are pushed apart, not into others.
            let is_deep = |body: usize| step.free_of[body].is_some_and(|k| step.deep[k]);
            (!bodies.iter().any(|&body| is_deep(body))).then_some(bodies)
        });
        Ok(bodies.collect())
    }

    /// Puts the velocities into `ahead` with which the next look finds what `velocities` bring
    /// together and `look`, with the velocities that are in `ahead`, has not. Returns whether there
    /// is something to find.
    ///
    /// Where bodies fall together and the lowest is stopped, the next one may be stopped by it, and
    /// so on. So a body that is met takes over the velocity of the one that it meets, and may meet
    /// others with it. Of two bodies in a row, the look has one at its own velocity and one at that
    /// which it takes over.
    fn look_on(
        &mut self,
        step: &Step,
        look: &mut Look,
        ahead: &mut [State],
        velocities: &[Vector6<f64>],
    ) -> Result<bool, DynamicsError> {
        let foreseen = ahead.to_vec();
        set_velocities(ahead, &step.free, velocities);
        // The speed at which deep bodies are pushed apart would make the look reach through the
        // pile.
        for (free, _) in step.free.iter().zip(&step.deep).filter(|(_, deep)| **deep) {
            ahead[free.body] = foreseen[free.body];
        }
        if self.is_slow(step, ahead) {
            return Ok(false);
        }
        let options = self.options_of(step.h);
        look.measure(self.system.scene_at(&foreseen)?, &options)?;
        let own = ahead.to_vec();
        let change = |body: usize| {
            let (from, to) = (&foreseen[body], &own[body]);
            from.linear.distance(to.linear) + self.sizes[body] * from.angular.distance(to.angular)
        };
        let changes: Vec<f64> = (0..own.len()).map(change).collect();
        // How many bodies are between a body and the first one of its row.
        let mut place: Vec<Option<u32>> = vec![None; own.len()];
        loop {
            let mut is_longer = false;
            for [a, b] in self.outrun(step, look, ahead)? {
                let [a, b] = if changes[a] >= changes[b] { [a, b] } else { [b, a] };
                let (meets, met) = match (place[a], place[b]) {
                    (None, Some(_)) => (b, a),
                    (_, None) => (a, b),
                    (Some(_), Some(_)) => continue,
                };
                let first = *place[meets].get_or_insert(0);
                place[met] = Some(first + 1);
                is_longer = true;
                if step.free_of[met].is_some() {
                    ahead[met].linear = ahead[meets].linear;
                }
            }
            if !is_longer {
                break;
            }
        }
        for (body, place) in place.iter().enumerate() {
            match place {
                // What the others bring together has been seen, and is not looked at again.
                None => ahead[body] = foreseen[body],
                Some(place) if place % 2 == 1 => ahead[body] = own[body],
                Some(_) => {}
            }
        }
        Ok(place.iter().any(Option::is_some))
    }

    /// Whether a body has no directions.
    pub(super) fn is_ball(&self, body: usize) -> bool {
        let scene = self.system.scene();
        let shape = scene.instance(self.system.bodies()[body].instance).map(|i| scene.shape(i.shape));
        matches!(shape, Ok(Ok(Shape::Sphere { .. })))
    }

    /// How long the next part may be when `left` seconds of a step, `whole`, are left: so that no
    /// body that may meet another one turns by more than [`MOST_TURN`], and no arm of a joint too
    /// far. Balls may turn as they like.
    fn part_of(&mut self, left: f64, whole: f64) -> Result<f64, DynamicsError> {
        let left = self.part_of_arms(left, whole);
        let states = self.system.states().to_vec();
        let turn = |(body, state): (usize, &State)| match self.is_ball(body) {
            true => 0.0,
            false => left * state.angular.length(),
        };
        let turns: Vec<f64> = states.iter().enumerate().map(turn).collect();
        if turns.iter().all(|turn| *turn <= MOST_TURN) {
            return Ok(left);
        }
        let CollideOptions { contact_distance, speculative_time, .. } = self.options_of(left);
        let pairs = instance_pairs(self.system.scene_at(&states)?, contact_distance, speculative_time)?;
        let bodies = pairs.iter().flat_map(|pair| [pair.first, pair.second]);
        let most = bodies.filter_map(|id| Some(turns[self.system.body_of(id)?])).fold(0.0, f64::max);
        // Equal parts stay so, whatever rounding does.
        let parts = ((1.0 - ROUNDING) * most / MOST_TURN).ceil().max(1.0);
        Ok((left / parts).max(whole / MOST_PARTS).min(left))
    }

    /// Solves a part of a step, `whole`, that takes `time_step` seconds. Nothing moves yet.
    fn part(&mut self, time_step: f64, whole: f64, bounces: &mut Bounces) -> Result<Made, DynamicsError> {
        let begin = Stopwatch::start();
        let mut step = self.begin(time_step, whole);
        // The detection must reach as far as the step can close, so it uses the velocities that
        // wrenches give; gravity is in the contact distance. Contacts, motors and joints change
        // them.
        let mut ahead = self.system.states().to_vec();
        let falling = pack(time_step * self.system.gravity, DVec3::ZERO);
        let target: Vec<_> = step.target.iter().map(|v| v - falling).collect();
        set_velocities(&mut ahead, &step.free, &target);
        let first = self.look(&mut step, &ahead)?;
        self.seen.begin(first.clone());
        let mut look = Look::new(first.contacts().clone());
        if self.wakes(look.contacts.as_slice()) {
            return Ok(Made::Again);
        }
        match self.meet(&mut step, look.contacts.as_slice(), bounces)? {
            Meeting::None => {}
            Meeting::Parted => return Ok(Made::Again),
            Meeting::After(time) => return Ok(Made::In(time)),
        }
        let mut solved = self.velocities(&mut step, look.contacts.as_slice())?;
        for _ in 0..MORE_LOOKS {
            if !self.look_on(&step, &mut look, &mut ahead, &solved.velocities)? {
                break;
            }
            let mut more = Look::new(self.look(&mut step, &ahead)?.contacts().clone());
            more.measure(self.system.scene(), &self.options_of(step.h))?;
            if !look.extend(more, self.system.scene()) {
                break;
            }
            if self.wakes(look.contacts.as_slice()) {
                return Ok(Made::Again);
            }
            // What an earlier minimisation did not reach is of no account.
            step.report.take_back(Verdict::GOOD);
            solved = self.velocities(&mut step, look.contacts.as_slice())?;
        }
        let Solved { velocities, carried, forces } = solved;
        let mut states = self.moved(&step, &velocities);
        let passing = self.passing(&mut step, &states)?;
        let is_loose = self.is_loose(&states, time_step, whole);
        set_velocities(&mut states, &step.free, &carried);
        self.hold(&step, &velocities, &mut states);
        let mut report = step.report;
        let found = look.contacts;
        report.solution = begin.elapsed().saturating_sub(report.detection);
        Ok(Made::Part(Box::new(Part { states, found, passing, is_loose, forces, report })))
    }

    /// Moves by a step, in as many parts as bodies that turn far, fast pairs and joints need.
    fn in_parts(&mut self, whole: f64) -> Result<StepReport, DynamicsError> {
        let mut report = self.begin_sleep(whole)?;
        let mut first: Option<Contacts> = None;
        let mut touching = Vec::new();
        let mut bounces = Bounces::new(self.system.joints().len());
        let (mut left, mut longest) = (whole, whole);
        let mut time = self.part_of(left, whole)?;
        if self.is_all_still() {
            (left, report.parts) = (0.0, 1);
        }
        while left > 0.0 {
            let part = match self.part(time, whole, &mut bounces)? {
                Made::Part(part) => part,
                Made::Again => continue,
                Made::In(sooner) => {
                    time = sooner;
                    continue;
                }
            };
            let Part { states, found, passing, is_loose, forces: of_rows, report: mut of_part } = *part;
            let may_divide = report.divided < MOST_DIVISIONS;
            let half = is_loose.then_some(Passing { hit: None, pairs: 0 });
            let divides = passing.filter(|_| may_divide).or(half);
            // A part that is divided is solved again.
            if divides.is_some() {
                of_part.take_back(Verdict::GOOD);
            }
            report.add(&of_part);
            touching = self.touching(found.as_slice());
            first.get_or_insert_with(|| self.with_kept(found));
            if let Some(Passing { hit, .. }) = divides {
                report.divided += 1;
                time = hit.unwrap_or(0.5 * time);
                if hit.is_none() {
                    longest = time;
                }
                continue;
            }
            report.parts += 1;
            report.unbounded += passing.map_or(0, |passing| passing.pairs);
            report.converged &= passing.is_none();
            self.system.follow(states, time)?;
            bounces.forces.add(&of_rows, time / whole);
            left -= time;
            longest *= 2.0;
            time = self.part_of(left, whole)?.min(longest);
        }
        self.found = first.unwrap_or_else(|| self.with_kept(Contacts::default()));
        let Bounces { forces, report: of_bounces, .. } = bounces;
        report.add(&of_bounces);
        self.forces = self.with_still(forces);
        report.contacts = self.found.len();
        report.deepest = self.found.iter().map(|c| c.distance).reduce(f64::min);
        report.asleep = self.end_sleep(whole, &touching)?;
        Ok(report)
    }
}

/// The greatest distance of a point of a body from its origin, m. Planes do not count.
fn greatest_reach(system: &System) -> Result<f64, CollideError> {
    let (scene, mut greatest) = (system.scene(), 0.0);
    for body in system.bodies() {
        let instance = scene.instance(body.instance)?;
        let Ahead { reach, .. } = Ahead::new(instance, scene.shape(instance.shape)?, 0.0);
        if reach.is_finite() {
            greatest = f64::max(greatest, reach);
        }
    }
    Ok(greatest)
}

impl Dynamics for Newton {
    fn system(&self) -> &System {
        &self.system
    }

    fn set_state(&mut self, body: usize, state: State) -> Result<(), DynamicsError> {
        self.set_state_awake(body, state)
    }

    fn set_motor(&mut self, joint: usize, motor: Option<Motor>) -> Result<(), DynamicsError> {
        self.set_motor_awake(joint, motor)
    }

    fn set_wrench(&mut self, body: usize, wrench: Wrench) -> Result<(), DynamicsError> {
        self.set_wrench_awake(body, wrench)
    }

    fn recall(&mut self, states: Vec<State>, time_step: Option<f64>) -> Result<(), DynamicsError> {
        match time_step {
            Some(_) => self.kept.end(),
            None => self.kept.restart(),
        }
        self.recall_states(states, time_step)
    }

    fn remembers(&self) -> u64 {
        FORGETS
    }

    fn step(&mut self, time_step: f64) -> Result<StepReport, DynamicsError> {
        if !(time_step > 0.0 && time_step.is_finite()) {
            let expected = "a finite number of seconds, greater than 0";
            return Err(DynamicsError::Option { option: "time step", found: time_step, expected });
        }
        let states = self.system.states().to_vec();
        self.kept.begin();
        let made = self.in_parts(time_step);
        self.seen.end();
        self.unmark();
        match &made {
            Ok(_) => self.kept.end(),
            Err(_) => {
                self.kept.forget();
                self.system.set_states(states)?;
            }
        }
        made
    }

    fn contacts(&self) -> &[Contact] {
        self.found.as_slice()
    }

    fn forces(&self) -> Option<&Forces> {
        Some(&self.forces)
    }

    fn hidden(&self) -> &[HiddenOverlap] {
        &self.found.hidden
    }
}
