//! What the summary of a run says of the scene's criteria.
use crate::terminal::report;
use tesdf_sim::Summary;
use tesdf_sim::criterion::{
    AssemblyReport, EngagedReport, GearRatioReport, HoistReport, InsertionReport, LiftReport, RestReport,
    ScrewReport, SeparationReport, TransmissionReport,
};

type Rows = Vec<(&'static str, String)>;

/// The rows of all criteria.
pub fn rows(summary: &Summary) -> Rows {
    let Summary {
        screw, rest, insertion, lift, gear_ratio, separation, hoist, transmission, assembly, ..
    } = summary;
    [
        screw.as_ref().map(screw_rows),
        rest.as_ref().map(rest_rows),
        insertion.as_ref().map(insertion_rows),
        lift.as_ref().map(lift_rows),
        gear_ratio.as_ref().map(gear_ratio_rows),
        separation.as_ref().map(separation_rows),
        hoist.as_ref().map(hoist_rows),
        transmission.as_ref().map(transmission_rows),
        assembly.as_ref().map(assembly_rows),
    ]
    .into_iter()
    .flatten()
    .flatten()
    .collect()
}

fn screw_rows(screw: &ScrewReport) -> Rows {
    let mut rows = vec![
        (
            "screw",
            format!(
                "{:.4} mm and {:.4} turns, at most {:.1} µm from the pitch",
                screw.travel * 1e3,
                screw.turns,
                screw.largest_pitch_error * 1e6
            ),
        ),
        (
            "acceleration",
            format!(
                "{:.3e} m/s², ideal screw {:.3e} m/s²; {:.1} % of the ideal travel",
                screw.acceleration,
                screw.analytic_acceleration,
                100.0 * screw.travel_of_analytic
            ),
        ),
    ];
    rows.extend(verdict_rows(&screw.failures));
    rows
}

fn rest_rows(rest: &RestReport) -> Rows {
    let nanometres = rest.drift * 1e9;
    let mut rows = vec![
        ("rest", format!("{} moves most, by at most {nanometres:.3} nm", rest.body)),
        ("energy gain", format!("{:.2e} J", rest.energy_gain)),
    ];
    rows.extend(verdict_rows(&rest.failures));
    rows
}

fn insertion_rows(insertion: &InsertionReport) -> Rows {
    let seated = insertion.seated_at.map_or("not seated".into(), |time| format!("seated at {time:.4} s"));
    let mut rows = vec![
        ("insertion", format!("{:.4} mm, {seated}", insertion.travel * 1e3)),
        (
            "play",
            format!(
                "at most {:.1} µm across the axis and {:.2} mrad of tilt",
                insertion.offset * 1e6,
                insertion.tilt * 1e3
            ),
        ),
        clearance_row(insertion.penetration, insertion.measurements),
        (
            "energy gain",
            format!("{:.2e} J; {:.2e} J kinetic when settled", insertion.energy_gain, insertion.jitter),
        ),
    ];
    rows.extend(verdict_rows(&insertion.failures));
    rows
}

fn lift_rows(lift: &LiftReport) -> Rows {
    let mut rows = vec![
        (
            "lift",
            format!("{:.4} mm, held within {:.2} µm of the height", lift.rise * 1e3, lift.height_error * 1e6),
        ),
        (
            "creep",
            format!(
                "{:.2e} mm/s relative to a finger; at most {:.2e} mm/s in a step",
                lift.creep * 1e3,
                lift.jitter * 1e3
            ),
        ),
        clearance_row(lift.penetration, lift.measurements),
        ("energy gain", format!("{:.2e} J while held", lift.energy_gain)),
    ];
    rows.extend(verdict_rows(&lift.failures));
    rows
}

fn separation_rows(separation: &SeparationReport) -> Rows {
    let micrometres = |depth: &f64| format!("{:.1}", 1e6 * depth);
    let found = &separation.penetration;
    let shown: Vec<String> = found.iter().step_by(found.len().div_ceil(8).max(1)).map(micrometres).collect();
    let last = found.last().map_or("none".into(), micrometres);
    let mut rows = vec![
        ("separation", format!("{} µm deep over the run, {last} µm at the end", shown.join(", "))),
        ("kinetic", format!("at most {:.3} of the energy of free fall", separation.kinetic_energy)),
    ];
    rows.extend(verdict_rows(&separation.failures));
    rows
}

fn gear_ratio_rows(gears: &GearRatioReport) -> Rows {
    let ratio = gears.ratio.map_or("none".into(), |ratio| format!("{ratio:.6}"));
    let mut rows = vec![
        (
            "gear ratio",
            format!("{ratio}, {:.4} turns for {:.4} of the driver", gears.driven_turns, gears.driver_turns),
        ),
        (
            "transmission",
            format!(
                "error {:.2} µm peak to peak, {:.2} % of the speed",
                gears.transmission_error * 1e6,
                100.0 * gears.speed_error
            ),
        ),
        clearance_row(gears.penetration, gears.measurements),
    ];
    rows.extend(verdict_rows(&gears.failures));
    rows
}

fn clearance_row(penetration: f64, measurements: usize) -> (&'static str, String) {
    let measured = report::count(measurements, "exact measurement");
    ("clearance", format!("at most {:.3} µm of penetration, in {measured}", penetration * 1e6))
}

fn verdict_rows(failures: &[String]) -> Rows {
    let not_met = failures.iter().map(|failure| ("not met", failure.clone()));
    let verdict = if failures.is_empty() { "passed" } else { "not passed" };
    not_met.chain([("criterion", verdict.into())]).collect()
}

fn hoist_rows(hoist: &HoistReport) -> Rows {
    let HoistReport { rise, wound, turns, tilt, unlinked, penetration, measurements, .. } = hoist;
    let mut rows = vec![
        ("hoist", format!("{:.2} mm, {:.2} mm of chain wound in {turns:.3} turns", 1e3 * rise, 1e3 * wound)),
        ("level", format!("at most {:.3} mrad of tilt", 1e3 * tilt)),
        ("links", format!("{unlinked} times two neighbours were not linked")),
        (
            "clearance",
            format!(
                "at most {:.2} µm of penetration, in {measurements} exact measurements",
                1e6 * penetration
            ),
        ),
    ];
    rows.extend(verdict_rows(&hoist.failures));
    rows
}

fn transmission_rows(transmission: &TransmissionReport) -> Rows {
    let TransmissionReport { gears, neutral, penetration, measurements, .. } = transmission;
    let of_gear = |gear: &EngagedReport| {
        let ratio = gear.ratio.map_or("none".into(), |ratio| format!("{ratio:.6}"));
        format!("{ratio} in {:.2} turns, error {:.1} µm", gear.turns, 1e6 * gear.transmission_error)
    };
    let mut rows: Vec<_> = gears.iter().map(|gear| ("ratio", of_gear(gear))).collect();
    rows.extend(neutral.iter().map(|[input, output]| {
        ("neutral", format!("{output:.5} turns of the output, {input:.2} of the input"))
    }));
    rows.push((
        "clearance",
        format!("at most {:.2} µm of penetration, in {measurements} exact measurements", 1e6 * penetration),
    ));
    rows.extend(verdict_rows(&transmission.failures));
    rows
}

fn assembly_rows(assembly: &AssemblyReport) -> Rows {
    let AssemblyReport { assembled, parts, penetration, measurements, failures } = assembly;
    let mut rows = vec![("assembled", format!("{assembled} of {} parts", parts.len()))];
    rows.extend(parts.iter().map(|part| {
        let place = format!(
            "{}: {:.1} µm off the axis, {:.2} mrad of tilt",
            part.name,
            1e6 * part.offset,
            1e3 * part.tilt
        );
        let more = match (part.turns, part.pitch_error) {
            (Some(turns), Some(error)) => {
                format!("{turns:.3} turns, {:.1} µm between travel and turns × pitch", 1e6 * error)
            }
            _ => format!("{:.1} µm above its place", 1e6 * part.depth),
        };
        ("part", format!("{place}, {more}"))
    }));
    rows.push(clearance_row(*penetration, *measurements));
    rows.extend(verdict_rows(failures));
    rows
}
