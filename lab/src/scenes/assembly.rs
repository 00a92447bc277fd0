//! Pegs are in their holes and nuts on their bolts, held by contact alone.
use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};
use tesdf::collide::{InstanceId, Pose};
use tesdf::glam::DVec3;
use tesdf_sim::criterion::measure::{
    Checks, Penetration, body, clearance_row, free_body, least_distance, near, positive, relative, wrapped,
};
use tesdf_sim::criterion::{Criterion, Report, Rows, Tracker};
use tesdf_sim::{Joint, Mass, System};

/// Free parts that begin elsewhere end in their places: pegs in holes, nuts on bolts.
///
/// No joint, script or wrench may act on a part. The penetration of each part is measured by the
/// exact clearance to all bodies near it, not by the detector of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AssemblyCriterion {
    /// Pegs and their holes.
    #[serde(default)]
    pub pegs: Vec<PegGroup>,
    /// Nuts and their bolts.
    #[serde(default)]
    pub nuts: Vec<NutGroup>,
    /// Maximum penetration of a part, as a fraction of its clearance.
    #[serde(default = "a_tenth")]
    pub max_penetration: f64,
    /// Maximum speed of the origin of a part at the end, m/s.
    #[serde(default = "at_rest")]
    pub max_speed: f64,
    /// Minimum distance at the end between a part and each moving body that is no part, m.
    #[serde(default = "let_go")]
    pub min_release: f64,
    /// Time between two measurements of the exact clearance, s.
    pub check_every: f64,
}

fn a_tenth() -> f64 {
    0.1
}

/// A nut of 0.1 mm/s takes a minute for three pitches.
fn at_rest() -> f64 {
    1e-4
}

fn let_go() -> f64 {
    1e-3
}

/// Pegs with numbers, `peg0`, `peg1`, …, and the hole of each, `hole0`, `hole1`, …
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PegGroup {
    /// Names of the pegs, without their numbers.
    pub parts: String,
    /// Names of the holes, without their numbers.
    pub into: String,
    /// Number of pegs.
    pub count: usize,
    /// Origin of a seated peg in the frame of its hole, m.
    pub seat: [f64; 3],
    /// Length of a seated peg in its hole, along the z axis of the hole, m.
    pub depth: f64,
    /// Clearance between peg and hole, m.
    pub clearance: f64,
}

/// Nuts with numbers, and the bolt of each. The z axes of a nut and its bolt agree, and the tip of
/// the bolt is at its z = 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NutGroup {
    /// Names of the nuts, without their numbers.
    pub parts: String,
    /// Names of the bolts, without their numbers.
    pub onto: String,
    /// Number of nuts.
    pub count: usize,
    /// Height of a nut, m.
    pub height: f64,
    /// Pitch of the thread, m.
    pub pitch: f64,
    /// Clearance of the threads in radius, m.
    pub clearance: f64,
    /// Way that a nut may move along the axis without turning, m.
    pub backlash: f64,
    /// Minimum number of turns of a nut after it has come one pitch over the tip.
    pub min_turns: f64,
}

/// Result of an assembly criterion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AssemblyReport {
    /// Number of parts that are in their places.
    pub assembled: usize,
    /// The parts: pegs, then nuts.
    pub parts: Vec<PartReport>,
    /// The greatest penetration by the exact clearance, m; 0 when none was found.
    pub penetration: f64,
    /// Number of measurements of the exact clearance of a part.
    pub measurements: usize,
    /// The requirements that the run did not meet; empty when it passed. Each begins with the name
    /// of the failure and a colon: `depth`, `offset`, `tilt`, `turns`, `thread`, `rest`, `release`,
    /// `held` or
    /// `penetration`.
    pub failures: Vec<String>,
}

/// Where a part is at the end.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartReport {
    /// Name of the part.
    pub name: String,
    /// Height of a peg above its seat, or length of a bolt in its nut, m.
    pub depth: f64,
    /// Distance of the origin from the axis of hole or bolt, m.
    pub offset: f64,
    /// Angle between the two axes, rad.
    pub tilt: f64,
    /// Turns of a nut after it has come one pitch over the tip.
    pub turns: Option<f64>,
    /// The range of travel minus turns × pitch in this time, m.
    pub pitch_error: Option<f64>,
}

impl Criterion for AssemblyCriterion {
    const NAME: &str = "assembly";
    type Tracker = AssemblyTracker;

