//! Reads VTK's unstructured grid as XML.
use glam::DVec3;
use roxmltree::{Document, Node};

mod array;
mod bytes;

use super::{Parsed, ReadTetrahedraError, Skipped, TetFormat, malformed};
use crate::mesh::{Place, text::shown};
use array::{Arrays, Values};

type Result<T> = std::result::Result<T, ReadTetrahedraError>;

const VTU: TetFormat = TetFormat::Vtu;

const APPENDED: &[u8] = b"<AppendedData";

pub(super) fn parse(bytes: &[u8]) -> Result<Parsed> {
    let (xml, appended) = split(bytes)?;
    let text = std::str::from_utf8(&xml).map_err(|error| {
        let line = 1 + xml[..error.valid_up_to()].iter().filter(|&&b| b == b'\n').count() as u64;
        malformed(
            VTU,
            Place::Line(line),
            "bytes that are not UTF-8",
            "expected XML: is the file of another kind?",
        )
    })?;
    let document = Document::parse(text).map_err(|error| {
        let line = Place::Line(error.pos().row.into());
        malformed(VTU, line, error.to_string(), "expected XML: is the file cut short, or of another kind?")
    })?;
    let root = document.root_element();
    let kind = root.attribute("type").unwrap_or_default();
    if root.tag_name().name() != "VTKFile" || kind != "UnstructuredGrid" {
        let name = root.tag_name().name();
        let found = format!("a {} of the type {}", shown(name.as_bytes()), shown(kind.as_bytes()));
        return Err(at(&root, found, "expected a VTKFile of the type UnstructuredGrid"));
    }
    let arrays = Arrays::new(&root, appended, bytes.len())?;
    let grid = child(&root, "UnstructuredGrid")?;
    let mut parsed = Parsed::default();
    for piece in grid.children().filter(|n| n.has_tag_name("Piece")) {
        read_piece(&piece, &arrays, &mut parsed)?;
    }
    Ok(parsed)
}

/// Data that is appended to the XML.
#[derive(Clone, Copy)]
struct Appended<'a> {
    /// The bytes after the underscore.
    bytes: &'a [u8],
    /// The place of these bytes in the file.
    start: usize,
}

/// Splits a file into the XML and the appended data. The appended data is cut out, because raw data
/// is not XML.
fn split(bytes: &[u8]) -> Result<(Vec<u8>, Option<Appended<'_>>)> {
    let Some(tag) = bytes.windows(APPENDED.len()).position(|w| w == APPENDED) else {
        return Ok((bytes.to_vec(), None));
    };
    let line = || Place::Line(1 + bytes[..tag].iter().filter(|&&b| b == b'\n').count() as u64);
    let find = |from: usize, byte: u8| bytes[from..].iter().position(|&b| b == byte).map(|n| from + n);
    let Some((close, underscore)) = find(tag, b'>').and_then(|close| Some((close, find(close, b'_')?)))
    else {
        return Err(malformed(VTU, line(), "AppendedData without '_'", "is the file cut short?"));
    };
    let xml = [&bytes[..=close], b"</AppendedData></VTKFile>"].concat();
    Ok((xml, Some(Appended { bytes: &bytes[underscore + 1..], start: underscore + 1 })))
}

fn line_of(node: &Node<'_, '_>) -> Place {
    Place::Line(node.document().text_pos_at(node.range().start).row.into())
}

fn at(node: &Node<'_, '_>, found: impl Into<String>, help: impl Into<String>) -> ReadTetrahedraError {
    malformed(VTU, line_of(node), found, help)
}

fn child<'a, 'input>(node: &Node<'a, 'input>, name: &str) -> Result<Node<'a, 'input>> {
    node.children().find(|n| n.has_tag_name(name)).ok_or_else(|| {
        at(node, format!("{} without {name}", node.tag_name().name()), format!("expected a {name} in it"))
    })
}

fn count(node: &Node<'_, '_>, name: &str) -> Result<usize> {
    let value = node.attribute(name).unwrap_or_default();
    let error = |_| at(node, format!("{name} is {}", shown(value.as_bytes())), "expected a count");
    value.trim().parse().map_err(error)
}

