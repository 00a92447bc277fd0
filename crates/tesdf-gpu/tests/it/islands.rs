//! Problems of islands on the device: their solutions keep the laws of contact and friction, and
//! scenes move as on the processor.
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use tesdf::collide::{CollideError, CollideOptions, Contacts, Scene, detect};
use tesdf_gpu::{Device, IslandSolver};
use tesdf_sim::Dynamics;
use tesdf_sim::newton::internal::{
    BODY, FORCES, GROUP, NONE, Packed, REPORT, RUN, SCALARS, SolveIslands, UNBOUNDED, field,
};
use tesdf_sim::newton::{Detect, Newton};
use tesdf_sim::scene_file::LoadedScene;

/// How many problems were given to the device, and how many it solved.
#[derive(Default)]
struct Counts {
    given: AtomicUsize,
    solved: AtomicUsize,
}

/// Detects on the processor, solves on the device, and checks what the device says.
struct Checked {
    solver: IslandSolver,
    counts: Arc<Counts>,
}

impl Detect for Checked {
    fn detect(&self, scene: &Scene, options: &CollideOptions) -> Result<Contacts, CollideError> {
        detect(scene, options)
    }

    fn solver(&self) -> Option<&dyn SolveIslands> {
        Some(self)
    }
}

impl SolveIslands for Checked {
    fn least_rows(&self) -> usize {
        0
    }

    fn solve(&self, problems: &Packed) -> Result<Vec<f64>, CollideError> {
        let results = self.solver.solve(problems)?;
        let again = self.solver.solve(problems)?;
        for k in 0..problems.headers.len() {
            self.counts.given.fetch_add(1, Ordering::Relaxed);
            if check(problems, k, &results) {
                let place =
                    |k: usize| problems.headers.get(k).map_or(results.len(), |header| header[2] as usize);
                let bits = |results: &[f64]| {
                    results[place(k)..place(k + 1)].iter().map(|x| x.to_bits()).collect::<Vec<_>>()
                };
                assert!(bits(&results) == bits(&again), "two runs differ");
                self.counts.solved.fetch_add(1, Ordering::Relaxed);
            }
        }
        Ok(results)
    }
}

