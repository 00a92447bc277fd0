//! Reads STL, binary and ASCII.
//!
//! A file is binary when its size is 84 + 50 × count. The first word does not decide, because many
//! binary files begin with `solid` too.
use glam::DVec3;

use super::text::{Lines, malformed, number, shown, words};
use super::{MeshFormat, Place, RawMesh, ReadError, sniff};

const HEADER: usize = 84;
const FACET: usize = 50;

pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, ReadError> {
    let count = bytes.get(80..HEADER).and_then(|c| c.try_into().ok()).map(u32::from_le_bytes);
    if let Some(count) = count
        && u64::from(count) * FACET as u64 + HEADER as u64 == bytes.len() as u64
    {
        return Ok(parse_binary(&bytes[HEADER..]));
    }
    sniff::refuse_other_kinds(bytes, MeshFormat::Stl)?;
    let first = Lines::new(bytes).find_map(|(_, line)| words(line).next());
    let has_solid = first.is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    if has_solid && !bytes.contains(&0) {
        return parse_ascii(bytes);
    }
    let found = match count {
        None => format!("the file has {} bytes, less than the {HEADER}-byte header", bytes.len()),
        Some(count) => {
            let body = bytes.len() - HEADER;
            let (whole, left) = (body / FACET, body % FACET);
            format!(
                "the header says {count} triangles ({} bytes), but the file has {} bytes: {whole} triangles and {left} \
                 bytes left over",
                u64::from(count) * FACET as u64 + HEADER as u64,
                bytes.len()
            )
        }
    };
    let help = if has_solid {
        "it begins with 'solid' but has zero bytes, so it is not ASCII STL either; is the file cut short?"
    } else {
        "it does not begin with 'solid', so it is not ASCII STL either; is the file cut short or of another kind?"
    };
    Err(ReadError::Malformed { format: MeshFormat::Stl, place: Place::Byte(80), found, help: help.into() })
}

fn parse_binary(facets: &[u8]) -> RawMesh {
    let mut raw = RawMesh::with_bytes();
    for (face, facet) in facets.chunks_exact(FACET).enumerate() {
        let at = (HEADER + face * FACET) as u64;
        // The normal (12 bytes) and the attribute (2 bytes) add nothing to the corners.
        for (corner, p) in facet[12..48].chunks_exact(12).enumerate() {
            let value = |i: usize| f64::from(f32::from_le_bytes([p[i], p[i + 1], p[i + 2], p[i + 3]]));
            raw.corners.push(raw.positions.len() as u64);
            raw.push_vertex(DVec3::new(value(0), value(4), value(8)), at + 12 + 12 * corner as u64);
        }
        raw.end_face(at);
    }
    raw
}

/// A line number and a word of that line.
type Word<'a> = (u64, &'a [u8]);

fn parse_ascii(bytes: &[u8]) -> Result<RawMesh, ReadError> {
    let mut raw = RawMesh::with_lines(0);
    let mut words = Lines::new(bytes).flat_map(|(n, line)| words(line).map(move |w| (n, w))).peekable();
    let ended = |line: u64, expected: &str, faces: usize| {
        let found = format!("the file ends here, in or after facet {faces} (0-based)");
        malformed(MeshFormat::Stl, line, found, format!("expected {expected}: is the file cut short?"))
    };
    while let Some((line, word)) = words.next() {
        if !word.eq_ignore_ascii_case(b"solid") {
            let found = shown(word);
            return Err(malformed(MeshFormat::Stl, line, found, "expected 'solid' after 'endsolid'"));
        }
        let mut last_line = line;
        let name = solid_name(&mut words, line, b"facet");
        raw.begin_part(name);
        loop {
            let faces = raw.ends.len();
            let Some((line, word)) = words.next() else {
                // Other readers take such a file, and all of its facets are whole.
                raw.notes.push(format!(
                    "line {last_line}: the file ends after facet {} (0-based) without 'endsolid': is it cut short?",
                    faces.checked_sub(1).ok_or_else(|| ended(last_line, "'facet' or 'endsolid'", 0))?
                ));
                return Ok(raw);
            };
            last_line = line;
            let is_split = word.eq_ignore_ascii_case(b"end")
                && words.next_if(|(_, word)| word.eq_ignore_ascii_case(b"solid")).is_some();
            if is_split || word.eq_ignore_ascii_case(b"endsolid") {
                solid_name(&mut words, line, b"solid");
                break;
            }
            let mut next = |expected: &str| match words.next() {
                Some((line, word)) => {
                    last_line = line;
                    Ok((line, word))
                }
                None => Err(ended(last_line, expected, faces)),
            };
            keyword((line, word), "facet", faces)?;
            keyword(next("'normal'")?, "normal", faces)?;
            for _ in 0..3 {
                let (line, word) = next("the normal")?;
                normal_component(word, line)?;
            }
            keyword(next("'outer'")?, "outer", faces)?;
            keyword(next("'loop'")?, "loop", faces)?;
            for _ in 0..3 {
                let (at, word) = next("'vertex'")?;
                keyword((at, word), "vertex", faces)?;
                let mut p = DVec3::ZERO;
                for axis in 0..3 {
                    let (line, word) = next("a coordinate")?;
                    p[axis] = number(word, MeshFormat::Stl, line)?;
                }
                raw.corners.push(raw.positions.len() as u64);
                raw.push_vertex(p, at);
            }
            for what in ["loop", "facet"] {
                let (whole, (line, word)) = (format!("end{what}"), next("'endloop' and 'endfacet'")?);
                // Some programs write two words.
                if word.eq_ignore_ascii_case(b"end") {
                    keyword(next(what)?, what, faces)?;
                } else {
                    keyword((line, word), &whole, faces)?;
                }
            }
            raw.end_face(line);
        }
    }
    Ok(raw)
}

/// Takes the name that may follow `solid` or `endsolid` on the same line. Some files are a single
/// line, so the name also ends at `stop`.
fn solid_name<'a>(
    words: &mut std::iter::Peekable<impl Iterator<Item = Word<'a>>>,
    line: u64,
    stop: &[u8],
) -> String {
    let in_name = |&(n, word): &Word<'_>| {
        n == line && !word.eq_ignore_ascii_case(stop) && !word.eq_ignore_ascii_case(b"endsolid")
    };
    let mut name = Vec::new();
    while let Some((_, word)) = words.next_if(in_name) {
        name.push(String::from_utf8_lossy(word));
    }
    name.join(" ")
}

fn keyword((line, word): Word<'_>, expected: &str, face: usize) -> Result<(), ReadError> {
    if word.eq_ignore_ascii_case(expected.as_bytes()) {
        return Ok(());
    }
    let found = format!("{} in facet {face} (0-based)", shown(word));
    Err(malformed(MeshFormat::Stl, line, found, format!("expected '{expected}'")))
}

/// Checks a component of the normal. The normal is not used, but a decimal comma in it reveals the
/// locale of the file. Exporters write `-nan(ind)` and `1.#QNAN` for flat facets.
fn normal_component(word: &[u8], line: u64) -> Result<(), ReadError> {
    let undefined =
        word.eq_ignore_ascii_case(b"-nan(ind)") || word.windows(2).any(|w| w == b"#Q" || w == b"#I");
    if undefined { Ok(()) } else { number(word, MeshFormat::Stl, line).map(drop) }
}
