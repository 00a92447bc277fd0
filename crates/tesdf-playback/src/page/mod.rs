//! Pages that play a run in a browser.
//!
//! The page is one file that asks for nothing: markup, style, programs and numbers are in it. Its
//! numbers are words of 32 bits (`numbers.rs`), deflated, in base64; `data.js` reads them.
mod numbers;

use serde_json::{Value, json};
use tesdf::glam::{DVec2, DVec3, Vec3};

use crate::contacts::FrameContacts;
use crate::forces::FrameForces;
use crate::playback::{Part, Playback};
use crate::{PlaybackError, simple};
use numbers::Numbers;

const TEMPLATE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = concat!(
    include_str!("data.js"),
    include_str!("shaders.js"),
    include_str!("camera.js"),
    include_str!("scene.js"),
    include_str!("player.js")
);
/// Most bytes of a page. Browsers refuse texts of some more.
const MOST: u64 = 400_000_000;

/// What a page draws besides the bodies.
#[derive(Clone, Copy, Debug, Default)]
pub struct Arrows<'a> {
    /// Those of [`Playback::contacts`]; `None`: the page has none.
    pub contacts: Option<&'a [FrameContacts]>,
    /// Those of [`Playback::forces`]; `None`: the page has none.
    pub forces: Option<&'a [FrameForces]>,
}

/// The bytes of a page, in HTML, that plays the run. `title` is its heading.
///
/// # Errors
/// [`PlaybackError`]: a state is not valid, or the page would be larger than 400 MB.
pub fn page(run: &Playback<'_>, arrows: Arrows<'_>, title: &str) -> Result<String, PlaybackError> {
    filled_page(run, arrows, title, Source::File)
}

/// The page of a run at its beginning, which asks its server for what follows.
pub(crate) fn live(run: &Playback<'_>, title: &str) -> Result<String, PlaybackError> {
    filled_page(run, Arrows::default(), title, Source::Server)
}

/// Where a page gets its frames from.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Source {
    /// They are all in it.
    File,
    /// The server that sent the page.
    Server,
}

fn filled_page(
    run: &Playback<'_>,
    arrows: Arrows<'_>,
    title: &str,
    source: Source,
) -> Result<String, PlaybackError> {
    let mut numbers = Numbers::default();
    let meshes: Vec<Value> = run
        .meshes
        .iter()
        .map(|mesh| {
            numbers.push_floats(mesh.positions.as_flattened().iter().copied());
            numbers.push(mesh.normals.iter().map(|&n| octahedron(Vec3::from_array(n))));
            numbers.push(mesh.indices.iter().copied());
            json!({ "vertices": mesh.positions.len(), "corners": mesh.indices.len() })
        })
        .collect();
    let square = simple::square(run.diagonal());
    let mut bodies = Vec::with_capacity(run.bodies.len());
    for (number, body) in run.bodies.iter().enumerate() {
        let track = run.track(number)?;
        let positions = (0..3).flat_map(|k| track.iter().map(move |pose| pose.translation[k] as f32));
        let turns = (0..4).flat_map(|k| track.iter().map(move |pose| pose.rotation.to_array()[k] as f32));
        numbers.push_floats(positions.chain(turns));
        let (mesh, phase) = match body.part {
            Part::Mesh(mesh) => (Some(mesh), DVec2::ZERO),
            Part::Floor(at) => (None, DVec2::new(at.x, at.y).rem_euclid(DVec2::splat(2.0 * square))),
        };
        bodies.push(json!({
            "name": body.name, "mesh": mesh, "scale": body.scale, "colour": body.colour.to_array(),
            "phase": phase.to_array(),
        }));
    }
    let contacts = arrows.contacts.map(|frames| push_contacts(&mut numbers, frames));
    let forces = arrows.forces.map(|frames| push_forces(&mut numbers, frames));
    let around = |p: DVec3| (p - run.centre).to_array();
    let warnings: Vec<String> = run.record.warnings().into_iter().map(|warning| warning.message).collect();
    let about = json!({
        "is_live": source == Source::Server,
        "warnings": warnings,
        "times": run.times, "steps": run.steps, "meshes": meshes, "bodies": bodies, "contacts": contacts,
        "forces": forces,
        "bounds": [around(run.bounds.min), around(run.bounds.max)], "middle": around(run.bounds.center()),
        "diagonal": run.diagonal(), "square": square,
    });
    // In a script of HTML, only `<` could end it.
    let about = about.to_string().replace('<', "\\u003c");
    let title = title.replace('&', "&amp;").replace('<', "&lt;");
    let parts = [
        ("title", &*title),
        ("policy", if source == Source::Server { "; connect-src 'self'" } else { "" }),
        ("style", STYLE),
        ("run", &about),
        ("data", &numbers.to_text()?),
        ("script", SCRIPT),
    ];
    let page = filled(TEMPLATE, &parts);
    let bytes = page.len() as u64;
    if bytes > MOST {
        let hint = "play fewer frames, or draw fewer contacts";
        return Err(PlaybackError::Size { bytes, format: "a page", most: MOST, hint });
    }
    Ok(page)
}

