//! Reads Wavefront OBJ as found in practice.
//!
//! The reader takes `v` (without weight and colours) and `f` (without texture and normal indices;
//! indices may be relative), and the names of objects (`o`) or groups (`g`). Other statements are
//! skipped. A note names those that may be geometry (`l`, `p`, free-form surfaces).
use std::collections::HashMap;

use glam::DVec3;

use super::text::{Lines, integer, malformed, number, shown, without_comment, words};
use super::{MeshFormat, RawMesh, ReadError, sniff};

const OBJ: MeshFormat = MeshFormat::Obj;

/// Statements that end at the end of the line even after a backslash. They take names, and a
/// Windows folder (`mtllib C:\parts\`) must not swallow the next line.
const NAMED: &[&[u8]] = &[b"o", b"g", b"s", b"mg", b"usemtl", b"mtllib", b"usemap", b"maplib"];

/// Statements that do not affect the shape.
const SILENT: &[&[u8]] =
    &[b"vt", b"vn", b"bevel", b"c_interp", b"d_interp", b"lod", b"shadow_obj", b"trace_obj"];

/// Number of unknown keywords named in notes. Further ones are only counted.
const NOTED_KEYWORDS: usize = 8;

pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, ReadError> {
    sniff::refuse_other_kinds(bytes, OBJ)?;
    sniff::refuse_binary(bytes, OBJ)?;
    let mut raw = RawMesh::with_lines(1);
    let mut objects = Objects::new(bytes);
    let mut skipped = Skipped::default();
    let mut lines = Lines::new(bytes);
    let mut joined = Vec::new();
    while let Some((number, line)) = lines.next() {
        let line = without_comment(line);
        let Some(keyword) = words(line).next() else { continue };
        let keyword = keyword.strip_suffix(b"\\").unwrap_or(keyword);
        if matches!(keyword, b"o" | b"g") {
            objects.begin(&mut raw, line);
        }
        if NAMED.contains(&keyword) {
            continue;
        }
        let statement = match continued(line) {
            None => line,
            Some(head) => {
                joined.clear();
                joined.extend_from_slice(head);
                for (_, next) in lines.by_ref() {
                    let next = without_comment(next);
                    joined.push(b' ');
                    joined.extend_from_slice(continued(next).unwrap_or(next));
                    if continued(next).is_none() {
                        break;
                    }
                }
                &joined
            }
        };
        let arguments = words(statement).skip(1);
        match keyword {
            b"v" => vertex(arguments, number, &mut raw)?,
            // `fo` is the face statement of version 2.11.
            b"f" | b"fo" => face(arguments, number, &mut raw)?,
            _ if SILENT.contains(&keyword) => {}
            _ => skipped.add(keyword, number)?,
        }
    }
    raw.notes = skipped.notes();
    Ok(raw)
}

/// The objects of the file: those of `o`, or without any `o` the groups of `g`. A name that comes
/// again continues its object.
struct Objects {
    keyword: &'static [u8],
    known: HashMap<Vec<u8>, usize>,
}

impl Objects {
    fn new(bytes: &[u8]) -> Self {
        let has_objects = Lines::new(bytes).any(|(_, line)| words(line).next() == Some(b"o"));
        Self { keyword: if has_objects { b"o" } else { b"g" }, known: HashMap::new() }
    }

    fn begin(&mut self, raw: &mut RawMesh, line: &[u8]) {
        if words(line).next() != Some(self.keyword) {
            return;
        }
        let name = words(line).skip(1).collect::<Vec<_>>().join(&b' ');
        match self.known.get(&name) {
            Some(&part) => raw.continue_part(part),
            None => {
                raw.begin_part(String::from_utf8_lossy(&name).into_owned());
                self.known.insert(name, raw.part_names.len() - 1);
            }
        }
    }
}

/// The line without the trailing backslash; `None` when no backslash continues the line.
fn continued(line: &[u8]) -> Option<&[u8]> {
    line.trim_ascii_end().strip_suffix(b"\\")
}

