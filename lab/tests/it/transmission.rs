//! A gearbox turns its output shaft by contact alone.
use tesdf_lab::scenes::{TransmissionCriterion, TransmissionReport};
use tesdf_sim::scene_file::{DetectorMode, LoadedScene};
use tesdf_sim::{RunRecord, Summary};

use crate::support::{self, balls, parse, text_of};

/// The first two gears of the scene of the repository, with scripts of three seconds: one engages and
/// drives the output, then the other. After a turn of the input the dogs of the second meet gaps.
fn text() -> String {
    let text = text_of("engine-transmission");
    let (bodies, _) = text.split_once("# Between the gears").expect("the comment above the scripts");
    let is_of_both = |block: &&str| {
        let of = |key: &str| block.lines().find_map(|line| line.strip_prefix(key)?.split('"').next());
        let name = of("name = \"").or_else(|| of("bodies = [\"")).unwrap_or_default();
        !name.ends_with(['3', '4', '5']) && !["sleeve2", "fork2"].contains(&name)
    };
    let bodies = bodies.split("\n[[").filter(is_of_both).collect::<Vec<_>>().join("\n[[");
    let (before, rest) = bodies.split_once("gears = [").expect("the criterion");
    let (_, after) = rest.split_once("min_turns = 10\n").expect("the end of the lists");
    format!(
        r#"{before}gears = [
    {{ ratio = -0.5, from = 0.5, to = 1.755, pitch_radius = 0.05 }},
    {{ ratio = -0.666666666667, from = 2.6, to = 3.1, pitch_radius = 0.045 }},
]
neutral = [[0, 0.05], [2.05, 2.1]]
min_turns = 0.1
{after}
[[scripts]]
joint = "input"
keyframes = [
    {{ time = 0, target = 0.2 }},
    {{ time = 0.25, target = 0.2 }},
    {{ time = 0.45, target = 4 }},
    {{ time = 1.755, target = 4 }},
    {{ time = 1.955, target = 0.2 }},
    {{ time = 2.35, target = 0.2 }},
    {{ time = 2.55, target = 4 }},
]

[[scripts]]
joint = "fork1"
interpolation = "step"
keyframes = [
    {{ time = 0, target = 0 }},
    {{ time = 0.05, target = -0.04 }},
    {{ time = 1.955, target = 0.04 }},
    {{ time = 2.045, target = 0 }},
    {{ time = 2.1, target = 0.04 }},
]
"#
    )
    .replacen("check_every = 0.5", "check_every = 0.25", 1)
}

fn run(change: impl FnOnce(&mut LoadedScene)) -> (RunRecord, Summary) {
    let mut loaded = parse(text(), "engine-transmission").unwrap();
    loaded.scene.duration = 3.1;
    change(&mut loaded);
    support::run(&loaded)
}

/// Only the first second, in which the first gear engages and drives.
fn shorten(loaded: &mut LoadedScene) {
    loaded.scene.duration = 1.0;
    let first = |criterion: &mut TransmissionCriterion| {
        criterion.gears.truncate(1);
        criterion.gears[0].to = 1.0;
        criterion.neutral.truncate(1);
    };
    loaded.scene.criterion.edit(first).expect("the criterion");
}

fn failures(summary: &Summary) -> String {
    summary.report::<TransmissionReport>().unwrap().failures.join("\n")
}

#[test]
#[ignore = "a whole scene: .ci/release"]
fn two_gears_engage_and_drive() {
    let (_, summary) = run(|_| {});
    assert_eq!(summary.passed, Some(true), "{summary:?}");
}

#[test]
#[ignore = "a whole scene: .ci/release"]
fn a_gear_engages_with_faces() {
    let (_, summary) = run(|loaded| {
        shorten(loaded);
        loaded.scene.detector.choose(DetectorMode::Exact);
    });
    assert_eq!(summary.passed, Some(true), "{summary:?}");
}

#[test]
#[ignore = "a whole scene: .ci/release"]
fn a_gear_drives_the_same_on_any_number_of_threads() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(shorten))
    };
    let (record, summary) = on(2);
    assert_eq!(summary.passed, Some(true), "{summary:?}");
    let (other, again) = on(1);
    assert_eq!(again, summary);
    assert_eq!(other.states(200), record.states(200));
}

#[test]
#[ignore = "a whole scene: .ci/release"]
fn without_contacts_nothing_turns() {
    let (_, summary) = run(|loaded| loaded.scene.detector.choose(DetectorMode::Off));
    let failures = failures(&summary);
    assert!(failures.contains("ratio: ") && failures.contains("turns: "), "{failures}");
}

/// A pair of gears of 20 and 40 teeth has the ratio; one of 24 and 36 has not.
#[test]
#[ignore = "a whole scene: .ci/release"]
fn wrong_gears_have_another_ratio() {
    let (driver, gear) = ("../data/parts/driver_z24.ply", "../data/parts/gear_z36.ply");
    let (_, summary) = run(|loaded| {
        shorten(loaded);
        assert!(loaded.replace_geometry("driver1", driver) && loaded.replace_geometry("gear1", gear));
    });
    let failures = failures(&summary);
    assert!(failures.contains("ratio: -0.6"), "{failures}");
}

#[test]
fn what_is_no_gearbox_is_refused() {
    let text = balls(&text());
    let weld = "[[joints]]\nname = \"held\"\nkind = \"weld\"\nchild = \"output\"\n\n[criterion.transmission]";
    let cases = [
        ("input = \"input\"", "input = \"inptu\"", "there is no joint inptu"),
        ("input = \"input\"", "input = \"fork1\"", "joint fork1 is a slider; expected a hinge"),
        ("input = \"input\"", "input = \"output\"", "both hinges turn body output"),
        ("ratio = -0.5", "ratio = 0", "ratio is 0; expected a finite number other than 0"),
        ("to = 1.755,", "to = 0.4,", "gears: from 0.5 to 0.4 s; expected a later end than beginning"),
        ("neutral = [[0, 0.05],", "neutral = [[1, 1],", "neutral: from 1 to 1 s"),
        ("min_turns = 0.1", "min_turns = 0", "min_turns is 0; expected a positive number"),
        (
            "velocity = 0 }, limit = 0.2",
            "velocity = 1 }, limit = 0.2",
            "expected none, a torque, or the velocity 0",
        ),
        ("[criterion.transmission]", weld, "joint held holds body output too"),
    ];
    support::refused(&text, "engine-transmission", &cases);
}