/// Whether a problem was solved. What says so has to keep the laws.
fn check(problems: &Packed, k: usize, results: &[f64]) -> bool {
    let header = problems.headers[k].map(|word| word as usize);
    let [words_at, numbers_at, results_at, bodies, groups, runs, rows, ..] = header;
    let (words, numbers) = (&problems.words[words_at..], &problems.numbers[numbers_at..]);
    let (of_bodies, offsets) = (&numbers[SCALARS..], &numbers[SCALARS + BODY * bodies..]);
    let fields = &offsets[3 * groups..];
    let of_row = |at: usize, row: usize| fields[at * rows + row];
    let of_groups = &words[bodies + 1..];
    let of_runs = &of_groups[GROUP * groups..];
    let pushing = &of_runs[RUN * runs..];
    if results[results_at + 1] != 1.0 {
        return false;
    }
    let velocity = &results[results_at + REPORT..];
    let forces = &velocity[6 * bodies..6 * bodies + FORCES * rows];
    let (h, balanced) = (numbers[0], numbers[5]);
    // M (v − target), without what the rows give.
    let mut lack = vec![0.0; 6 * bodies];
    for body in 0..bodies {
        let of = &of_bodies[BODY * body..][..BODY];
        let change: Vec<f64> = (0..6).map(|i| velocity[6 * body + i] - of[14 + i]).collect();
        let [xx, yy, zz, xy, xz, yz] = [1, 2, 3, 4, 5, 6].map(|i| of[i]);
        let inertia = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        for i in 0..3 {
            lack[6 * body + i] = of[0] * change[i];
            lack[6 * body + 3 + i] = (0..3).map(|j| inertia[i][j] * change[3 + j]).sum();
        }
    }
    for run in of_runs[..RUN * runs].chunks_exact(RUN) {
        let [first, end, slips, group] = [0, 1, 2, 3].map(|i| run[i] as usize);
        let [body, other] = [0, 1].map(|i| of_groups[GROUP * group + i]);
        let offset = &offsets[3 * group..3 * group + 3];
        let cross = |a: &[f64], b: &[f64], i: usize| {
            a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]
        };
        let mut relative: Vec<f64> = velocity[6 * body as usize..][..6].to_vec();
        if other != NONE {
            let of = &velocity[6 * other as usize..][..6];
            for i in 0..3 {
                relative[i] -= of[i] + cross(&of[3..], offset, i);
                relative[3 + i] -= of[3 + i];
            }
        }
        for row in first..end {
            let dot = |at: usize| (0..6).map(|i| of_row(at + i, row) * relative[i]).sum::<f64>();
            let (push, friction) = (forces[row], [forces[rows + row], forces[2 * rows + row]]);
            let gap = of_row(field::GAP, row) + dot(field::NORMAL) + of_row(field::COMPLIANCE, row) * push;
            let [low, high] = [0, 1].map(|i| of_row(field::BOUNDS + i, row));
            // The force that a spring that keeps it finds is the force.
            let again = (push - gap).max(low).min(high);
            let off = (again - push).abs() / of_row(field::SCALE, row);
            assert!(off < 1e-9, "row {row}: {push} at a gap of {gap}, off by {off:e} m");
            assert!(low > -UNBOUNDED || high < UNBOUNDED || off < 1e-9);
            let mut momentum: Vec<f64> = (0..6).map(|i| of_row(field::NORMAL + i, row) * push).collect();
            if slips == 1 {
                let limit = of_row(field::COEFFICIENT, row) * forces[pushing[row] as usize];
                let slip = [0, 1].map(|t| of_row(field::WAY + t, row) + dot(field::TANGENTS + 6 * t));
                let again = [0, 1].map(|t| friction[t] - slip[t]);
                let size = again[0].hypot(again[1]);
                let share = if size > limit { limit / size } else { 1.0 };
                let off = (again[0] * share - friction[0]).hypot(again[1] * share - friction[1]);
                // What sticks creeps by up to 0.1 nm.
                let off = (off - 1e-3 * limit) / of_row(field::SLIP_SCALE, row);
                assert!(off < 1e-8 + balanced, "row {row}: {friction:?} of {limit} at {slip:?}: {off:e} m");
                for (t, friction) in friction.iter().enumerate() {
                    (0..6).for_each(|i| momentum[i] += of_row(field::TANGENTS + 6 * t + i, row) * friction);
                }
            }
            for i in 0..6 {
                lack[6 * body as usize + i] -= momentum[i];
            }
            if other != NONE {
                for i in 0..3 {
                    lack[6 * other as usize + i] += momentum[i];
                    lack[6 * other as usize + 3 + i] += momentum[3 + i] + cross(offset, &momentum, i);
                }
            }
        }
    }
    for body in 0..bodies {
        let of = &of_bodies[BODY * body..][..BODY];
        let [xx, yy, zz, xy, xz, yz] = [7, 8, 9, 10, 11, 12].map(|i| of[i]);
        let (linear, angular) = lack[6 * body..6 * body + 6].split_at(3);
        let turned = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
            .map(|row| row.iter().zip(angular).map(|(a, b)| a * b).sum::<f64>());
        let length = |v: &[f64]| v.iter().map(|a| a * a).sum::<f64>().sqrt();
        let way = h * (of[13] * length(linear) + of[26] * length(&turned));
        assert!(way < 1e-9 + balanced, "body {body}: its momentum is off by {way:e} m");
    }
    true
}

fn engines(text: &str) -> ([Newton; 2], Arc<Counts>) {
    let loaded = LoadedScene::parse(text.into(), "scene.toml").expect("parses");
    let device = Device::choose(None).expect("a device: `./test` makes the replacement of CUDA's driver");
    let counts = Arc::new(Counts::default());
    let solver = IslandSolver::new(&device).expect("a CUDA device");
    let checked = Checked { solver, counts: counts.clone() };
    let system = || loaded.system().expect("builds");
    let engines = [loaded.newton(system()), loaded.newton_with(system(), checked)];
    (engines.map(|engine| engine.expect("an engine")), counts)
}

