//! Motions that are checked as a whole.
//!
//! Intervals of a motion are certified by the clearance in their middle and by how far bodies can
//! move from there; others are divided (Schwarzer, Saha and Latombe 2005). `docs/math.md`, section
//! 20, has the proof.
use std::cmp::Ordering;
use std::collections::BinaryHeap;

use serde::Serialize;
use tesdf::collide::{InstanceId, LeastClearanceOptions, Pose, Scene, clearance_bound, least_clearance};

use super::error::PlanningError;
use super::kinematics::Joint;
use super::model::Robot;
use super::reach::way;

/// How motions are checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionOptions {
    /// Clearance to keep, m: a motion is free where the clearance is above this.
    pub margin: f64,
    /// A motion is divided until bodies move by less than this from the middle of an interval, m. It
    /// is undecided only where its clearance is within twice this of the margin, or after
    /// [`steps`](Self::steps).
    pub tolerance: f64,
    /// Largest number of intervals of pairs of bodies that are looked at.
    pub steps: u32,
}

impl Default for MotionOptions {
    /// Without a margin, up to 0.1 mm, in at most 100,000 steps.
    fn default() -> Self {
        Self { margin: 0.0, tolerance: 1e-4, steps: 100_000 }
    }
}

/// What is known of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MotionVerdict {
    /// Certain: nowhere on the motion is the clearance at the margin or below.
    Free,
    /// Certain: the clearance is at the margin or below at a place that is told.
    Collision,
    /// Not known. At the place that is told, the clearance is above the margin by less than twice
    /// the tolerance, or the steps were used up there.
    Undecided,
}

/// The result of the check of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MotionCheck {
    /// What is known.
    pub verdict: MotionVerdict,
    /// Where it is in collision, or undecided; `None` of a free motion.
    pub at: Option<MotionPlace>,
    /// Number of intervals of pairs of bodies that were looked at.
    pub steps: u32,
}

/// A place of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MotionPlace {
    /// From 0 at the start to 1 at the end.
    pub parameter: f64,
    /// The numbers of the bodies, lower one first.
    pub bodies: [usize; 2],
    /// Their signed distance there, m, as far as it was searched: the true one is not greater by more
    /// than rounding.
    pub distance: f64,
}

/// An interval of the motion of a pair.
struct Interval {
    /// Lower bound of the clearance, as far as it is known.
    bound: f64,
    serial: u64,
    pair: usize,
    low: f64,
    high: f64,
}

impl PartialEq for Interval {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Interval {}
impl PartialOrd for Interval {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Interval {
    fn cmp(&self, other: &Self) -> Ordering {
        // The heap returns its greatest element first.
        other.bound.total_cmp(&self.bound).then(other.serial.cmp(&self.serial))
    }
}

/// What an interval has become.
enum Looked {
    Free,
    At(MotionVerdict, MotionPlace),
    /// Between these it is free, and nowhere else is the clearance below the bound.
    Divided([f64; 2], f64),
}

/// A rough bound of the clearance is enough to divide an interval where it is this share of what would
/// free the whole.
const ROUGH: f64 = 0.1;

/// Rounding of poses and distances, as a share of the distances of joints and bodies.
const ROUNDING: f64 = 1e-12;

impl Robot {
    /// Checks the straight line between two configurations: whether the clearance is above the margin
    /// everywhere on it. Coordinates are not wrapped: a joint that turns without limits goes from the
    /// one number to the other.
    ///
    /// # Errors
    /// A configuration that is not one, options out of range, or bodies too far out.
    pub fn check_motion(
        &self,
        from: &[f64],
        to: &[f64],
        options: &MotionOptions,
    ) -> Result<MotionCheck, PlanningError> {
        self.check_motion_in(&mut self.scene.clone(), from, to, options)
    }

    /// Checks many motions, as [`check_motion`](Self::check_motion), on all threads of the current
    /// rayon pool.
    ///
    /// # Errors
    /// That of the first row that has one, with its number.
    pub fn check_motions<Q: AsRef<[f64]> + Sync>(
        &self,
        rows: &[[Q; 2]],
        options: &MotionOptions,
    ) -> Result<Vec<MotionCheck>, PlanningError> {
        self.of_rows(rows, |scene, [from, to]| {
            self.check_motion_in(scene, from.as_ref(), to.as_ref(), options)
        })
    }

