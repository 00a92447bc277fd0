//! The binary's exit codes, streams and messages.
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use clap::{CommandFactory, Parser};
use tesdf::encode::{
    ChoiceError, Deformation, DomainChoice, EncodeOptions, Method, Preset, Refinement, Sampling, Threshold,
};
use tesdf_cli::{Cli, Command as Parsed, slice};

fn tesdf(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_tesdf")).args(args).output().unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

fn parse(args: &[&str]) -> Result<Parsed, String> {
    let args = std::iter::once("tesdf").chain(args.iter().copied());
    Cli::try_parse_from(args).map(|cli| cli.command).map_err(|e| e.to_string())
}

#[test]
fn the_declaration_is_consistent() {
    Cli::command().debug_assert();
}

#[test]
fn help_and_version_go_to_stdout() {
    for args in [&["--help"][..], &["--version"], &["encode", "--help"], &["help", "slice"]] {
        let out = tesdf(args);
        assert_eq!(out.status.code(), Some(0), "{args:?}");
        assert!(!out.stdout.is_empty() && out.stderr.is_empty(), "{args:?}");
    }
    let version = tesdf(&["--version"]);
    let number = format!("tesdf {}", env!("CARGO_PKG_VERSION"));
    let commit = text(&version.stdout).strip_prefix(&number).unwrap();
    // Without optimisation, or without git, the commit is left out.
    if commit != "\n" {
        let words: Vec<_> =
            commit.strip_prefix(" (").unwrap().strip_suffix(")\n").unwrap().split(' ').collect();
        let [hash, date] = words[..] else { panic!("{commit}") };
        assert!(hash.len() >= 7 && hash.chars().all(|c| c.is_ascii_hexdigit()), "{commit}");
        assert!(date.len() == 10 && date.split('-').count() == 3, "{commit}");
    }
}

#[test]
fn help_fits_in_80_columns() {
    let mut command = Cli::command();
    command.build();
    let names: Vec<_> = command.get_subcommands().map(|c| c.get_name().to_owned()).collect();
    assert!(names.len() > 15, "{names:?}");
    let commands =
        names.iter().map(|name| vec![name.as_str(), "--help"]).chain([vec!["--help"], vec!["help"]]);
    for args in commands {
        let out = tesdf(&args);
        for line in text(&out.stdout).lines() {
            assert!(line.chars().count() <= 80, "{args:?}: {line}");
        }
    }
}

#[test]
fn bad_usage_exits_with_2_and_a_reason_on_stderr() {
    for (args, expected) in [
        (&[][..], "Usage: tesdf <COMMAND>"),
        (&["frobnicate"], "error: unrecognized subcommand 'frobnicate'"),
        (&["encode", "m.stl"], "--output <FILE|FOLDER>"),
        (&["encode", "m.stl", "-o", "f", "--quality", "9"], "error: unexpected argument '--quality' found"),
        (
            &["encode", "m.stl", "-o", "f", "--preset", "huge"],
            "[possible values: default, fast, compact, gpu, paper, sampled-safe]",
        ),
        (&["encode", "m.stl", "-o", "f", "--band", "-1"], "-1 is negative; expected a length"),
        (&["encode", "m.stl", "-o", "f", "--region", "0 0 0 1 1"], "5 numbers; expected six"),
        (&["encode", "m.stl", "-o", "f", "--threads", "0"], "--threads <N>"),
        (&["repair", "m.stl"], "--output <FILE>"),
        (
            &["repair", "m", "-o", "f.ply", "--weld-tolerance", "-1e-3"],
            "-0.001 is negative; expected a length",
        ),
        (&["check", "m.stl", "--quiet"], "error: unexpected argument '--quiet' found"),
        (&["query", "f.tesdf"], "--points <CSV>"),
        (&["verify", "f.tesdf", "--samples", "-1"], "error: "),
        (&["slice", "f", "-o", "p", "--at", "0.5", "--offset", "1"], "cannot be used with"),
        (&["render", "f.tesdf"], "--output <PNG>"),
        (&["completions", "tcl"], "[possible values: bash, elvish, fish, powershell, zsh]"),
    ] {
        let out = tesdf(args);
        assert_eq!(out.status.code(), Some(2), "{args:?}");
        assert!(out.stdout.is_empty(), "{args:?}");
        assert!(text(&out.stderr).contains(expected), "{args:?}: {}", text(&out.stderr));
        assert!(!text(&out.stderr).contains('\x1b'), "colours only on a terminal");
    }
}

#[test]
fn negative_numbers_are_values_and_not_options() {
    let Parsed::Encode(args) = parse(&[
        "encode",
        "m.stl",
        "-o",
        "f.tesdf",
        "--region",
        "-1 -2 -3 1 2 3",
        "--region",
        "0,0,0,1,1,1",
        "--band",
        "0",
        "--preset",
        "compact",
        "--unit",
        "mm",
        "--threads",
        "2",
        "--json",
    ])
    .unwrap() else {
        panic!()
    };
    assert_eq!(args.choices.regions.len(), 2);
    assert_eq!(args.choices.regions[0].min.to_array(), [-1.0, -2.0, -3.0]);
    assert_eq!((args.choices.band, args.choices.preset), (Some(0.0), Preset::Compact));
    let Parsed::Slice(args) =
        parse(&["slice", "a/b.tesdf", "-o", "p.png", "--axis", "x", "--offset", "-2.5e-1"]).unwrap()
    else {
        panic!()
    };
    assert_eq!((args.axis, args.offset, args.size), (slice::Axis::X, Some(-0.25), 1200));
    let bounds = tesdf::geometry::Aabb { min: tesdf::glam::DVec3::ZERO, max: tesdf::glam::DVec3::ONE };
    let view = args.view(bounds, "mm");
    assert_eq!((view.offset, view.title.as_str()), (-0.25, "b.tesdf"));
}

#[test]
fn defaults_are_the_documented_ones() {
    let Parsed::Verify(args) = parse(&["verify", "f.tesdf"]).unwrap() else { panic!() };
    assert_eq!((args.file, args.samples, args.json), (PathBuf::from("f.tesdf"), 10_000, false));
    let Parsed::Encode(args) = parse(&["encode", "m", "-o", "f"]).unwrap() else { panic!() };
    assert_eq!(
        (&args.choices.domain, args.choices.encoder, args.choices.preset),
        (&DomainChoice::Bisection, None, Preset::Default)
    );
    assert_eq!(args.choices.choices().options().unwrap(), EncodeOptions::default());
}

#[test]
fn options_of_the_encoders() {
    let options = |more: &[&str]| {
        let Parsed::Encode(args) = parse(&[&["encode", "m", "-o", "f"], more].concat()).unwrap() else {
            panic!()
        };
        (args.choices.domain.clone(), args.choices.choices().options())
    };
    let (domain, paper) = options(&["--preset", "paper", "--domain", "gmsh", "--plain", "--e-max", "32"]);
    assert_eq!(domain, DomainChoice::Gmsh);
    assert_eq!(paper.unwrap(), EncodeOptions { max_entries: Some(32), ..EncodeOptions::PAPER });
    let (domain, sampled) = options(&[
        "--encoder",
        "sampled",
        "--resolution",
        "8",
        "--threshold",
        "safe",
        "--domain",
        "x.msh",
        "--deformable",
    ]);
    assert_eq!(domain, DomainChoice::File("x.msh".into()));
    let sampled = sampled.unwrap();
    let sampling = Sampling { resolution: 8, threshold: Threshold::CoveringRadius, ..Sampling::PAPER };
    assert_eq!(sampled.method, Method::Sampled(sampling));
    assert_eq!((sampled.deformation, sampled.refinement), (Deformation::Expected, Refinement::ByCost));
    let squared = options(&["--encoder", "sampled", "--threshold", "squared:1e-6"]).1.unwrap();
    let sampling = Sampling { resolution: 32, threshold: Threshold::Squared(1e-6), ..Sampling::PAPER };
    assert_eq!(squared.method, Method::Sampled(sampling));
    for (wrong, named) in [
        (&["--plain"][..], ChoiceError::PlainBisection),
        (&["--resolution", "8"], ChoiceError::NotSampled),
        (&["--domain", "x.msh", "--band", "1"], ChoiceError::BesidesFile),
        (&["--encoder", "certified", "--preset", "paper"], ChoiceError::CertifiedPreset),
    ] {
        assert_eq!(options(wrong).1, Err(named));
    }
}

#[test]
fn completions_are_printed_and_a_closed_pipe_is_no_error() {
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let out = tesdf(&["completions", shell]);
        assert_eq!(out.status.code(), Some(0));
        assert!(text(&out.stdout).contains("tesdf") && out.stderr.is_empty());
    }
    let mut child = Command::new(env!("CARGO_BIN_EXE_tesdf"))
        .args(["completions", "bash"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let out = child.wait_with_output().unwrap();
    assert_eq!((out.status.code(), text(&out.stderr)), (Some(0), ""));
}

#[test]
fn each_command_has_a_manual_page() {
    let names = tesdf(&["man", "--list"]);
    let names: Vec<_> = text(&names.stdout).lines().collect();
    assert!(names.len() > 15 && names.contains(&"encode-all") && !names.contains(&"help"), "{names:?}");
    for args in names.iter().map(|name| vec!["man", name]).chain([vec!["man"]]) {
        let out = tesdf(&args);
        let page = text(&out.stdout);
        let title = if args.len() == 2 { format!(".TH tesdf-{} 1 ", args[1]) } else { ".TH tesdf 1 ".into() };
        assert!(
            out.status.success() && page.contains(&title) && page.contains(".SH SYNOPSIS"),
            "{args:?}: {page}"
        );
    }
    let out = tesdf(&["man", "nothing"]);
    assert_eq!(out.status.code(), Some(2));
    assert!(
        text(&out.stderr).starts_with("error: there is no command nothing\nhint: "),
        "{}",
        text(&out.stderr)
    );
}

/// The parts of a text between `` ` ``.
fn code(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

#[test]
fn the_table_of_names_has_names_that_exist() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let read = |path: &str| std::fs::read_to_string(root.join(path)).expect("a file of the repository");
    let glossary = read("docs/glossary.md");
    let python =
        ["_native.pyi", "bodies.py", "contacts.py"].map(|file| read(&format!("python/tesdf/{file}")));
    let (python, scene) = (python.concat(), read("docs/scene-file.md"));
    let mut command = Cli::command();
    command.build();
    let commands: Vec<_> = command.get_subcommands().collect();
    let is_flag = |name: &str| {
        let has = |c: &&clap::Command| c.get_arguments().any(|arg| arg.get_long() == Some(name));
        commands.iter().any(has)
    };
    let rows = glossary.split("\n## ").find(|part| part.starts_with("Names")).expect("the table");
    let rows: Vec<Vec<&str>> =
        rows.lines().filter(|l| l.starts_with("| ")).skip(1).map(|l| l.split('|').collect()).collect();
    assert!(rows.len() > 20, "{rows:?}");
    for row in rows {
        let [_, thing, _, in_python, in_tool, in_scene, ..] = row[..] else { panic!("{row:?}") };
        for name in code(in_python) {
            let is_there = ["(", ":", " "].iter().any(|end| python.contains(&format!(" {name}{end}")));
            assert!(is_there, "{thing}: Python has no {name}");
        }
        for name in code(in_tool).filter(|name| name.starts_with("--")) {
            assert!(is_flag(&name[2..]), "{thing}: no command has {name}");
        }
        for name in code(in_scene) {
            let is_there = scene.contains(&format!("|`{name}`|")) || scene.contains(&format!("`[{name}]`"));
            assert!(is_there, "{thing}: scene files have no {name}");
        }
    }
}
