//! A planner of grasps and assemblies: tasks of grippers become keyframes of scripts.
//!
//! A gripper is a kinematic wrist, and fingers on joints whose motors have a velocity as target. It
//! moves upright. For each task it opens, moves above the part, descends, closes, lifts the part,
//! carries it above its place, descends, inserts or screws it, opens, and rises. At the end it
//! returns to where it started:
//!
//! ```text
//! open ─▶ above part ─▶ grasp ─▶ close ─▶ lift ─▶ above place ─▶ approach ─▶ insert ─▶ open ─▶ rise
//! ```
//!
//! The planner knows where parts start and where they belong. It does not see the run: a part that
//! slips or falls is missed. So scripts stay functions of time alone.
use std::f64::consts::TAU;
use std::fmt::Display;
use std::path::Path;

use serde::{Deserialize, Serialize};
use tesdf::collide::Pose;
use tesdf::glam::{DQuat, DVec3};
use tesdf_cli::terminal::report::Failure;
use tesdf_sim::criterion::measure::{positive, relative, rotation_between};
use tesdf_sim::scene_file::SceneFile;
use tesdf_sim::script::{Interpolation, Keyframe, Script};

/// The shortest time of a motion, s.
const SHORTEST: f64 = 0.05;

/// The way above a part or its place on which a gripper descends slowly, m.
const NEAR: f64 = 0.01;

/// Grippers, and what they do: the content of a plan's file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// The grippers. They work at the same time, each in its own order.
    pub grippers: Vec<Gripper>,
    /// The tasks, in the order in which each gripper does its own.
    pub tasks: Vec<Task>,
}

/// A gripper, and how it moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gripper {
    /// Name, unique among the grippers.
    pub name: String,
    /// Name of the wrist, a kinematic body.
    pub wrist: String,
    /// Names of the joints of the fingers, with motors whose drive is a velocity.
    pub fingers: Vec<String>,
    /// The point between the tips of the fingers, in the frame of the wrist, m.
    pub tool: [f64; 3],
    /// Target of the motors that opens the fingers, m/s.
    pub open: f64,
    /// Target of the motors while the fingers close, m/s.
    pub close: f64,
    /// Target of the motors once the fingers have closed, m/s. Equal pushes leave a grip free to
    /// move sideways, by no more than this.
    pub hold: f64,
    /// Target of the motors while the gripper screws, m/s. A finger at the distance r from the axis
    /// of a tool that turns by ω leaves the part by r ω² h / 2 a second in steps of h, and must
    /// come after.
    pub follow: f64,
    /// Time for the fingers to close or open, s.
    #[serde(default = "half_a_second")]
    pub grasp_time: f64,
    /// Height of the tool in the world while the gripper travels, m.
    pub travel_height: f64,
    /// Mean speed between two points, m/s.
    #[serde(default = "fast")]
    pub speed: f64,
    /// Mean speed near a part or its place, m/s.
    #[serde(default = "slow")]
    pub approach_speed: f64,
    /// Mean angular speed between two points, rad/s.
    #[serde(default = "a_radian")]
    pub turn_speed: f64,
    /// Mean angular speed while it screws, rad/s.
    #[serde(default = "a_turn")]
    pub screw_speed: f64,
}

fn half_a_second() -> f64 {
    0.5
}

fn fast() -> f64 {
    0.2
}

fn slow() -> f64 {
    0.03
}

fn a_radian() -> f64 {
    1.0
}

fn a_turn() -> f64 {
    TAU
}

/// A part that a gripper brings to its place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Task {
    /// Name of the gripper.
    pub gripper: String,
    /// Name of the body that it brings.
    pub part: String,
    /// Where the tool holds the part: from the part's origin, m, world axes, with the part where it
    /// starts.
    pub grasp: [f64; 3],
    /// Angle of the tool about the vertical when it grasps, relative to where it starts, rad.
    #[serde(default)]
    pub grasp_angle: f64,
    /// Name of the body that it brings the part to.
    pub into: String,
    /// Origin of the part in the frame of that body, once it is in its place, m. Its axes are those
    /// of the body, turned about z by what a thread demands.
    pub seat: [f64; 3],
    /// The way, from above, along which the part is inserted or screwed, m.
    pub approach: f64,
    /// Distance by which the tool goes deeper than the part's place, m. It loads a gripper that
    /// gives way.
    #[serde(default)]
    pub press: f64,
    /// What the gripper does on this way.
    #[serde(default)]
    pub action: Action,
}

/// What a gripper does with a part above its place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Action {
    /// It moves it straight down.
    #[default]
    Insert,
    /// It turns it, so that it follows a right-handed thread. Where the part's frame is that of the
    /// other body, the threads fit.
    Screw {
        /// The pitch of the thread, m.
        pitch: f64,
    },
}

