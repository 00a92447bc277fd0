//! Chains on spools hoist a body.
use std::f64::consts::{FRAC_PI_2, PI};

use serde::{Deserialize, Serialize};
use tesdf::glam::{DVec2, DVec3};
use tesdf_sim::criterion::measure::{Checks, Hinge, Penetration, clearance_row, free_body, positive, unit};
use tesdf_sim::criterion::{Criterion, Report, Rows, Tracker};
use tesdf_sim::{Joint, JointKind, MassProperties, System};

use super::linking::linking_number;

/// Chains that are wound on spools hoist a body. The links hold each other by contact alone: of
/// each chain only the first link has a weld, to its spool, and the last one, to the body.
///
/// The penetration is measured by the exact clearance of all pairs, not by the detector of the run.
/// Whether a link has passed through its neighbour is told by the linking number of their centre
/// lines.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HoistCriterion {
    /// Name of the body that is hoisted.
    pub body: String,
    /// Direction of the hoist: a unit vector in the world frame.
    #[serde(default = "up")]
    pub axis: [f64; 3],
    /// The chains.
    pub chains: Vec<HoistChain>,
    /// The links.
    pub link: HoistLink,
    /// Distance from the axis of a spool to the centre line of the wound links that lie flat on it,
    /// m.
    pub winding_radius: f64,
    /// Minimum way by which the body rises, m.
    pub min_rise: f64,
    /// Maximum difference, m, between the rise at the end and the length of chain that the spools
    /// have wound.
    pub rise_tolerance: f64,
    /// Maximum angle by which the body tilts at any step, rad.
    pub max_tilt: f64,
    /// Maximum penetration, m.
    pub max_penetration: f64,
    /// Time between two measurements of the exact clearance, s.
    pub check_every: f64,
}

/// A chain of a [`HoistCriterion`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HoistChain {
    /// The hinge of the spool. Positive angles wind the chain.
    pub spool: String,
    /// The name of the links without their numbers, which begin with 0 at the spool.
    pub links: String,
}

/// The centre line of a link: two straight lines and two half circles in its plane z = 0, long in
/// x.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HoistLink {
    /// Length of the straight lines, m.
    pub straight: f64,
    /// Radius of the half circles, m.
    pub bend_radius: f64,
    /// Distance from link to link in a tight chain, m.
    pub pitch: f64,
}

fn up() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

/// Result of a hoist criterion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HoistReport {
    /// Way by which the body's centre of mass has risen at the end, m.
    pub rise: f64,
    /// The length of chain that the spools have wound at the end, their mean, m.
    pub wound: f64,
    /// The mean angle by which the spools have turned, in turns.
    pub turns: f64,
    /// The greatest tilt of the body, rad.
    pub tilt: f64,
    /// The greatest penetration by the exact clearance, m; 0 when none was found.
    pub penetration: f64,
    /// Number of measurements of the exact clearance.
    pub measurements: usize,
    /// Pairs of neighbours that were not linked at a measurement.
    pub unlinked: usize,
    /// The requirements that the run did not meet; empty when it passed. Each begins with the name
    /// of the failure and a colon: `rise`, `level`, `linking` or `penetration`.
    pub failures: Vec<String>,
}

/// A chain by the numbers of its joint and bodies.
#[derive(Clone, Debug)]
struct Chain {
    spool: Hinge,
    links: Vec<usize>,
}

impl HoistLink {
    /// Number of segments of a half circle.
    const SEGMENTS: usize = 16;

    /// The length of chain that a turn by 1 rad winds, m.
    ///
    /// A link that lies flat touches the drum in its middle, at `radius`. The wires of the links
    /// beside it pull at the ends of its centre line, and between two flat links the chain is
    /// straight.
    fn wound_per_radian(&self, radius: f64) -> f64 {
        let flat = self.straight / 2.0 + self.bend_radius;
        let between = self.pitch - flat;
        let ends = radius.hypot(flat);
        self.pitch / ((flat / radius).atan() + (between / ends).asin())
    }

    /// The corners of the centre line, in the link's frame.
    fn centre_line(&self) -> Vec<DVec3> {
        let half_circle = |side: f64| {
            let corner = move |k: usize| {
                let angle = PI * k as f64 / Self::SEGMENTS as f64 - FRAC_PI_2;
                let end = DVec2::new(self.straight / 2.0, 0.0);
                (side * (end + self.bend_radius * DVec2::from_angle(angle))).extend(0.0)
            };
            (0..=Self::SEGMENTS).map(corner)
        };
        half_circle(1.0).chain(half_circle(-1.0)).collect()
    }
}