    /// Checks the values, that the bodies exist, that no joint holds a part, and that no part
    /// starts in its place. Returns the names of the parts.
    fn check(&self, system: &System) -> Result<Vec<String>, String> {
        positive([
            ("max_penetration", self.max_penetration),
            ("max_speed", self.max_speed),
            ("min_release", self.min_release),
            ("check_every", self.check_every),
        ])?;
        let parts = self.find(system)?;
        for part in &parts {
            let holds = |joint: &&Joint| joint.child == part.body || joint.parent == Some(part.body);
            if let Some(joint) = system.joints().iter().find(holds) {
                return Err(format!(
                    "joint {} holds body {}; only contacts may, so take it out",
                    joint.name, part.name
                ));
            }
            if part.kind.is_in(part.seen(system)) {
                return Err(format!("body {} starts in its place; place it elsewhere", part.name));
            }
        }
        Ok(parts.into_iter().map(|part| part.name).collect())
    }

    fn track(&self, system: &System) -> Result<AssemblyTracker, String> {
        AssemblyTracker::new(self, system)
    }
}

impl AssemblyCriterion {
    fn find(&self, system: &System) -> Result<Vec<Part>, String> {
        let pegs = self.pegs.iter().map(|group| {
            let seat = DVec3::from_array(group.seat);
            if !seat.is_finite() {
                return Err(format!("pegs: seat is {seat}; expected finite numbers"));
            }
            let kind = Kind::Peg { seat, depth: group.depth };
            let values = [("pegs: depth", group.depth), ("pegs: clearance", group.clearance)];
            positive(values)?;
            Part::group(system, [&group.parts, &group.into], group.count, kind, group.clearance)
        });
        let nuts = self.nuts.iter().map(|group| {
            let NutGroup { height, pitch, clearance, backlash, min_turns, .. } = *group;
            positive([
                ("nuts: height", height),
                ("nuts: pitch", pitch),
                ("nuts: clearance", clearance),
                ("nuts: backlash", backlash),
                ("nuts: min_turns", min_turns),
            ])?;
            let kind = Kind::Nut { height, pitch, backlash, min_turns };
            Part::group(system, [&group.parts, &group.onto], group.count, kind, clearance)
        });
        let parts = pegs.chain(nuts).collect::<Result<Vec<_>, String>>()?.concat();
        match parts.is_empty() {
            true => Err("there are neither pegs nor nuts; name at least one group".into()),
            false => Ok(parts),
        }
    }
}

/// A part and its place.
#[derive(Clone, Debug)]
struct Part {
    name: String,
    body: usize,
    instance: InstanceId,
    /// The number of the hole or bolt.
    place: usize,
    clearance: f64,
    kind: Kind,
    penetration: Penetration,
    /// Of a nut that has come one pitch over the tip.
    threaded: Option<Threaded>,
    /// Whether a wrench acted on it.
    pushed: bool,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    Peg { seat: DVec3, depth: f64 },
    Nut { height: f64, pitch: f64, backlash: f64, min_turns: f64 },
}

/// How a nut has turned since it came one pitch over the tip.
#[derive(Clone, Copy, Debug)]
struct Threaded {
    /// Height at the beginning, m, and angle at the last step, rad.
    start: f64,
    last: f64,
    /// Rad.
    turned: f64,
    /// Least and greatest travel minus turns × pitch, m.
    error: [f64; 2],
}

impl Kind {
    /// Whether a part that its place sees here is at least partly in it.
    fn is_in(self, seen: Pose) -> bool {
        let at = seen.translation;
        match self {
            Self::Peg { seat, depth } => {
                let way = at - seat;
                way.truncate().length() < depth && way.z.abs() < depth
            }
            Self::Nut { height, .. } => at.truncate().length() < height && at.z > -height,
        }
    }
}

impl Part {
    fn group(
        system: &System,
        [parts, places]: [&String; 2],
        count: usize,
        kind: Kind,
        clearance: f64,
    ) -> Result<Vec<Self>, String> {
        if count == 0 {
            return Err(format!("count of {parts} is 0; expected at least 1"));
        }
        let part = |k: usize| {
            let name = format!("{parts}{k}");
            let (number, _) = free_body(system, &name, "hold")?;
            let place = body(system, &format!("{places}{k}"))?;
            Ok(Self {
                name,
                body: number,
                instance: system.bodies()[number].instance,
                place,
                clearance,
                kind,
                penetration: Penetration::default(),
                threaded: None,
                pushed: false,
            })
        };
        (0..count).map(part).collect()
    }