const FLOOR: &str =
    "{ name = \"floor\", shape = \"plane\", fixed = true, friction = 0.5, friction_torsional = 0.003 },";

/// A box with friction, sides of 0.1 m.
fn cube(name: &str, keys: &str) -> String {
    format!(
        "{{ name = \"{name}\", mass = 1, friction = 0.5, shape = {{ box = {{ half_extents = [0.05, 0.05, 0.05] }} }}, {keys} }},"
    )
}

fn text(bodies: &str, keys: &str) -> String {
    format!("time_step = 5e-3\nduration = 1\nsolver.sleep = 0\n{keys}\nbodies = [{bodies}]\n")
}

/// Bodies that fall on each other, slide, spin and stop; without friction; joints with motors and
/// limits.
fn scenes() -> Vec<(&'static str, String)> {
    let pile: String = (0..4)
        .map(|k| {
            cube(
                &format!("box{k}"),
                &format!(
                    "translation = [{}, 0, {}], velocity = [0.3, 0.1, 0]",
                    0.01 * k as f64,
                    0.052 + 0.103 * k as f64
                ),
            )
        })
        .collect();
    let smooth: String = (0..3)
        .map(|k| format!("{{ name = \"box{k}\", mass = {}, shape = {{ box = {{ half_extents = [0.05, 0.04, 0.05] }} }}, translation = [0, 0, {}] }},", 1 + 9 * k, 0.051 + 0.101 * k as f64))
        .collect();
    let spinning =
        cube("box", "translation = [0, 0, 0.05], angular_velocity = [0, 0, 6], friction_torsional = 0.003");
    let links: String = (0..5)
        .map(|k| format!("{{ name = \"link{k}\", mass = 0.5, shape = {{ box = {{ half_extents = [0.05, 0.01, 0.01] }} }}, translation = [{}, 0, 0.3] }},", 0.05 + 0.11 * k as f64))
        .collect();
    let joint = |k: usize| {
        let parent = if k == 0 { String::new() } else { format!("parent = \"link{}\", ", k - 1) };
        let more = match k {
            1 => ", limits = [-0.1, 0.1]",
            2 => ", motor = { drive = { velocity = 1.0 }, limit = 0.05 }",
            _ => "",
        };
        let x = 0.11 * k as f64 - 0.005;
        format!(
            "{{ name = \"joint{k}\", {parent}child = \"link{k}\", kind = \"hinge\", axis = [0, 1, 0], \
             anchor = [{x}, 0, 0.3]{more} }},"
        )
    };
    let joints: String = (0..5).map(joint).collect();
    vec![
        ("pile", text(&format!("{FLOOR}{pile}"), "")),
        ("smooth", text(&format!("{{ name = \"floor\", shape = \"plane\", fixed = true }},{smooth}"), "")),
        ("spinning", text(&format!("{FLOOR}{spinning}"), "")),
        ("links", text(&links, &format!("joints = [{joints}]"))),
    ]
}

#[test]
fn solutions_of_the_device_keep_the_laws_and_move_bodies_alike() {
    for (name, text) in scenes() {
        let ([mut here, mut there], counts) = engines(&text);
        for step in 0..40 {
            let [a, b] = [&mut here, &mut there].map(|engine| engine.step(5e-3).expect("steps"));
            assert_eq!(a.converged, b.converged, "{name}, step {step}");
            for (p, q) in here.system().states().iter().zip(there.system().states()) {
                let apart = p.pose.translation.distance(q.pose.translation);
                let turned = p.pose.rotation.angle_between(q.pose.rotation);
                assert!(apart < 1e-6 && turned < 1e-5, "{name}, step {step}: {apart:e} m, {turned:e} rad");
            }
        }
        let [given, solved] = [&counts.given, &counts.solved].map(|count| count.load(Ordering::Relaxed));
        println!("{name}: {solved} of {given} problems");
        assert!(solved >= 10 && 10 * solved >= 9 * given, "{name}: the device solved {solved} of {given}");
    }
}