    fn check_motion_in(
        &self,
        scene: &mut Scene,
        from: &[f64],
        to: &[f64],
        options: &MotionOptions,
    ) -> Result<MotionCheck, PlanningError> {
        self.check(from)?;
        self.check(to)?;
        let MotionOptions { margin, tolerance, .. } = *options;
        if !margin.is_finite() {
            return Err(PlanningError::Argument(format!("margin: {margin}; expected a finite length, m")));
        }
        if !(tolerance > 0.0 && tolerance.is_finite()) {
            let found = format!("tolerance: {tolerance}");
            return Err(PlanningError::Argument(format!("{found}; expected a finite length above 0, m")));
        }
        Checked::new(self, scene, [from, to], options)?.run()
    }
}

/// A motion that is being checked.
struct Checked<'a> {
    robot: &'a Robot,
    scene: &'a mut Scene,
    from: &'a [f64],
    to: &'a [f64],
    options: &'a MotionOptions,
    /// How far the coordinate of each joint goes.
    ways: Vec<f64>,
    pairs: Vec<MovingPair<'a>>,
    /// The last parameter, and the poses of the links there.
    poses: (f64, Vec<Pose>),
    open: BinaryHeap<Interval>,
    added: u64,
}

/// A pair of bodies that move against each other.
struct MovingPair<'a> {
    /// The parts of links that they are, by their numbers, and the joints of each that the other one
    /// does not have.
    parts: [Option<(usize, &'a [usize])>; 2],
    /// The largest coordinate of a body that is no part of a link.
    coordinate: f64,
}

impl<'a> Checked<'a> {
    fn new(
        robot: &'a Robot,
        scene: &'a mut Scene,
        [from, to]: [&'a [f64]; 2],
        options: &'a MotionOptions,
    ) -> Result<Self, PlanningError> {
        let way = |joint: &Joint| (joint.ratio * (to[joint.of] - from[joint.of])).abs();
        let ways = robot.chain.joints.iter().map(way).collect();
        let pair = |(ids, bodies): (&[InstanceId; 2], &[usize; 2])| {
            let above = bodies.map(|body| robot.above(body));
            let common = above[0].iter().zip(above[1]).take_while(|(a, b)| a == b).count();
            let mut pair = MovingPair { parts: [None; 2], coordinate: 0.0 };
            for k in 0..2 {
                match robot.parts.binary_search_by_key(&ids[k], |part| part.instance) {
                    Ok(part) => pair.parts[k] = Some((part, &above[k][common..])),
                    Err(_) => {
                        let bounds = scene.bounds(ids[k])?;
                        let most = bounds.min.abs().max(bounds.max.abs()).max_element();
                        pair.coordinate = if most.is_finite() { most } else { 0.0 };
                    }
                }
            }
            Ok(pair)
        };
        let pairs = robot.pairs.iter().zip(&robot.bodies_of_pairs).map(pair);
        let pairs = pairs.collect::<Result<_, PlanningError>>()?;
        let (open, poses) = (BinaryHeap::new(), (f64::NAN, Vec::new()));
        Ok(Self { robot, scene, from, to, options, ways, pairs, poses, open, added: 0 })
    }

    fn run(mut self) -> Result<MotionCheck, PlanningError> {
        for end in [0.0, 1.0] {
            if let Some(at) = self.end(end)? {
                return Ok(MotionCheck { verdict: MotionVerdict::Collision, at: Some(at), steps: 0 });
            }
        }
        for pair in 0..self.pairs.len() {
            self.push(f64::NEG_INFINITY, pair, 0.0, 1.0);
        }
        let mut steps = 0;
        while let Some(Interval { pair, low, high, .. }) = self.open.pop() {
            steps += 1;
            match self.look(pair, low, high, steps >= self.options.steps)? {
                Looked::Free => {}
                Looked::At(verdict, at) => return Ok(MotionCheck { verdict, at: Some(at), steps }),
                Looked::Divided([end, begin], bound) => {
                    self.push(bound, pair, low, end);
                    self.push(bound, pair, begin, high);
                }
            }
        }
        Ok(MotionCheck { verdict: MotionVerdict::Free, at: None, steps })
    }

    fn push(&mut self, bound: f64, pair: usize, low: f64, high: f64) {
        self.added += 1;
        self.open.push(Interval { bound, serial: self.added, pair, low, high });
    }

    /// Moves the links to where they are at a parameter.
    fn place(&mut self, t: f64) -> Result<(), PlanningError> {
        if self.poses.0 != t {
            let between = |(a, b): (&f64, &f64)| if t == 1.0 { *b } else { a + t * (b - a) };
            let q: Vec<f64> = self.from.iter().zip(self.to).map(between).collect();
            self.poses = (t, self.robot.chain.poses(&q));
            self.robot.place(self.scene, &self.poses.1)?;
        }
        Ok(())
    }

    /// The place of a collision at a parameter, if there is one.
    fn end(&mut self, t: f64) -> Result<Option<MotionPlace>, PlanningError> {
        self.place(t)?;
        let (margin, tolerance) = (self.options.margin, 0.25 * self.options.tolerance);
        let options = LeastClearanceOptions { below: margin + tolerance, enough: margin, tolerance };
        let found = least_clearance(self.scene, &self.robot.pairs, &options)?.nearest;
        let found = found.filter(|(_, clearance)| clearance.distance <= margin);
        Ok(found.map(|(pair, clearance)| self.told(pair, t, clearance.distance)))
    }

    fn told(&self, pair: usize, parameter: f64, distance: f64) -> MotionPlace {
        MotionPlace { parameter, bodies: self.robot.bodies_of_pairs[pair], distance }
    }

    /// Looks at an interval of the motion of a pair. The last one is not divided.
    fn look(&mut self, pair: usize, low: f64, high: f64, is_last: bool) -> Result<Looked, PlanningError> {
        let middle = 0.5 * (low + high);
        self.place(middle)?;
        let half = (middle - low).max(high - middle);
        let MotionOptions { margin, tolerance, .. } = *self.options;
        let Self { robot, poses: (_, poses), ways, .. } = self;
        let MovingPair { parts, coordinate } = &self.pairs[pair];
        // How far points of the two bodies can come nearer to each other.
        let (mut reach, mut largest) = (0.0, *coordinate);
        for &(part, joints) in parts.iter().flatten() {
            let part = &robot.parts[part];
            let hull = part.hull.placed(poses[part.link]);
            reach += way(&robot.chain, poses, joints, &hull, |joint| half * ways[joint]);
            largest = largest.max(hull.greatest(|p| p.length()));
        }
        let rounding = ROUNDING * (largest + reach);
        let needed = margin + reach + rounding;
        let [a, b] = robot.pairs[pair];
        let rough = clearance_bound(self.scene, a, b, needed)?;
        if rough >= needed {
            return Ok(Looked::Free);
        }
        let divided = |bound: f64| {
            let free = half * ((bound - margin - rounding) / reach).max(0.0) * (1.0 - 1e-9);
            Ok(Looked::Divided([middle - free, middle + free], bound - reach))
        };
        if rough - margin > ROUGH * reach && !is_last {
            return divided(rough);
        }
        let slack = 0.25 * reach.max(tolerance);
        let options = LeastClearanceOptions { below: needed + slack, enough: margin, tolerance: slack };
        let found = least_clearance(self.scene, &robot.pairs[pair..=pair], &options)?;
        let lower = found.lower_bound;
        let distance = found.nearest.map_or(f64::INFINITY, |(_, clearance)| clearance.distance);
        if found.nearest.is_some() && distance <= margin {
            return Ok(Looked::At(MotionVerdict::Collision, self.told(pair, middle, distance)));
        }
        if lower >= needed - 0.5 * rounding {
            return Ok(Looked::Free);
        }
        if reach <= tolerance || is_last {
            return Ok(Looked::At(MotionVerdict::Undecided, self.told(pair, middle, distance)));
        }
        divided(lower)
    }
}