    /// The part in the frame of its place.
    fn seen(&self, system: &System) -> Pose {
        relative(system.states()[self.place].pose, system.states()[self.body].pose)
    }

    fn observe(&mut self, system: &System) {
        let wrench = system.wrenches()[self.body];
        self.pushed |= wrench.force != DVec3::ZERO || wrench.torque != DVec3::ZERO;
        let Kind::Nut { height, pitch, .. } = self.kind else { return };
        let seen = self.seen(system);
        let z = seen.translation.z;
        let is_on = z + height >= pitch && seen.translation.truncate().length() < height;
        if !is_on {
            self.threaded = None;
            return;
        }
        let x = seen.rotation * DVec3::X;
        let angle = x.y.atan2(x.x);
        let begin = Threaded { start: z, last: angle, turned: 0.0, error: [0.0; 2] };
        let found = self.threaded.get_or_insert(begin);
        found.turned += wrapped(angle - found.last);
        found.last = angle;
        let error = z - found.start - pitch * found.turned / TAU;
        found.error = [found.error[0].min(error), found.error[1].max(error)];
    }

    fn report(&self, system: &System) -> PartReport {
        let seen = self.seen(system);
        let depth = match self.kind {
            Kind::Peg { seat, .. } => seen.translation.z - seat.z,
            Kind::Nut { height, .. } => seen.translation.z + height,
        };
        let origin = match self.kind {
            Kind::Peg { seat, .. } => seat,
            Kind::Nut { .. } => DVec3::ZERO,
        };
        let axis = seen.rotation * DVec3::Z;
        PartReport {
            name: self.name.clone(),
            depth,
            offset: (seen.translation - origin).truncate().length(),
            tilt: axis.cross(DVec3::Z).length().atan2(axis.z),
            turns: self.threaded.map(|found| found.turned / TAU),
            pitch_error: self.threaded.map(|found| found.error[1] - found.error[0]),
        }
    }

    /// What keeps the part from being in its place.
    fn misplaced(&self, system: &System) -> Vec<String> {
        let PartReport { name, depth, offset, tilt, turns, pitch_error } = self.report(system);
        let clearance = self.clearance;
        let mut failures = Vec::new();
        let mut demand = |met: bool, text: String| {
            if !met {
                failures.push(text);
            }
        };
        // A part whose origin is at one end tilts by twice the clearance over the length that is
        // guided.
        let (length, allowed) = match self.kind {
            Kind::Peg { depth: guided, .. } => {
                demand(
                    depth.abs() <= clearance,
                    format!(
                        "depth: {name} is {depth:.3e} m above its seat; expected at most {clearance:.3e} m"
                    ),
                );
                // A peg that is no cylinder has more room where it turns within its clearance.
                (guided, 2.0 * clearance)
            }
            Kind::Nut { height, pitch, backlash, min_turns } => {
                let found = turns.unwrap_or(0.0);
                demand(
                    found >= min_turns,
                    format!(
                        "turns: {name} has made {found:.3} turns on its thread; expected at least {min_turns}"
                    ),
                );
                let error = pitch_error.unwrap_or(0.0);
                demand(
                    error <= backlash,
                    format!(
                        "thread: travel and turns × pitch of {name} differ by up to {error:.3e} m; expected at most \
                         {backlash:.3e} m"
                    ),
                );
                // The origin may be this far from the middle of the thread that guides the nut.
                let guided = depth.clamp(pitch, height);
                (guided, clearance * (1.0 + 2.0 * height / guided))
            }
        };
        let most = 2.0 * clearance / length;
        demand(
            offset <= allowed,
            format!("offset: {name} is {offset:.3e} m off the axis; expected at most {allowed:.3e} m"),
        );
        demand(
            tilt <= most,
            format!("tilt: {name} leans by {tilt:.3e} rad; expected at most {most:.3e} rad"),
        );
        failures
    }
}

/// Records where the parts are during a run.
#[derive(Clone, Debug)]
pub struct AssemblyTracker {
    criterion: AssemblyCriterion,
    parts: Vec<Part>,
    checks: Checks,
}

impl AssemblyTracker {
    /// A tracker that starts from the current state of `system`.
    ///
    /// # Errors
    /// The same errors as [`AssemblyCriterion::check`].
    pub fn new(criterion: &AssemblyCriterion, system: &System) -> Result<Self, String> {
        criterion.check(system)?;
        let (parts, checks) = (criterion.find(system)?, Checks::new(criterion.check_every));
        Ok(Self { criterion: criterion.clone(), parts, checks })
    }