/// Where the arrows of each frame start, and where the last ones end.
fn starts(counts: impl Iterator<Item = usize>) -> impl Iterator<Item = u32> {
    let ends = counts.scan(0, |end, count| {
        *end += count as u32;
        Some(*end)
    });
    std::iter::once(0).chain(ends)
}

/// Appends the forces to the numbers, and describes them.
fn push_forces(numbers: &mut Numbers, frames: &[FrameForces]) -> Value {
    numbers.push(starts(frames.iter().map(|frame| frame.kept.len())));
    numbers.push(frames.iter().map(|frame| frame.found as u32));
    let all = || frames.iter().flat_map(|frame| &frame.kept);
    numbers.push_floats(all().flat_map(|f| f.point.to_array()));
    numbers.push_floats(all().flat_map(|f| f.force.to_array()));
    let steps: Vec<Option<u64>> = frames.iter().map(|frame| frame.step).collect();
    json!({ "steps": steps, "greatest": all().map(|f| f.force.length()).fold(0.0, f32::max) })
}

/// Appends the contacts to the numbers, and describes them.
fn push_contacts(numbers: &mut Numbers, frames: &[FrameContacts]) -> Value {
    numbers.push(starts(frames.iter().map(|frame| frame.kept.len())));
    numbers.push(frames.iter().map(|frame| frame.found as u32));
    numbers.push_floats(frames.iter().map(|frame| frame.kept.first().map_or(0.0, |c| c.distance as f32)));
    let all = || frames.iter().flat_map(|frame| &frame.kept);
    numbers.push_floats(all().flat_map(|c| c.point.to_array()));
    numbers.push(all().map(|c| octahedron(c.normal)));
    numbers.push_floats(all().map(|c| c.distance as f32));
    let most = |sign: f64| all().map(|c| sign * c.distance).fold(0.0, f64::max);
    json!({ "most_deep": most(-1.0), "most_apart": most(1.0) })
}

/// A unit vector as a point of the octahedron |x| + |y| + |z| = 1, whose lower half is folded over
/// the upper one: x and y in 16 bits each.
fn octahedron(n: Vec3) -> u32 {
    let n = n / n.abs().element_sum();
    let fold = |a: f32, b: f32| if n.z < 0.0 { (1.0 - b.abs()).copysign(a) } else { a };
    let bits = |x: f32| u32::from((x * 32767.0).round() as i16 as u16);
    bits(fold(n.x, n.y)) | bits(fold(n.y, n.x)) << 16
}

/// The template with a text in place of each `{{name}}`.
fn filled(template: &str, parts: &[(&str, &str)]) -> String {
    let mut page = String::with_capacity(parts.iter().map(|(_, text)| text.len()).sum());
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        page.push_str(before);
        page.push_str(parts.iter().find(|part| part.0 == name).map_or("", |part| part.1));
        rest = after;
    }
    page.push_str(rest);
    page
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_has_all_parts_and_the_parts_are_not_read_again() {
        assert_eq!(filled("a{{x}}b{{y}}c{{x}}", &[("x", "{{y}}"), ("y", "1")]), "a{{y}}b1c{{y}}");
        let names: Vec<&str> =
            TEMPLATE.split("{{").skip(1).map(|rest| rest.split_once("}}").unwrap().0).collect();
        assert_eq!(names, ["policy", "title", "style", "title", "run", "data", "script"]);
        assert!(!SCRIPT.contains("</") && !STYLE.contains("</"));
    }

    #[test]
    fn unit_vectors_keep_their_directions_on_the_octahedron() {
        let unfold = |word: u32| {
            let [x, y] = [word as u16, (word >> 16) as u16].map(|bits| f32::from(bits as i16) / 32767.0);
            let z = 1.0 - x.abs() - y.abs();
            let fold = |a: f32, b: f32| if z < 0.0 { (1.0 - b.abs()).copysign(a) } else { a };
            Vec3::new(fold(x, y), fold(y, x), z).normalize()
        };
        for k in 0..1000 {
            let (z, angle) = (k as f32 / 499.5 - 1.0, k as f32 * 2.4);
            let r = (1.0 - z * z).max(0.0).sqrt();
            let n = Vec3::new(r * angle.cos(), r * angle.sin(), z).normalize();
            assert!(unfold(octahedron(n)).distance(n) < 1e-4, "{n}");
        }
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            assert_eq!([unfold(octahedron(axis)), unfold(octahedron(-axis))], [axis, -axis]);
        }
    }
}