fn read_piece(piece: &Node<'_, '_>, arrays: &Arrays<'_>, parsed: &mut Parsed) -> Result<()> {
    let (points, cells) = (count(piece, "NumberOfPoints")?, count(piece, "NumberOfCells")?);
    let first = parsed.vertices.len();
    let node = child(&child(piece, "Points")?, "DataArray")?;
    let found = match arrays.read(&node)? {
        Values::Float(values) => values,
        Values::Whole(_) => return Err(at(&node, "whole numbers as points", "expected Float32 or Float64")),
    };
    if points.checked_mul(3) != Some(found.len()) {
        let found = format!("{} coordinates of {points} points", found.len());
        return Err(at(&node, found, "expected three for each"));
    }
    for (vertex, p) in found.chunks_exact(3).enumerate() {
        let p = DVec3::from_slice(p);
        if let Some(axis) = (0..3).find(|&axis| !p[axis].is_finite()) {
            let found = format!("point {vertex} (0-based) has {} = {}", ['x', 'y', 'z'][axis], p[axis]);
            return Err(at(&node, found, "coordinates must be finite"));
        }
        parsed.vertices.push(p);
    }
    let node = child(piece, "Cells")?;
    let named = |name: &str| {
        let array =
            node.children().find(|n| n.has_tag_name("DataArray") && n.attribute("Name") == Some(name));
        let array =
            array.ok_or_else(|| at(&node, format!("Cells without {name}"), "expected such a DataArray"))?;
        match arrays.read(&array)? {
            Values::Whole(values) => Ok((array, values)),
            Values::Float(_) => {
                Err(at(&array, format!("decimal numbers as {name}"), "expected Int32 or Int64"))
            }
        }
    };
    let (connectivity, offsets, types) = (named("connectivity")?, named("offsets")?, named("types")?);
    for (array, values) in [&offsets, &types] {
        if values.len() != cells {
            let found = format!("{} values for {cells} cells", values.len());
            return Err(at(array, found, "expected one for each"));
        }
    }
    let mut start = 0;
    for (cell, (&end, &kind)) in offsets.1.iter().zip(&types.1).enumerate() {
        let corners =
            usize::try_from(end).ok().and_then(|end| connectivity.1.get(start..end)).ok_or_else(|| {
                let found = format!("cell {cell} (0-based) ends at {end}, after {start}");
                at(&offsets.0, found, format!("expected at most {}, ascending", connectivity.1.len()))
            })?;
        start += corners.len();
        if !takes(kind, cell, &types.0, &mut parsed.skipped)? {
            continue;
        }
        let [a, b, c, d] = corners else {
            let found = format!("cell {cell} (0-based), a tetrahedron, has {} vertices", corners.len());
            return Err(at(&offsets.0, found, "expected 4"));
        };
        let mut ids = [0; 4];
        for (id, &v) in ids.iter_mut().zip([a, b, c, d]) {
            let within = usize::try_from(v).ok().filter(|&v| v < points);
            *id = within.and_then(|v| u32::try_from(first + v).ok()).ok_or_else(|| {
                let found = format!("cell {cell} (0-based) uses point {v}");
                at(&connectivity.0, found, format!("expected 0 to {}", points.saturating_sub(1)))
            })?;
        }
        parsed.tetrahedra.push(ids);
    }
    Ok(())
}

/// Whether a cell of this type is read. The types are those of `vtkCellType.h`.
fn takes(kind: i64, cell: usize, array: &Node<'_, '_>, skipped: &mut Skipped) -> Result<bool> {
    let volume = |kind: &str| ReadTetrahedraError::Element {
        format: VTU,
        place: line_of(array),
        element: cell as u64,
        kind: kind.to_owned(),
    };
    match kind {
        10 => return Ok(true),
        0..=2 => skipped.points += 1,
        3 | 4 | 21 | 35 | 68 | 75 => skipped.lines += 1,
        5..=9 | 22 | 23 | 28 | 30 | 34 | 36 | 69 | 70 | 76 | 77 => skipped.surfaces += 1,
        24 => return Err(volume("a second-order tetrahedron")),
        71 | 78 => return Err(volume("a tetrahedron of higher order")),
        11 | 12 | 25 | 29 | 33 | 72 | 79 => return Err(volume("a hexahedron")),
        13 | 26 | 31 | 32 | 73 | 80 => return Err(volume("a prism")),
        14 | 27 | 37 | 74 | 81 => return Err(volume("a pyramid")),
        other => return Err(volume(&format!("of the type {other}"))),
    }
    Ok(false)
}
