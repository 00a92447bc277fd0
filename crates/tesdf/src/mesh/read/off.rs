//! Reads OFF: `OFF`, `COFF`, `NOFF`, `STOFF` and their combinations. Their extra numbers are
//! dropped.
use glam::DVec3;

use super::text::{Lines, integer, malformed, number, shown, without_comment, words};
use super::{MeshFormat, RawMesh, ReadError, sniff};

const OFF: MeshFormat = MeshFormat::Off;

/// Largest count of numbers in a vertex: x y z, four of normal or colour each, and two of texture.
const MAX_VERTEX_NUMBERS: usize = 12;

pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, ReadError> {
    sniff::refuse_other_kinds(bytes, OFF)?;
    sniff::refuse_binary(bytes, OFF)?;
    let mut lines = Lines::new(bytes);
    let [vertices, faces] = header(&mut lines)?;
    let mut raw = RawMesh::with_lines(0);
    let mut content = content_lines(&mut lines);
    for i in 0..vertices {
        let Some((line, text)) = content.next() else {
            return Err(ends_early(
                bytes,
                format!("the file ends before vertex {i} (0-based) of {vertices}"),
            ));
        };
        let mut p = DVec3::ZERO;
        let mut count = 0;
        for word in words(text) {
            let value = number(word, OFF, line)?;
            if count < 3 {
                p[count] = value;
            }
            count += 1;
        }
        if !(3..=MAX_VERTEX_NUMBERS).contains(&count) {
            let found = format!("vertex {i} (0-based) has {count} numbers");
            return Err(malformed(
                OFF,
                line,
                found,
                "expected one vertex on a line: x y z, then perhaps a colour",
            ));
        }
        raw.push_vertex(p, line);
    }
    for i in 0..faces {
        let Some((line, text)) = content.next() else {
            return Err(ends_early(bytes, format!("the file ends before face {i} (0-based) of {faces}")));
        };
        face(text, line, &mut raw)?;
    }
    if let Some((line, text)) = content.next() {
        let found = format!("{} after the last of {faces} faces", shown(text.trim_ascii()));
        return Err(malformed(OFF, line, found, "expected the end: are the counts in the header right?"));
    }
    Ok(raw)
}

fn content_lines<'a>(lines: &mut Lines<'a>) -> impl Iterator<Item = (u64, &'a [u8])> {
    lines.map(|(n, line)| (n, without_comment(line))).filter(|(_, line)| words(line).next().is_some())
}

fn ends_early(bytes: &[u8], found: String) -> ReadError {
    let last = Lines::new(bytes).map(|(n, _)| n).last().unwrap_or(1);
    malformed(OFF, last, found, "expected as many lines as the header says: is the file cut short?")
}

/// Reads the numbers of vertices and faces. The keyword is optional. The counts may follow it on
/// its line, even without a space (`OFF490 518 0` in a widely used data set).
fn header(lines: &mut Lines<'_>) -> Result<[u64; 2], ReadError> {
    let mut content = content_lines(lines);
    let missing = |line: u64| malformed(OFF, line, "no counts", "expected the numbers of vertices and faces");
    let (mut line, mut text) = content.next().ok_or_else(|| missing(1))?;
    let first = words(text).next().unwrap_or_default();
    if let Some(at) = first.windows(3).position(|w| w.eq_ignore_ascii_case(b"OFF")) {
        let prefix = first[..at].to_ascii_uppercase();
        let known = [&b""[..], b"C", b"N", b"CN", b"ST", b"STC", b"STN", b"STCN"];
        if !known.contains(&prefix.as_slice()) {
            let found = format!("the variant {}", shown(first));
            return Err(malformed(OFF, line, found, "expected OFF, COFF, NOFF or STOFF in three dimensions"));
        }
        let start = text.len() - text.trim_ascii_start().len() + at + 3;
        text = &text[start..];
        if words(text).next().is_none() {
            (line, text) = content.next().ok_or_else(|| missing(line))?;
        }
        if words(text).next().is_some_and(|w| w.eq_ignore_ascii_case(b"BINARY")) {
            return Err(malformed(OFF, line, "binary OFF", "expected ASCII: export it as ASCII OFF or PLY"));
        }
    }
    let counts = words(text).map(|w| integer(w, OFF, line)).collect::<Result<Vec<_>, _>>()?;
    match counts[..] {
        [vertices, faces] | [vertices, faces, _] if vertices >= 0 && faces >= 0 => {
            Ok([vertices as u64, faces as u64])
        }
        _ => Err(malformed(
            OFF,
            line,
            format!("{} where the counts should be", shown(text.trim_ascii())),
            "expected the numbers of vertices, faces and edges",
        )),
    }
}

fn face(text: &[u8], line: u64, raw: &mut RawMesh) -> Result<(), ReadError> {
    let face = raw.ends.len();
    let mut numbers = words(text);
    let size = integer(numbers.next().unwrap_or_default(), OFF, line)?;
    if size < 3 {
        let found = format!("face {face} (0-based) has {size} corners");
        return Err(malformed(OFF, line, found, "expected at least three"));
    }
    for corner in 0..size {
        let Some(word) = numbers.next() else {
            let found = format!("face {face} (0-based) ends after {corner} of {size} corners");
            return Err(malformed(OFF, line, found, "expected a face on one line: is the file cut short?"));
        };
        let index = integer(word, OFF, line)?;
        raw.corners.push(u64::try_from(index).map_err(|_| {
            let found = format!("face {face} (0-based) uses vertex {index}");
            malformed(OFF, line, found, "vertices count from 0")
        })?);
    }
    // The rest of the line is a colour.
    raw.end_face(line);
    Ok(())
}