fn vertex<'a>(
    mut arguments: impl Iterator<Item = &'a [u8]>,
    line: u64,
    raw: &mut RawMesh,
) -> Result<(), ReadError> {
    let mut values = [0.0; 8];
    let mut count = 0;
    for word in arguments.by_ref() {
        let value = number(word, OBJ, line)?;
        if let Some(slot) = values.get_mut(count) {
            *slot = value;
        }
        count += 1;
    }
    // x y z, then a weight, a colour, or both. With alpha there are eight numbers.
    if !matches!(count, 3 | 4 | 6 | 7 | 8) {
        let found = format!("vertex {} (1-based) has {count} numbers", raw.positions.len() + 1);
        return Err(malformed(OBJ, line, found, "expected x y z, and perhaps a weight or a colour"));
    }
    raw.push_vertex(DVec3::new(values[0], values[1], values[2]), line);
    Ok(())
}

fn face<'a>(
    arguments: impl Iterator<Item = &'a [u8]>,
    line: u64,
    raw: &mut RawMesh,
) -> Result<(), ReadError> {
    let face = raw.ends.len();
    for corner in arguments {
        let mut parts = corner.split(|b| *b == b'/');
        let index = integer(parts.next().unwrap_or_default(), OBJ, line)?;
        for part in parts.by_ref().take(2).filter(|part| !part.is_empty()) {
            integer(part, OBJ, line)?;
        }
        if parts.next().is_some() {
            let found = format!("face {face} (0-based) has the corner {}", shown(corner));
            return Err(malformed(OBJ, line, found, "expected v, v/vt, v//vn or v/vt/vn"));
        }
        let vertices = raw.positions.len();
        let resolved = match index {
            // The index may refer to a later vertex, so the upper bound is checked after the last
            // line.
            1.. => Some(index as u64 - 1),
            0 => None,
            _ => (vertices as u64).checked_sub(index.unsigned_abs()),
        };
        raw.corners.push(resolved.ok_or_else(|| {
            let found =
                format!("face {face} (0-based) uses vertex {index} with {vertices} vertices before it");
            malformed(OBJ, line, found, "indices count from 1, or back from -1 for the last vertex")
        })?);
    }
    let corners = raw.open_corners();
    if corners < 3 {
        let found = format!("face {face} (0-based) has {corners} corners");
        return Err(malformed(OBJ, line, found, "expected at least three: delete the line or export again"));
    }
    raw.end_face(line);
    Ok(())
}

/// Statements that were skipped: keyword, first line, number of lines.
#[derive(Default)]
struct Skipped {
    known: Vec<(Vec<u8>, u64, usize)>,
    others: usize,
}

impl Skipped {
    fn add(&mut self, keyword: &[u8], line: u64) -> Result<(), ReadError> {
        if !keyword.iter().all(u8::is_ascii_graphic) {
            let found = format!("{} is not a statement", shown(keyword));
            return Err(malformed(OBJ, line, found, "expected OBJ text: is the file of another kind?"));
        }
        if let Some((_, _, count)) = self.known.iter_mut().find(|(known, ..)| known == keyword) {
            *count += 1;
        } else if self.known.len() < NOTED_KEYWORDS {
            self.known.push((keyword.to_owned(), line, 1));
        } else {
            self.others += 1;
        }
        Ok(())
    }

    fn notes(&self) -> Vec<String> {
        let mut notes: Vec<_> = self
            .known
            .iter()
            .map(|(keyword, line, count)| {
                let what = match keyword.as_slice() {
                    b"l" => "line elements",
                    b"p" => "point elements",
                    b"<<<<<<<" => "mark of an unfinished Git merge: two versions may be mixed",
                    _ => "statements other than vertices and faces",
                };
                format!("line {line}: {} ({what}) skipped; {count} in the file", shown(keyword))
            })
            .collect();
        if self.others > 0 {
            notes.push(format!("{} lines with still other keywords skipped", self.others));
        }
        notes
    }
}