impl Plan {
    /// Reads a file, TOML.
    ///
    /// # Errors
    /// The file cannot be read, or is no plan.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let named = |e: &dyn Display| Failure::new(format!("{}: {e}", path.display()));
        let text = tesdf::input::read_to_string(path).map_err(|e| named(&e))?;
        toml::from_str(&text).map_err(|e| named(&e.to_string().trim_end()))
    }

    /// The scripts that do the tasks with the bodies of `scene`.
    ///
    /// # Errors
    /// A message that names the gripper or task, what was found and what was expected.
    pub fn scripts(&self, scene: &SceneFile) -> Result<Vec<Script>, String> {
        let start = |name: &str| start(scene, name);
        let duration = scene.duration;
        let mut arms: Vec<Arm> = Vec::new();
        for gripper in &self.grippers {
            if arms.iter().any(|arm| arm.gripper.name == gripper.name) {
                return Err(format!("gripper {}: the name is used twice; give each its own", gripper.name));
            }
            arms.push(Arm::new(gripper, &start).map_err(|e| format!("gripper {}: {e}", gripper.name))?);
        }
        for (k, task) in self.tasks.iter().enumerate() {
            let at = |reason: String| format!("task {} ({}): {reason}", k + 1, task.part);
            let arm = arms.iter_mut().find(|arm| arm.gripper.name == task.gripper);
            let arm = arm.ok_or_else(|| at(format!("there is no gripper {}", task.gripper)))?;
            arm.perform(task, &start).map_err(at)?;
        }
        arms.iter_mut().for_each(Arm::go_home);
        let last = arms.iter().map(|arm| arm.time).fold(0.0, f64::max);
        if last > duration {
            return Err(format!("the tasks take {last:.3} s; expected at most the duration of {duration} s"));
        }
        Ok(arms.into_iter().flat_map(Arm::into_scripts).collect())
    }
}

/// Where a body starts.
fn start(scene: &SceneFile, name: &str) -> Result<Pose, String> {
    let mut bodies = scene.bodies.iter().map(|body| body.get_ref());
    let body = bodies.find(|body| body.name == name);
    let body = body.ok_or_else(|| format!("there is no body {name}; give the name of a body"))?;
    let (translation, rotation) = (DVec3::from_array(body.translation), DQuat::from_array(body.rotation));
    Pose::new(translation, rotation).map_err(|e| format!("body {name}: {e}"))
}

/// Poses of the tool in a task.
struct Route {
    /// Where it grasps the part.
    grasp: Pose,
    /// Where the part begins to go in, above its place.
    begin: Pose,
    /// Where the part is in its place.
    end: Pose,
    /// Angle by which it turns clockwise from the begin to the end, seen from above, rad.
    turn: f64,
}

impl Route {
    /// The route of a part that starts at `part` to a place in `into`, for a tool of this
    /// orientation.
    fn new(task: &Task, part: Pose, into: Pose, upright: DQuat) -> Result<Self, String> {
        positive([("approach", task.approach)])?;
        let seat = DVec3::from_array(task.seat);
        // A part with a thread is turned counter-clockwise by a pitch a turn where it is higher.
        let (phase, turn) = match task.action {
            Action::Insert => (0.0, 0.0),
            Action::Screw { pitch } => {
                positive([("pitch", pitch)])?;
                (TAU * seat.z / pitch, TAU * task.approach / pitch)
            }
        };
        let grasp = Pose {
            translation: part.translation + DVec3::from_array(task.grasp),
            rotation: (DQuat::from_rotation_z(task.grasp_angle) * upright).normalize(),
        };
        // The tool as the part sees it, as long as it holds the part.
        let held = relative(part, grasp);
        let axes = into.rotation * DQuat::from_rotation_z(phase);
        let placed = Pose { translation: into.to_world(seat), rotation: axes.normalize() };
        let tool = placed.to_world(held.translation);
        // The origin of the part stays on the axis; that of the tool may be off it.
        let about = DQuat::from_rotation_z(turn);
        let rotation = (placed.rotation * held.rotation).normalize();
        let begin = Pose {
            translation: placed.translation + about * (tool - placed.translation) + DVec3::Z * task.approach,
            rotation: (about * rotation).normalize(),
        };
        let end = Pose { translation: tool - DVec3::Z * task.press, rotation };
        if [grasp, begin, end].iter().any(|pose| !pose.translation.is_finite() || !pose.rotation.is_finite())
        {
            return Err(format!(
                "grasp {:?} m, grasp_angle {} rad, seat {:?} m, press {} m; expected finite numbers",
                task.grasp, task.grasp_angle, task.seat, task.press
            ));
        }
        Ok(Self { grasp, begin, end, turn })
    }
}

/// A gripper while its tasks are planned.
struct Arm<'a> {
    gripper: &'a Gripper,
    /// Where the tool starts and ends.
    home: Pose,
    tool: Pose,
    time: f64,
    wrist: Vec<Keyframe>,
    fingers: Vec<Keyframe>,
}