    /// The parts that are too near to a moving body that is no part.
    fn still_held(&self, system: &System) -> Vec<String> {
        let least = self.criterion.min_release;
        let pairs = match near(system, least) {
            Ok(pairs) => pairs,
            Err(reason) => return vec![format!("release: not measured: {reason}")],
        };
        let is_part = |instance: InstanceId| self.parts.iter().any(|part| part.instance == instance);
        let bodies = system.bodies();
        let moving =
            bodies.iter().filter(|body| !matches!(body.mass, Mass::Fixed) && !is_part(body.instance));
        let mut failures = Vec::new();
        for holder in moving {
            for part in &self.parts {
                let both = [part.instance, holder.instance];
                let pair = pairs.iter().find(|pair| both.iter().all(|instance| pair.contains(instance)));
                let Some(&pair) = pair else { continue };
                let (name, holder) = (&part.name, &holder.name);
                match least_distance(system, &[pair], 1e-2 * least) {
                    Ok(distance) if distance >= least => {}
                    Ok(distance) => failures.push(format!(
                        "release: {holder} is {distance:.3e} m from {name} at the end; expected at least {least:.3e} m"
                    )),
                    Err(reason) => failures.push(format!("release: {holder} and {name}: not measured: {reason}")),
                }
            }
        }
        failures
    }
}

impl Tracker for AssemblyTracker {
    type Report = AssemblyReport;

    fn observe(&mut self, system: &System, time_step: f64) {
        let is_due = self.checks.due(time_step);
        let near = is_due.then(|| near(system, 0.0));
        for part in &mut self.parts {
            part.observe(system);
            let allowed = self.criterion.max_penetration * part.clearance;
            match &near {
                Some(Ok(pairs)) => {
                    let own: Vec<_> =
                        pairs.iter().copied().filter(|pair| pair.contains(&part.instance)).collect();
                    part.penetration.measure(system, &own, 1e-2 * allowed);
                }
                Some(Err(reason)) => part.penetration.unmeasured.push(reason.clone()),
                None => {}
            }
        }
    }

    fn report(&self, system: &System) -> AssemblyReport {
        let mut failures = Vec::new();
        let mut assembled = 0;
        for part in &self.parts {
            let misplaced = part.misplaced(system);
            assembled += usize::from(misplaced.is_empty());
            failures.extend(misplaced);
        }
        let AssemblyCriterion { max_speed, max_penetration, .. } = self.criterion;
        for part in &self.parts {
            let speed = system.states()[part.body].linear.length();
            if speed > max_speed {
                let name = &part.name;
                failures.push(format!(
                    "rest: {name} moves at {speed:.3e} m/s; expected at most {max_speed:.3e} m/s"
                ));
            }
            if part.pushed {
                failures.push(format!("held: a wrench acted on {}; only contacts may", part.name));
            }
        }
        failures.extend(self.still_held(system));
        for part in &self.parts {
            let found = part.penetration.failures(max_penetration * part.clearance);
            failures.extend(found.into_iter().map(|reason| format!("{reason} ({})", part.name)));
        }
        AssemblyReport {
            assembled,
            parts: self.parts.iter().map(|part| part.report(system)).collect(),
            penetration: self.parts.iter().map(|part| part.penetration.depth).fold(0.0, f64::max),
            measurements: self.parts.iter().map(|part| part.penetration.measurements).sum(),
            failures,
        }
    }
}

impl Report for AssemblyReport {
    fn failures(&mut self) -> &mut Vec<String> {
        &mut self.failures
    }

    fn rows(&self) -> Rows {
        let AssemblyReport { assembled, parts, penetration, measurements, .. } = self;
        let mut rows = vec![("assembled", format!("{assembled} of {} parts", parts.len()))];
        rows.extend(parts.iter().map(|part| {
            let place = format!(
                "{}: {:.1} µm off the axis, {:.2} mrad of tilt",
                part.name,
                1e6 * part.offset,
                1e3 * part.tilt
            );
            let more = match (part.turns, part.pitch_error) {
                (Some(turns), Some(error)) => {
                    format!("{turns:.3} turns, {:.1} µm between travel and turns × pitch", 1e6 * error)
                }
                _ => format!("{:.1} µm above its place", 1e6 * part.depth),
            };
            ("part", format!("{place}, {more}"))
        }));
        rows.push(clearance_row(*penetration, *measurements));
        rows
    }
}
