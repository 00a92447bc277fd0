//! A robot among obstacles, for planners: its clearance with derivatives, and motions that are checked
//! as a whole.
//!
//! ```
//! use tesdf::Progress;
//! use tesdf::collide::{Pose, Shape};
//! use tesdf::glam::DVec3;
//! use tesdf_sim::planning::{MotionOptions, MotionVerdict, Robot, RobotOptions, TOLERANCE};
//!
//! # let folder = tempfile::tempdir()?;
//! # let path = folder.path().join("arm.urdf");
//! # let link = |name: &str| format!(
//! #     "<link name='{name}'><collision><origin xyz='0.5 0 0'/><geometry><box size='1 0.1 0.1'/></geometry></collision></link>"
//! # );
//! # let joint = "<joint name='turn' type='continuous'><parent link='base'/><child link='arm'/><axis xyz='0 0 1'/></joint>";
//! # std::fs::write(&path, format!("<robot name='r'><link name='base'/>{}{joint}</robot>", link("arm")))?;
//! let mut robot = Robot::load(&path, &RobotOptions::default(), &Progress::default())?;
//! robot.add_obstacle("ball", Shape::Sphere { radius: 0.1 }, Pose::at(DVec3::new(0.0, 0.5, 0.0)), 1.0)?;
//!
//! let clearance = robot.clearance(&[0.0], TOLERANCE)?;
//! assert!((clearance.distance - 0.35).abs() < 1e-6);
//! // At both ends the arm is free, and between them the ball is in its way.
//! assert!(!robot.in_collision(&[0.0], TOLERANCE)? && !robot.in_collision(&[3.0], TOLERANCE)?);
//! let motion = robot.check_motion(&[0.0], &[3.0], &MotionOptions::default())?;
//! assert_eq!(motion.verdict, MotionVerdict::Collision);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
mod clearance;
mod error;
mod kinematics;
mod model;
mod motion;
mod reach;
mod shapes;

pub use clearance::{NearestPair, RobotClearance, TOLERANCE};
pub use error::PlanningError;
pub use model::{Robot, RobotOptions};
pub use motion::{MotionCheck, MotionOptions, MotionPlace, MotionVerdict};
