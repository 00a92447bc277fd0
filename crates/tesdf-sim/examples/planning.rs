//! What checks for planners cost: an arm of six axes around a ring of 50,000 faces.
//!
//! `cargo run --release -p tesdf-sim --example planning -- [CONFIGURATIONS]`; the default is 10,000.
//! `RAYON_NUM_THREADS` sets the number of threads.
use std::error::Error;
use std::f64::consts::TAU;
use std::path::Path;
use std::time::Instant;

use tesdf::collide::Pose;
use tesdf::encode::{Encoder, Preset};
use tesdf::glam::{DQuat, DVec3};
use tesdf::mesh::{SolidMesh, TriangleMesh};
use tesdf::{Progress, TeSdf};
use tesdf_sim::planning::{MotionOptions, MotionVerdict, Robot, RobotOptions, TOLERANCE};

/// A ring with knobs, 0.6 m wide: `around × across × 2` faces.
fn ring(around: u32, across: u32) -> Result<TeSdf, Box<dyn Error>> {
    let angle = |k: u32, n: u32| TAU * f64::from(k) / f64::from(n);
    let mut vertices = Vec::new();
    for i in 0..around {
        for j in 0..across {
            let (u, v) = (angle(i, around), angle(j, across));
            let tube = 0.06 * (1.0 + 0.2 * (9.0 * u).cos() * (3.0 * v).cos());
            let out = 0.24 + tube * v.cos();
            vertices.push(DVec3::new(out * u.cos(), out * u.sin(), tube * v.sin()));
        }
    }
    let mut faces = Vec::new();
    for i in 0..around {
        for j in 0..across {
            let at = |i: u32, j: u32| i % around * across + j % across;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    let solid = SolidMesh::new(TriangleMesh::new(vertices, faces)?)?;
    Ok(Encoder::new().preset(Preset::Fast).encode(&solid)?)
}

/// Numbers from 0 to 1 without a pattern.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Seconds that some work takes, and its result.
fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let begin = Instant::now();
    let found = work();
    (begin.elapsed().as_secs_f64(), found)
}

fn main() -> Result<(), Box<dyn Error>> {
    let count = std::env::args().nth(1).map_or(Ok(10_000), |text| text.parse::<usize>())?;
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/robots/six-axis-arm.urdf");
    let (seconds, robot) = timed(|| Robot::load(&file, &RobotOptions::default(), &Progress::default()));
    let mut robot = robot?;
    println!("robot: {} joints, read and encoded in {seconds:.2} s", robot.dof());
    let (seconds, part) = timed(|| ring(250, 100));
    let part = part?;
    println!("part: {} faces, encoded in {seconds:.2} s", part.face_count());
    let beside = Pose { translation: DVec3::new(0.45, 0.0, 0.45), rotation: DQuat::from_rotation_y(1.2) };
    robot.add_obstacle("ring", part.into(), beside, 1.0)?;

    let mut numbers = Numbers(7);
    let mut random = |share: f64| -> Vec<f64> {
        let limits = robot.limits().iter();
        limits.map(|[low, high]| share * (low + (high - low) * numbers.next())).collect()
    };
    let rows: Vec<_> = (0..count).map(|_| random(0.6)).collect();
    let threads = rayon::current_num_threads();
    robot.are_clearances_below(&rows[..count.min(100)], 0.0, TOLERANCE)?;
    let (seconds, below) = timed(|| robot.are_clearances_below(&rows, 0.0, TOLERANCE));
    let below = below?;
    let collide = below.iter().filter(|below| **below).count();
    println!(
        "in_collision: {count} configurations in {seconds:.2} s on {threads} threads, {collide} collide"
    );
    let (seconds, clearances) = timed(|| robot.clearances(&rows, TOLERANCE));
    let least = clearances?.iter().map(|found| found.distance).fold(f64::INFINITY, f64::min);
    println!("clearances: {count} configurations in {seconds:.2} s, the deepest is {least:.4} m");

    // Motions that a planner makes: from free configurations to free ones, a step away.
    let free: Vec<&Vec<f64>> =
        rows.iter().zip(&below).filter(|(_, below)| !**below).map(|(q, _)| q).collect();
    for step in [0.05, 0.1, 0.2, 0.5, 1.0] {
        let mut motions = Vec::new();
        for from in free.iter().take(400) {
            let to: Vec<f64> = from.iter().map(|x| x + step * (2.0 * numbers_of(x) - 1.0)).collect();
            if !robot.in_collision(&to, TOLERANCE)? {
                motions.push([(*from).clone(), to]);
            }
        }
        let options = MotionOptions::default();
        let (points, _) = timed(|| {
            motions.iter().flatten().map(|q| robot.in_collision(q, TOLERANCE)).collect::<Result<Vec<_>, _>>()
        });
        let (seconds, found) = timed(|| {
            motions.iter().map(|[a, b]| robot.check_motion(a, b, &options)).collect::<Result<Vec<_>, _>>()
        });
        let found = found?;
        let of = |verdict| found.iter().filter(|found| found.verdict == verdict).count();
        let steps: u32 = found.iter().map(|found| found.steps).sum();
        let (point, motion) = (points / (2 * motions.len()) as f64, seconds / motions.len() as f64);
        println!(
            "motions by up to {step} rad: {} free, {} collide, {} undecided; {:.0} µs each, {:.0} intervals; a point \
             takes {:.0} µs: {:.1} times",
            of(MotionVerdict::Free),
            of(MotionVerdict::Collision),
            of(MotionVerdict::Undecided),
            1e6 * motion,
            f64::from(steps) / motions.len() as f64,
            1e6 * point,
            motion / point,
        );
    }
    Ok(())
}

/// A number from 0 to 1 that depends on another one without a pattern.
fn numbers_of(x: &f64) -> f64 {
    Numbers(x.to_bits()).next()
}
