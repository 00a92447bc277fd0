//! `tesdf-lab collide SCENE|RUN|POSES`: the cost of a detection, stage by stage.
use std::time::Instant;
use tesdf::base::Named as _;

use tesdf::EncodeOptions;
use tesdf::collide::{CollideOptions, Reduction, detect};

use super::arguments::Args;
use super::frames::Frames;
use super::hashes::Hashes;
use super::report::{Counts, PHASES, Report, Spread, ms, text};
use tesdf_cli::terminal::report::{self as output, Failure};

/// Measures a detection and prints the result.
///
/// # Errors
/// A file cannot be read, or a device fails.
pub fn run(args: &Args) -> Result<(), Failure> {
    let device = args.device.open()?;
    let options = EncodeOptions { max_entries: args.e_max, ..EncodeOptions::preset(args.preset) };
    let mut frames = Frames::read(&args.source, args.frames, args.worlds, &options)?;
    let contact_distance = args.contact_distance.or(frames.contact_distance).unwrap_or(0.0);
    let options = CollideOptions {
        contact_distance,
        reduction: match (args.reduce, args.spread) {
            (Some(n), _) => Reduction::PerPair(n),
            (None, Some(k)) => Reduction::Spread(k),
            (None, None) => Reduction::None,
        },
        ..CollideOptions::with_mode(args.mode().map_err(Failure::new)?)
    };
    options.validate().map_err(Failure::new)?;
    let mut report = Report {
        source: args.source.display().to_string(),
        device: "cpu".into(),
        mode: options.mode.into(),
        contact_distance,
        preset: args.preset.name(),
        e_max: args.e_max,
        lanes: args.lanes,
        worlds: args.worlds,
        instances: frames.scene.instances().len(),
        frames: frames.poses.len(),
        repeat: args.repeat.max(1),
        launches: 0,
        stages: Vec::new(),
        phases_ms: PHASES.map(|phase| (phase, 0.0)),
        phases_unpruned_ms: None,
        counts: Counts::default(),
        contacts_hash: String::new(),
        bytes: None,
        wall_ms: Spread::default(),
        cpu_wall_ms: None,
        cpu_over_device: None,
    };
    match device {
        // Without the GPU no value of `Device` exists.
        #[cfg(feature = "gpu")]
        Some(device) => {
            super::on_device::fill(&mut report, args, &device.0, &mut frames, &options)?;
            if args.against_cpu {
                let (cpu, ..) = on_processor(&mut frames, &options, report.repeat)?;
                report.cpu_over_device = Some(cpu.mean / report.wall_ms.mean);
                report.cpu_wall_ms = Some(cpu);
            }
        }
        None => {
            (report.wall_ms, report.counts, report.contacts_hash) =
                on_processor(&mut frames, &options, report.repeat)?;
        }
    }
    if args.json {
        output::json(&report)?;
    } else {
        output::text(&text(&report))?;
    }
    Ok(())
}

fn on_processor(
    frames: &mut Frames,
    options: &CollideOptions,
    repeat: u32,
) -> Result<(Spread, Counts, String), Failure> {
    let (mut times, mut found, mut hashes) = (Vec::new(), Vec::new(), Hashes::default());
    for frame in 0..frames.poses.len() {
        frames.show(frame)?;
        for _ in 0..repeat {
            let start = Instant::now();
            let contacts = detect(&frames.scene, options).map_err(Failure::new)?;
            times.push(ms(start.elapsed()));
            hashes.add(frame, contacts.as_slice())?;
            found.push(contacts.statistics);
        }
    }
    let spread = |value: fn(&tesdf::collide::Statistics) -> usize| {
        Spread::of(found.iter().map(|s| value(s) as f64).collect())
    };
    let counts = Counts {
        directions: spread(|s| s.instance_pairs),
        candidates: spread(|s| s.candidates),
        queries: spread(|s| s.polygons),
        contacts: spread(|s| s.touching - s.filtered),
        filtered: spread(|s| s.filtered),
        kept: (options.reduction != Reduction::None).then(|| spread(|s| s.touching - s.filtered - s.reduced)),
        ..Counts::default()
    };
    Ok((Spread::of(times), counts, hashes.all()))
}
