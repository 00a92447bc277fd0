//! Processes that are killed at random times (`kill -9`): no file is ever incomplete, and a run
//! loses at most one step.

use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::folder::{Folder, block};
use tesdf_sim::RunRecord;

const KILLS: usize = 50;

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

/// A command that is killed at random times.
struct Victim<'a> {
    args: &'a [&'a str],
    random: fastrand::Rng,
    /// Duration of the command: the shortest time that was measured, because other work slows it
    /// down.
    whole: Duration,
}

impl<'a> Victim<'a> {
    fn new(folder: &Folder, args: &'a [&'a str], seed: u64) -> Self {
        let start = Instant::now();
        folder.good(args);
        Self { args, random: fastrand::Rng::with_seed(seed), whole: start.elapsed() }
    }

    /// A random fraction of the command's duration, between `from` and `to`.
    fn share(&mut self, from: f64, to: f64) -> Duration {
        self.whole.mul_f64(from + (to - from) * self.random.f64())
    }

    /// Starts the command and kills it after `delay`. Returns whether it was killed before it
    /// ended.
    fn kill(&mut self, folder: &Folder, args: &[&str], delay: Duration) -> bool {
        let mut command = folder.command(args);
        let start = Instant::now();
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        while start.elapsed() < delay && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_micros(200));
        }
        let _ = child.kill();
        let killed = child.wait().unwrap().signal() == Some(9);
        if !killed && args == self.args {
            self.whole = self.whole.min(start.elapsed());
        }
        killed
    }
}

#[test]
fn a_killed_encode_leaves_the_old_file_or_the_new_file() {
    let folder = Folder::new();
    folder.write("block.obj", block(12));
    let encode = ["encode", "block.obj", "-o", "f.tesdf", "--preset", "fast"];
    let mut victim = Victim::new(&folder, &encode, 12);
    let new = fs::read(folder.path("f.tesdf")).unwrap();
    let mut kills = 0;
    while kills < KILLS {
        folder.write("f.tesdf", "old");
        // Every second kill is near the end, when the file is written.
        let delay = if kills % 2 == 0 { victim.share(0.0, 1.0) } else { victim.share(0.8, 1.0) };
        kills += usize::from(victim.kill(&folder, &encode, delay));
        let left = fs::read(folder.path("f.tesdf")).unwrap();
        assert!(left == b"old" || left == new, "kill {kills}: {} bytes", left.len());
    }
    folder.good(&encode);
    assert_eq!(folder.names(), ["block.obj", "f.tesdf"]);
}

#[test]
fn a_killed_run_resumes_from_its_last_step_to_the_same_bytes() {
    let folder = Folder::new();
    folder.write("scene.toml", SCENE);
    let simulate = ["simulate", "scene.toml", "-o", "run"];
    let resume = ["simulate", "--resume", "run"];
    let mut victim = Victim::new(&folder, &simulate, 5);
    let expected = fs::read(folder.path("run")).unwrap();
    let record = RunRecord::from_bytes(&expected).unwrap();
    assert!(record.contacts().any(|(_, contacts)| !contacts.is_empty()), "nothing touches");
    fs::remove_file(folder.path("run")).unwrap();
    let (mut kills, mut cuts, mut steps) = (0, 0, None);
    while kills < KILLS {
        let command = if steps.is_some() { &resume[..] } else { &simulate };
        let delay = victim.share(0.0, 0.7);
        kills += usize::from(victim.kill(&folder, command, delay));
        if !folder.path("run").exists() {
            assert_eq!(steps, None, "kill {kills} took the run away");
            continue;
        }
        let left = RunRecord::open(folder.path("run")).unwrap_or_else(|e| panic!("kill {kills}: {e}"));
        assert!(Some(left.steps()) >= steps, "kill {kills} took steps away");
        let last = left.steps() as usize;
        assert_eq!(left.times(), &record.times()[..=last]);
        assert!((0..=last).all(|step| left.pose(step, 1) == record.pose(step, 1)), "kill {kills}");
        match left.planned_steps() {
            Some(planned) => {
                assert_eq!(planned, record.steps());
                (cuts, steps) = (cuts + 1, Some(left.steps()));
            }
            None => {
                assert!(fs::read(folder.path("run")).unwrap() == expected, "kill {kills}: other bytes");
                fs::remove_file(folder.path("run")).unwrap();
                steps = None;
            }
        }
    }
    assert!(cuts > 0, "no run was interrupted");
    folder.good(if steps.is_some() { &resume[..] } else { &simulate });
    assert!(fs::read(folder.path("run")).unwrap() == expected);
    assert_eq!(folder.names(), ["run", "scene.toml"]);
}