impl<'a> Arm<'a> {
    fn new(gripper: &'a Gripper, start: &impl Fn(&str) -> Result<Pose, String>) -> Result<Self, String> {
        let wrist = start(&gripper.wrist)?;
        positive([
            ("grasp_time", gripper.grasp_time),
            ("speed", gripper.speed),
            ("approach_speed", gripper.approach_speed),
            ("turn_speed", gripper.turn_speed),
            ("screw_speed", gripper.screw_speed),
        ])?;
        let tool = DVec3::from_array(gripper.tool);
        if !tool.is_finite() || !gripper.travel_height.is_finite() {
            return Err(format!(
                "tool {tool}, travel_height {}; expected finite numbers, m",
                gripper.travel_height
            ));
        }
        let home = Pose { translation: wrist.to_world(tool), ..wrist };
        Ok(Self {
            gripper,
            home,
            tool: home,
            time: 0.0,
            wrist: vec![Keyframe::default()],
            fingers: vec![Keyframe { target: Some(gripper.open), ..Keyframe::default() }],
        })
    }

    fn perform(&mut self, task: &Task, start: &impl Fn(&str) -> Result<Pose, String>) -> Result<(), String> {
        let upright = self.home.rotation;
        let Route { grasp, begin, end, turn } =
            Route::new(task, start(&task.part)?, start(&task.into)?, upright)?;
        let Gripper { close, hold, follow, open, grasp_time, .. } = *self.gripper;
        let Gripper { speed, approach_speed, screw_speed, .. } = *self.gripper;
        self.move_to(self.above(grasp), speed);
        self.descend(grasp);
        self.drive_fingers(close, grasp_time);
        self.drive_fingers(hold, SHORTEST);
        self.move_to(self.above(grasp), speed);
        self.move_to(self.above(begin), speed);
        self.descend(begin);
        if turn > 0.0 {
            self.drive_fingers(follow, SHORTEST);
        }
        self.screw(end, -turn, (task.approach / approach_speed).max(turn / screw_speed));
        self.drive_fingers(open, grasp_time);
        self.move_to(self.above(end), speed);
        Ok(())
    }

    /// Returns to where the tool started, so that it is out of the way of other grippers.
    fn go_home(&mut self) {
        self.move_to(self.above(self.home), self.gripper.speed);
        self.move_to(self.home, self.gripper.speed);
    }

    /// The same orientation at the height of travel.
    fn above(&self, tool: Pose) -> Pose {
        Pose { translation: DVec3 { z: self.gripper.travel_height, ..tool.translation }, ..tool }
    }

    /// Moves straight to a pose, and turns the short way.
    fn move_to(&mut self, tool: Pose, speed: f64) {
        let way = tool.translation.distance(self.tool.translation) / speed;
        let turn = rotation_between(self.tool, tool).length() / self.gripper.turn_speed;
        self.time += way.max(turn).max(SHORTEST);
        self.tool = tool;
        self.push(Keyframe { rotation: Some(tool.rotation.to_array()), ..Keyframe::default() });
    }

    /// Descends fast, and the last part of the way slowly.
    fn descend(&mut self, tool: Pose) {
        let near = Pose { translation: tool.translation + DVec3::Z * NEAR, ..tool };
        if near.translation.z < self.tool.translation.z {
            self.move_to(near, self.gripper.speed);
        }
        self.move_to(tool, self.gripper.approach_speed);
    }

    /// Moves to a pose while the tool turns by `angle` about the vertical.
    fn screw(&mut self, tool: Pose, angle: f64, seconds: f64) {
        self.time += seconds;
        self.tool = tool;
        self.push(Keyframe { turn: Some([0.0, 0.0, angle]), ..Keyframe::default() });
    }

    /// Gives the motors of the fingers a target, and waits.
    fn drive_fingers(&mut self, target: f64, seconds: f64) {
        self.fingers.push(Keyframe { time: self.time, target: Some(target), ..Keyframe::default() });
        self.time += seconds;
        self.push(Keyframe::default());
    }

    /// Adds a keyframe of the wrist for the current time and tool.
    fn push(&mut self, keyframe: Keyframe) {
        let tool = DVec3::from_array(self.gripper.tool);
        let wrist = self.tool.translation - self.tool.rotation * tool;
        self.wrist.push(Keyframe { time: self.time, translation: Some(wrist.to_array()), ..keyframe });
    }

    fn into_scripts(self) -> Vec<Script> {
        let script = |body, joint, interpolation, keyframes| Script { body, joint, interpolation, keyframes };
        let wrist = script(Some(self.gripper.wrist.clone()), None, Interpolation::Smooth, self.wrist);
        let finger =
            |name: &String| script(None, Some(name.clone()), Interpolation::Step, self.fingers.clone());
        std::iter::once(wrist).chain(self.gripper.fingers.iter().map(finger)).collect()
    }
}
