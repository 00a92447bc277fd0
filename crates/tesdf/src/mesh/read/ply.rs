//! Reads PLY: ASCII and binary of either byte order, all scalar types, extra properties and
//! elements.
//!
//! `header.rs` reads the header. `rows.rs` gives the values of the data in order, whatever the
//! encoding. This module turns them into vertices, polygons and triangle strips.
mod header;
mod rows;

use glam::DVec3;

use super::text::shown;
use super::{MeshFormat, Place, RawMesh, ReadError, sniff};
use header::{Element, Encoding, Kind, header};
use rows::Rows;

const PLY: MeshFormat = MeshFormat::Ply;

/// The use of a property.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    Coordinate(usize),
    Corners,
    Strip,
    Skipped,
}

pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, ReadError> {
    sniff::refuse_other_kinds(bytes, PLY)?;
    let (header, mut rows) = header(bytes)?;
    let mut raw = match header.encoding {
        Encoding::Ascii => RawMesh::with_lines(0),
        _ => RawMesh::with_bytes(),
    };
    for element in &header.elements {
        read_element(element, &mut rows, &mut raw)?;
    }
    rows.finish()?;
    Ok(raw)
}

fn read_element(element: &Element, rows: &mut Rows<'_>, raw: &mut RawMesh) -> Result<(), ReadError> {
    // Rows without a property take no bytes and no line, whatever their number in the header.
    if element.properties.is_empty() {
        return Ok(());
    }
    let roles = roles(element)?;
    let is_vertex = element.name == b"vertex";
    let is_face = element.name == b"face";
    let mut strip = Vec::new();
    for row in 0..element.count {
        let at = rows.begin(element, row)?;
        let mut position = DVec3::ZERO;
        for (property, &role) in element.properties.iter().zip(&roles) {
            let size = match property.kind {
                Kind::Scalar(ty) => {
                    let value = rows.value(ty)?;
                    if let Role::Coordinate(axis) = role {
                        position[axis] = value;
                    }
                    continue;
                }
                Kind::List { size, item } => (rows.list_size(size)?, item),
            };
            let (count, item) = size;
            if role == Role::Skipped {
                for _ in 0..count {
                    rows.value(item)?;
                }
                continue;
            }
            for _ in 0..count {
                let value = rows.value(item)?;
                if role == Role::Strip && value == -1.0 {
                    raw.push_strip(&strip, at);
                    strip.clear();
                    continue;
                }
                let index = vertex_index(value).ok_or_else(|| {
                    rows.malformed(
                        format!("face {} (0-based) uses vertex {value}", raw.ends.len()),
                        "a vertex index is a whole number from 0",
                    )
                })?;
                if role == Role::Strip { strip.push(index) } else { raw.corners.push(index) }
            }
            if role == Role::Strip {
                raw.push_strip(&strip, at);
                strip.clear();
            }
        }
        rows.end()?;
        if is_vertex {
            raw.push_vertex(position, at);
        } else if is_face {
            let corners = raw.open_corners();
            if corners < 3 {
                let found = format!("face {} (0-based) has {corners} corners", raw.ends.len());
                return Err(rows.malformed(found, "expected at least three"));
            }
            raw.end_face(at);
        }
    }
    Ok(())
}

fn vertex_index(value: f64) -> Option<u64> {
    // All integers up to 2^53 are exact, and no file has that many vertices.
    let is_index = (0.0..9.0e15).contains(&value) && value.fract() == 0.0;
    is_index.then_some(value as u64)
}

fn roles(element: &Element) -> Result<Vec<Role>, ReadError> {
    let roles: Vec<_> = element
        .properties
        .iter()
        .map(|property| {
            let is_list = matches!(property.kind, Kind::List { .. });
            let is_corners = matches!(property.name.as_slice(), b"vertex_indices" | b"vertex_index");
            match (element.name.as_slice(), property.name.as_slice()) {
                (b"vertex", b"x") if !is_list => Role::Coordinate(0),
                (b"vertex", b"y") if !is_list => Role::Coordinate(1),
                (b"vertex", b"z") if !is_list => Role::Coordinate(2),
                (b"face", _) if is_list && is_corners => Role::Corners,
                (b"tristrips", _) if is_list && is_corners => Role::Strip,
                _ => Role::Skipped,
            }
        })
        .collect();
    let needed: &[(Role, &str)] = match element.name.as_slice() {
        b"vertex" => &[(Role::Coordinate(0), "x"), (Role::Coordinate(1), "y"), (Role::Coordinate(2), "z")],
        b"face" => &[(Role::Corners, "list … vertex_indices")],
        b"tristrips" => &[(Role::Strip, "list … vertex_indices")],
        _ => &[],
    };
    for (role, name) in needed {
        let times = roles.iter().filter(|r| *r == role).count();
        if times != 1 {
            return Err(ReadError::Malformed {
                format: PLY,
                place: Place::Line(element.line),
                found: format!("element {} has {times} properties '{name}'", shown(&element.name)),
                help: "expected exactly one".into(),
            });
        }
    }
    Ok(roles)
}
