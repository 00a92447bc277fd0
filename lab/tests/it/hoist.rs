//! Chains on spools hoist a platform.
use tesdf::mesh::write;
use tesdf_lab::scenes::HoistReport;
use tesdf_parts::{Resolution, Spool};
use tesdf_sim::scene_file::{DetectorMode, LoadedScene};
use tesdf_sim::{RunRecord, Summary};

use crate::support::{self, balls, parse, text_of};

/// A scene of the repository with ten links a chain, that turns its spools by 0.4 rad. `platform` is
/// where its platform is, m, with 100 links and with ten.
fn short(scene: &str, platform: [&str; 2]) -> String {
    let mut text = text_of(scene);
    let [from, to] = platform.map(|z| format!("translation = [0, 0, {z}]"));
    for (from, to) in [
        ("count = 100", "count = 10"),
        ("a99", "a9"),
        ("b99", "b9"),
        ("c99", "c9"),
        (&from, &to),
        ("duration = 3.85", "duration = 0.3"),
        ("time = 0.4, target = 4", "time = 0.15, target = 4"),
        ("time = 3.25, target = 4", "time = 0.2, target = 4"),
        ("time = 3.55", "time = 0.25"),
        ("min_rise = 0.75", "min_rise = 0.02"),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    text
}

fn text() -> String {
    short("chained-sam", ["-2.90001", "-0.29091"])
}

fn run(change: impl FnOnce(&mut LoadedScene)) -> (RunRecord, Summary) {
    let mut loaded = parse(text(), "chained-sam").unwrap();
    change(&mut loaded);
    support::run(&loaded)
}

fn failures(summary: &Summary) -> String {
    summary.report::<HoistReport>().unwrap().failures.join("\n")
}

#[test]
#[ignore = "a whole scene: .ci/release"]
fn the_platform_rises_the_same_on_any_number_of_threads() {
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(|_| {}))
    };
    let (record, summary) = on(1);
    assert_eq!(summary.passed, Some(true), "{summary:?}");
    let hoist = summary.report::<HoistReport>().unwrap();
    assert!(hoist.measurements >= 2 && hoist.turns > 0.05, "{hoist:?}");
    for threads in [2, 8] {
        let (other, again) = on(threads);
        assert_eq!(again, summary, "{threads} threads");
        assert_eq!(other.states(60), record.states(60), "{threads} threads");
    }
}

#[test]
fn with_a_skin_vertices_hoist_it() {
    let loaded = parse(short("chained-sam-nodes", ["-2.891397", "-0.290127"]), "chained-sam-nodes").unwrap();
    assert_eq!(loaded.scene.detector.name(), DetectorMode::Node);
    let (_, summary) = support::run(&loaded);
    assert_eq!(summary.passed, Some(true), "{summary:?}");
}

/// The scene for nodes is the other one, but for its skin, what follows from it, the damping, and
/// finer links.
#[test]
fn both_scenes_are_one_but_for_a_few_values() {
    let [faces, nodes] = ["chained-sam", "chained-sam-nodes"].map(|name| {
        let text = text_of(name);
        let is_of_scene = |line: &&str| !line.starts_with('#') && !line.starts_with("angular_damping");
        text.lines().filter(is_of_scene).map(|line| format!("{line}\n")).collect::<String>()
    });
    let expected = [
        ("mode = \"exact\"\n", "mode = \"node\"\n\n[solver]\nskin = 2e-3\n"),
        ("pitch = 0.029 ", "pitch = 0.0289127 "),
        ("winding_radius = 0.0625\n", "winding_radius = 0.0625873\n"),
        ("[0, 0, -2.90001]", "[0, 0, -2.891397]"),
        ("chain_link.ply", "chain_link_36.ply"),
        ("[0.02899, 0, 0]", "[0.028903, 0, 0]"),
    ];
    assert_eq!(expected.iter().fold(faces, |text, (from, to)| text.replace(from, to)), nodes);
}

#[test]
fn without_contacts_the_platform_falls() {
    let (_, summary) = run(|loaded| loaded.scene.detector.choose(DetectorMode::Off));
    assert_eq!(summary.passed, Some(false));
    let failures = failures(&summary);
    assert!(failures.contains("rise: ") && failures.contains("linking: "), "{failures}");
}

#[test]
#[ignore = "a whole scene: .ci/release"]
fn a_drum_that_is_too_thick_breaks_the_chains() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("spool.ply");
    let spool =
        Spool { drum_diameter: 160e-3, drum_length: 90e-3, flange_diameter: 170e-3, ..Spool::DEFAULT };
    write(&file, spool.mesh(Resolution::Segments(96)).unwrap().mesh()).unwrap();
    let (_, summary) = run(|loaded| {
        assert!(!loaded.replace_geometry("drum*", &file) && !loaded.replace_geometry("spool", &file));
        assert!(loaded.replace_geometry("spool_*", &file));
    });
    assert_eq!(summary.passed, Some(false));
    let failures = failures(&summary);
    assert!(failures.contains("linking: "), "{failures}");
}

#[test]
fn what_is_no_hoist_is_refused() {
    let text = balls(&text());
    let weld = "[[joints]]\nname = \"held\"\nkind = \"weld\"\nchild = \"platform\"\n\n[criterion.hoist]";
    let link =
        "[[joints]]\nname = \"held\"\nkind = \"ball\"\nparent = \"a3\"\nchild = \"a4\"\n\n[criterion.hoist]";
    let cases = [
        ("body = \"platform\"", "body = \"platfrom\"", "there is no body platfrom"),
        ("body = \"platform\"", "body = \"a3\"", "joint last_a holds link a9"),
        ("spool = \"spool_b\", links", "spool = \"spol\", links", "there is no joint spol"),
        (
            "spool = \"spool_b\", links",
            "spool = \"last_b\", links",
            "joint last_b is a weld; expected a hinge",
        ),
        ("links = \"c\"", "links = \"d\"", "0 links are named d0, d1, …; expected at least 2"),
        ("links = \"c\"", "links = \"b\"", "joint first_b holds link b0"),
        ("[criterion.hoist]", weld, "joint held holds body platform"),
        ("[criterion.hoist]", link, "joint held holds link a3"),
        ("min_rise = 0.02", "min_rise = 0", "min_rise is 0; expected a positive number"),
        ("pitch = 0.029", "pitch = -1", "link.pitch is -1; expected a positive number"),
        ("pitch = 0.029", "pitch = 0.035", "link.pitch is 0.035; expected more than half"),
    ];
    support::refused(&text, "chained-sam", &cases);
}
