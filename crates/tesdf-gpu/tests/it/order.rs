//! Equal bytes in any order of blocks, and of the threads between two barriers. The replacement of
//! CUDA's driver runs them in another order in each launch where `CUDA_ON_CPU_ORDER` is a seed
//! (`./test` sets it); a GPU has an order of its own.
use std::process::Command;

use crate::compare::per_cell;
use crate::on_device::{detector, each_form, read, worlds};
use crate::support::random::Random;
use tesdf::collide::{CollideOptions, Contacts, Mode, Reduction};

/// The options of `each_form`, and of the modes and reductions that these leave out.
fn forms() -> Vec<CollideOptions> {
    let of = |mode| CollideOptions { contact_distance: 0.01, ..per_cell(mode) };
    let more = [
        CollideOptions { mode: Mode::exact(), ..of(Mode::exact()) },
        of(Mode::face().filtered(0.3)),
        CollideOptions { reduction: Reduction::PerPair(3), ..of(Mode::exact()) },
    ];
    [each_form(), more.to_vec()].concat()
}

#[test]
fn repeated_detections_give_equal_bytes() {
    let scene = worlds(2, &mut Random(7));
    let mut detector = detector(&scene);
    let device = detector.device().clone();
    for options in forms() {
        let first = detector.detect(&scene, &options).expect("detects");
        assert!(!first.is_empty(), "{options:?}");
        let bytes = |contacts: &Contacts| format!("{contacts:?}");
        println!("bytes of {:?} {:?}: {}", options.mode, options.reduction, bytes(&first));
        for _ in 0..3 {
            let again = detector.detect(&scene, &options).expect("detects");
            assert!(bytes(&again) == bytes(&first), "two orders differ: {options:?}");
        }
    }
    for options in each_form() {
        let mut rows = || read(&device, &detector.detect_on_device(&scene, None, &options).expect("detects"));
        let [first, again] = [(); 2].map(|()| rows());
        assert!(first == again, "two orders differ on the device: {options:?}");
    }
}

/// Three seeds, and the order of the numbers of threads.
#[test]
#[ignore = "four processes: .ci/release runs it"]
fn every_seed_gives_equal_bytes() {
    let test = std::env::current_exe().expect("a test is a program");
    let printed = ["1", "2", "3", ""].map(|seed| {
        let mut command = Command::new(&test);
        command.args(["--exact", "order::repeated_detections_give_equal_bytes", "--nocapture"]);
        command.env_remove("CUDA_ON_CPU_ORDER");
        if !seed.is_empty() {
            command.env("CUDA_ON_CPU_ORDER", seed);
        }
        let output = command.output().expect("it starts");
        let text = String::from_utf8(output.stdout).expect("UTF-8");
        assert!(output.status.success(), "seed {seed}: {text}");
        let lines: Vec<String> =
            text.lines().filter(|l| l.starts_with("bytes of ")).map(str::to_owned).collect();
        assert_eq!(lines.len(), forms().len());
        lines
    });
    assert!(printed.iter().all(|one| *one == printed[0]), "seeds differ");
}
