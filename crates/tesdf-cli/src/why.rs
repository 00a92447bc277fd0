//! `tesdf collide A.tesdf B.tesdf --why`: explains contacts.
use std::fmt::Write as _;

use tesdf::collide::{
    BroadVerdict, CollideOptions, InstanceId, Mode, PairVerdict, PartReport, PolygonVerdict, Scene,
    WhyReport, why,
};

use crate::terminal::report::{self, Failure, Outcome, count};

/// Prints why contacts exist or not, for both ordered pairs of the bodies. For one `part`, an
/// (instance, number) pair, it reports the ordered pair whose first body has this part.
///
/// # Errors
/// The part does not exist, or stdout cannot be written.
pub fn run(
    scene: &Scene,
    [a, b]: [InstanceId; 2],
    options: &CollideOptions,
    part: Option<(u32, u32)>,
    json: bool,
) -> Result<Outcome, Failure> {
    let pairs = match part {
        None => vec![(a, b, None)],
        Some((instance, part)) if instance == a.0 => vec![(a, b, Some(part))],
        Some((_, part)) => vec![(b, a, Some(part))],
    };
    let pairs = if part.is_none() { [pairs, vec![(b, a, None)]].concat() } else { pairs };
    let reports = pairs
        .into_iter()
        .map(|(a, b, part)| why(scene, options, a, b, part))
        .collect::<Result<Vec<_>, _>>()
        .map_err(Failure::new)?;
    if json {
        report::json(&reports)?;
    } else {
        let text: String = reports.iter().map(|r| text(r, options)).collect();
        report::text(&text)?;
    }
    Ok(Outcome::Good)
}

/// Number of faces, and of polygons per face, in the text output.
const SHOWN: usize = 10;

fn text(r: &WhyReport, options: &CollideOptions) -> String {
    let noun = match options.mode {
        Mode::Node => "node",
        Mode::Face { .. } | Mode::Exact(_) => "face",
    };
    let mut text =
        format!("{noun}s of instance {} in the field of instance {}\n", r.instance_a, r.instance_b);
    let pair = match r.pair {
        PairVerdict::Tested => "tested".to_string(),
        PairVerdict::SameInstance => "not tested: one and the same instance".into(),
        PairVerdict::OtherWorlds => "not tested: in different worlds".into(),
        PairVerdict::GroupsDoNotMeet => "not tested: their groups do not meet".into(),
        PairVerdict::Excluded => "not tested: excluded".into(),
        PairVerdict::BothPlanes => "not tested: both are planes".into(),
        PairVerdict::OfOtherOrder => "not searched: the faces of the other instance have all contacts".into(),
        PairVerdict::BoundsApart => format!("not tested: bounds are {:e} apart", r.bounds_gap),
    };
    let _ = writeln!(text, "  pair: {pair}; contact distance {:e}", r.contact_distance);
    let _ = writeln!(text, "  broad phase: {} of {}", count(r.candidates, "candidate"), count(r.total, noun));
    let mut parts: Vec<&PartReport> = r.parts.iter().collect();
    parts.sort_by(|x, y| x.distance().total_cmp(&y.distance()));
    for part in parts.iter().take(SHOWN) {
        part_text(part, noun, &mut text);
    }
    if parts.len() > SHOWN {
        let _ = writeln!(text, "  and {} more; --json prints all", parts.len() - SHOWN);
    }
    text
}

fn part_text(part: &PartReport, noun: &str, text: &mut String) {
    let broad = match part.broad {
        BroadVerdict::Candidate => "candidate".to_string(),
        BroadVerdict::PrunedByTree { bound } => {
            format!("pruned: a face-tree node that contains it is at least {bound:e} away")
        }
        BroadVerdict::PrunedByBall { bound } => {
            format!("pruned: its bounding ball is at least {bound:e} away")
        }
    };
    let _ = writeln!(
        text,
        "  {noun} {}: {broad}; smallest signed distance {:e}; {} of {}",
        part.id,
        part.distance(),
        count(part.contacts(), "contact"),
        count(part.polygons.len(), "polygon")
    );
    let mut polygons: Vec<_> = part.polygons.iter().collect();
    polygons.sort_by(|x, y| x.distance.total_cmp(&y.distance));
    for p in polygons.iter().take(SHOWN) {
        let verdict = match p.verdict {
            PolygonVerdict::Contact => "contact".to_string(),
            PolygonVerdict::CellBeyond => "dropped: its cell is beyond the contact distance".into(),
            PolygonVerdict::Beyond => "dropped: beyond the contact distance".into(),
            PolygonVerdict::Descending => "dropped: the surface is lower beside it".into(),
            PolygonVerdict::OutOfCones => "dropped: other places of the bodies meet first".into(),
            PolygonVerdict::Filtered { cosine } => format!("dropped by the cosine filter: {cosine:.4}"),
        };
        let cell = p.cell.map_or("no cell".into(), |cell| format!("cell {cell}"));
        let corners = count(p.vertices.len(), "corner");
        let at = report::point(p.point);
        let _ = writeln!(text, "    {cell}, {corners}: {:e} at ({at}), {verdict}", p.distance);
    }
    if polygons.len() > SHOWN {
        let _ = writeln!(text, "    and {} more", polygons.len() - SHOWN);
    }
}