impl Criterion for HoistCriterion {
    const NAME: &str = "hoist";
    type Tracker = HoistTracker;

    /// Checks the values, that the bodies and joints exist, and that nothing but the chains holds
    /// the body.
    fn check(&self, system: &System) -> Result<Vec<String>, String> {
        unit(self.axis)?;
        positive([
            ("winding_radius", self.winding_radius),
            ("min_rise", self.min_rise),
            ("rise_tolerance", self.rise_tolerance),
            ("max_tilt", self.max_tilt),
            ("max_penetration", self.max_penetration),
            ("check_every", self.check_every),
            ("link.straight", self.link.straight),
            ("link.bend_radius", self.link.bend_radius),
            ("link.pitch", self.link.pitch),
        ])?;
        let HoistLink { straight, bend_radius, pitch } = self.link;
        if !(pitch > straight / 2.0 + bend_radius && pitch < straight + 2.0 * bend_radius) {
            return Err(format!(
                "link.pitch is {pitch}; expected more than half of the length of the centre line, and less than the length, {}",
                straight + 2.0 * bend_radius
            ));
        }
        self.find(system).map(|_| vec![self.body.clone()])
    }

    fn track(&self, system: &System) -> Result<HoistTracker, String> {
        HoistTracker::new(self, system)
    }
}

impl HoistCriterion {
    /// The chains, when the joints are those of a hoist.
    fn find(&self, system: &System) -> Result<Vec<Chain>, String> {
        if self.chains.is_empty() {
            return Err("chains is empty; expected at least one".into());
        }
        let (body, _) = free_body(system, &self.body, "hoist")?;
        let chains: Vec<Chain> =
            self.chains.iter().map(|chain| chain.find(system, body)).collect::<Result<_, _>>()?;
        let last = |link| chains.iter().any(|chain| chain.links.last() == Some(&link));
        match joints_of(system, body).find(|joint| !last(other(joint, body))) {
            Some(joint) => Err(format!(
                "joint {} holds body {}; only the last links of the chains may, so take it out",
                joint.name, self.body
            )),
            None => Ok(chains),
        }
    }
}

impl HoistChain {
    fn find(&self, system: &System, body: usize) -> Result<Chain, String> {
        let spool = Hinge::new(system, &self.spool)?;
        let link = |k: usize| {
            let name = format!("{}{k}", self.links);
            system.bodies().iter().position(|body| body.name == name)
        };
        let links: Vec<usize> = (0..).map_while(link).collect();
        let [first, .., last] = links[..] else {
            let (count, name) = (links.len(), &self.links);
            return Err(format!("{count} links are named {name}0, {name}1, …; expected at least 2"));
        };
        let ends = [(first, spool.child(system)), (last, body)];
        for &link in &links {
            for joint in joints_of(system, link) {
                let is_end = ends.contains(&(link, other(joint, link)));
                if !is_end || joint.kind != JointKind::Weld {
                    return Err(format!(
                        "joint {} holds link {}; expected welds of the first link to the spool and of the last one to the \
                         body, and no others",
                        joint.name,
                        system.bodies()[link].name
                    ));
                }
            }
        }
        Ok(Chain { spool, links })
    }
}

fn joints_of(system: &System, body: usize) -> impl Iterator<Item = &Joint> {
    system.joints().iter().filter(move |j| j.child == body || j.parent == Some(body))
}

/// The other body of a joint; its child if that is the world.
fn other(joint: &Joint, body: usize) -> usize {
    if joint.child == body { joint.parent.unwrap_or(body) } else { joint.child }
}

/// Records the hoist of a body during a run.
#[derive(Clone, Debug)]
pub struct HoistTracker {
    criterion: HoistCriterion,
    axis: DVec3,
    body: usize,
    mass: MassProperties,
    chains: Vec<Chain>,
    centre_line: Vec<DVec3>,
    /// Position of the centre of mass, and the direction of the axis in the body's frame, at the
    /// beginning.
    start: (DVec3, DVec3),
    /// The angle by which each spool has turned, rad.
    angles: Vec<f64>,
    rise: f64,
    tilt: f64,
    checks: Checks,
    penetration: Penetration,
    unlinked: usize,
}

