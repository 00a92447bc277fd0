//! `kill -9` at random moments: nothing is ever half a file, and a run loses one step at most.
mod folder;

use std::fs;
use std::process::Stdio;
use std::time::{Duration, Instant};

use folder::Folder;
use tesdf_sim::RunRecord;

const KILLS: usize = 50;

/// A block of `n` × `n` × `n` cubes, as its surface.
fn block(n: u32) -> String {
    let mut text = String::new();
    let mut corners = 0;
    for axis in 0..3 {
        for (side, i, j) in (0..2 * n * n).map(|k| (k % 2, k / 2 % n, k / 2 / n)) {
            let corner = |u: u32, v: u32| {
                let mut p = [side * n; 3];
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (i + u, j + v);
                format!("v {} {} {}\n", p[0], p[1], p[2])
            };
            let mut around = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            if side == 0 {
                around.reverse();
            }
            text += &around.concat();
            text += &format!("f {} {} {} {}\n", corners + 1, corners + 2, corners + 3, corners + 4);
            corners += 4;
        }
    }
    text
}

/// A box that is thrown along a floor.
const SCENE: &str = r#"
time_step = 1e-3
duration = 0.6

[record]
contacts_every = 2

[[bodies]]
name = "floor"
shape = "plane"
fixed = true

[[bodies]]
name = "box"
shape = { box = { half_extents = [0.01, 0.02, 0.03] } }
mass = 0.5
translation = [0, 0, 0.05]
velocity = [1, 0, 0]
angular_velocity = [5, 3, 1]
"#;

/// How long a command takes that nobody kills.
fn measure(folder: &Folder, args: &[&str]) -> Duration {
    let start = Instant::now();
    folder.good(args);
    start.elapsed()
}

/// Starts the command and kills it after a while, if it is not over before.
fn kill_after(folder: &Folder, args: &[&str], delay: Duration) {
    let mut command = folder.command(args);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    std::thread::sleep(delay);
    // SIGKILL on Unix; an error when the process has ended.
    let _ = child.kill();
    child.wait().unwrap();
}

#[test]
fn a_killed_encode_leaves_the_old_file_or_the_new_file() {
    let folder = Folder::new();
    folder.write("block.obj", block(12));
    let encode = ["encode", "block.obj", "-o", "f.tesdf", "--preset", "fast"];
    folder.good(&encode);
    let whole = measure(&folder, &encode);
    let new = fs::read(folder.path("f.tesdf")).unwrap();
    let mut random = fastrand::Rng::with_seed(12);
    let mut found = [0; 2];
    for kill in 0..KILLS {
        folder.write("f.tesdf", "old");
        // Every second one near the end, when the file is written.
        let share = if kill % 2 == 0 { random.f64() } else { 0.8 + 0.4 * random.f64() };
        kill_after(&folder, &encode, whole.mul_f64(share));
        let left = fs::read(folder.path("f.tesdf")).unwrap();
        assert!(left == b"old" || left == new, "kill {kill}: {} bytes", left.len());
        found[usize::from(left == new)] += 1;
    }
    assert!(found[0] >= KILLS / 5, "too few were killed in time: {found:?}");
    folder.good(&encode);
    assert_eq!(folder.names(), ["block.obj", "f.tesdf"]);
}

#[test]
fn a_killed_run_goes_on_from_its_last_step_to_the_same_bytes() {
    let folder = Folder::new();
    folder.write("scene.toml", SCENE);
    let simulate = ["simulate", "scene.toml", "-o", "run"];
    let resume = ["simulate", "--resume", "run"];
    let whole = measure(&folder, &simulate);
    let expected = fs::read(folder.path("run")).unwrap();
    let record = RunRecord::from_bytes(&expected).unwrap();
    assert!(record.contacts().any(|(_, contacts)| !contacts.is_empty()), "nothing touches");
    fs::remove_file(folder.path("run")).unwrap();
    let mut random = fastrand::Rng::with_seed(5);
    let (mut cut, mut steps) = (0, None);
    for kill in 0..KILLS {
        let command = if steps.is_some() { &resume[..] } else { &simulate };
        kill_after(&folder, command, whole.mul_f64(0.7 * random.f64()));
        if !folder.path("run").exists() {
            assert_eq!(steps, None, "kill {kill} took the run away");
            continue;
        }
        let left = RunRecord::open(&folder.path("run")).unwrap_or_else(|e| panic!("kill {kill}: {e}"));
        assert!(Some(left.steps()) >= steps, "kill {kill} took steps away");
        let last = left.steps() as usize;
        assert_eq!(left.times(), &record.times()[..=last]);
        assert!((0..=last).all(|step| left.pose(step, 1) == record.pose(step, 1)), "kill {kill}");
        match left.planned_steps() {
            Some(planned) => {
                assert_eq!(planned, record.steps());
                (cut, steps) = (cut + 1, Some(left.steps()));
            }
            None => {
                assert!(fs::read(folder.path("run")).unwrap() == expected, "kill {kill}: other bytes");
                fs::remove_file(folder.path("run")).unwrap();
                steps = None;
            }
        }
    }
    assert!(cut >= KILLS / 5, "too few were killed in time: {cut}");
    folder.good(if steps.is_some() { &resume[..] } else { &simulate });
    assert!(fs::read(folder.path("run")).unwrap() == expected);
    assert_eq!(folder.names(), ["run", "scene.toml"]);
}