impl HoistTracker {
    /// A tracker that starts from the current state of `system`.
    ///
    /// # Errors
    /// The same errors as [`HoistCriterion::check`].
    pub fn new(criterion: &HoistCriterion, system: &System) -> Result<Self, String> {
        criterion.check(system)?;
        let (body, mass) = free_body(system, &criterion.body, "hoist")?;
        let chains = criterion.find(system)?;
        let axis = unit(criterion.axis)?;
        let pose = system.states()[body].pose;
        Ok(Self {
            axis,
            body,
            mass,
            centre_line: criterion.link.centre_line(),
            start: (pose.to_world(mass.center), pose.rotation.inverse() * axis),
            angles: vec![0.0; chains.len()],
            chains,
            rise: 0.0,
            tilt: 0.0,
            checks: Checks::new(criterion.check_every),
            penetration: Penetration::default(),
            unlinked: 0,
            criterion: criterion.clone(),
        })
    }

    /// The number of neighbours that do not go once through each other.
    fn unlinked(&self, system: &System, chain: &Chain) -> usize {
        let line = |&link: &usize| {
            let pose = system.states()[link].pose;
            self.centre_line.iter().map(|p| pose.to_world(*p)).collect::<Vec<_>>()
        };
        let lines: Vec<_> = chain.links.iter().map(line).collect();
        let is_linked =
            |pair: &[Vec<DVec3>]| linking_number(&pair[0], &pair[1]).is_some_and(|n| n.abs() == 1);
        lines.windows(2).filter(|pair| !is_linked(pair)).count()
    }
}

impl Tracker for HoistTracker {
    type Report = HoistReport;

    fn observe(&mut self, system: &System, time_step: f64) {
        let pose = system.states()[self.body].pose;
        self.rise = (pose.to_world(self.mass.center) - self.start.0).dot(self.axis);
        self.tilt = self.tilt.max((pose.rotation * self.start.1).angle_between(self.axis));
        for (turned, chain) in self.angles.iter_mut().zip(&mut self.chains) {
            *turned += chain.spool.turned(system, time_step);
        }
        if self.checks.due(time_step) {
            self.penetration.measure_all(system, 1e-2 * self.criterion.max_penetration);
            self.unlinked += self.chains.iter().map(|chain| self.unlinked(system, chain)).sum::<usize>();
        }
    }

    fn report(&self, _: &System) -> HoistReport {
        let HoistCriterion { link, winding_radius, min_rise, rise_tolerance, max_tilt, .. } = self.criterion;
        let angle = self.angles.iter().sum::<f64>() / self.angles.len() as f64;
        let wound = link.wound_per_radian(winding_radius) * angle;
        let mut failures = self.penetration.failures(self.criterion.max_penetration);
        let mut demand = |met: bool, text: String| {
            if !met {
                failures.push(text);
            }
        };
        let Self { rise, tilt, unlinked, .. } = *self;
        demand(rise >= min_rise, format!("rise: {rise:.4} m; expected at least {min_rise:.4} m"));
        demand(
            (rise - wound).abs() <= rise_tolerance,
            format!(
                "rise: {rise:.4} m, but the spools have wound {wound:.4} m; expected them within {rise_tolerance:.1e} m"
            ),
        );
        demand(
            tilt <= max_tilt,
            format!("level: {tilt:.3e} rad of tilt; expected at most {max_tilt:.3e} rad"),
        );
        demand(
            unlinked == 0,
            format!(
                "linking: {unlinked} times two neighbours were not linked; one has passed through the other"
            ),
        );
        HoistReport {
            rise,
            wound,
            turns: angle / (2.0 * PI),
            tilt,
            penetration: self.penetration.depth,
            measurements: self.penetration.measurements,
            unlinked,
            failures,
        }
    }
}

impl Report for HoistReport {
    fn failures(&mut self) -> &mut Vec<String> {
        &mut self.failures
    }

    fn rows(&self) -> Rows {
        let HoistReport { rise, wound, turns, tilt, unlinked, penetration, measurements, .. } = self;
        vec![
            (
                "hoist",
                format!("{:.2} mm, {:.2} mm of chain wound in {turns:.3} turns", 1e3 * rise, 1e3 * wound),
            ),
            ("level", format!("at most {:.3} mrad of tilt", 1e3 * tilt)),
            ("links", format!("{unlinked} times two neighbours were not linked")),
            clearance_row(*penetration, *measurements),
        ]
    }
}
