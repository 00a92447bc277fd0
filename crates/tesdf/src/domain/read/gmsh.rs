//! Reads Gmsh's MSH 2.2 and 4.1, ASCII and binary. Only the sections of nodes and elements are
//! read.
use std::collections::HashMap;

use super::cursor::{Cursor, Encoding};
use super::{Parsed, ReadTetrahedraError, TetFormat};
use crate::mesh::text::{shown, words};

type Result<T> = std::result::Result<T, ReadTetrahedraError>;

#[derive(Clone, Copy, PartialEq)]
enum Version {
    V2,
    V41,
}

struct Reader<'a> {
    cursor: Cursor<'a>,
    version: Version,
    /// The index of each node in `parsed.vertices`.
    nodes: HashMap<u64, u32>,
    parsed: Parsed,
}

pub(super) fn parse(bytes: &[u8]) -> Result<Parsed> {
    let mut cursor = Cursor::new(bytes, TetFormat::Msh);
    let version = header(&mut cursor)?;
    let mut reader = Reader { cursor, version, nodes: HashMap::new(), parsed: Parsed::default() };
    let mut has_elements = false;
    loop {
        reader.cursor.skip_space();
        match reader.cursor.rest_of_line() {
            b"" => break,
            b"$Nodes" => reader.nodes()?,
            b"$Elements" => {
                has_elements = true;
                reader.elements()?;
            }
            [b'$', name @ ..] if !name.is_empty() && !name.starts_with(b"End") => {
                let end = [b"$End", name].concat();
                if !reader.cursor.skip_past(&end) {
                    let found = format!("the section {} has no end", shown(name));
                    return Err(reader.cursor.error(found, "is the file cut short?"));
                }
            }
            other => {
                let found = format!("{} between sections", shown(other));
                return Err(reader.cursor.error(found, "expected a section such as $Nodes"));
            }
        }
    }
    if !has_elements {
        return Err(reader.cursor.error("the file has no $Elements", "is the file cut short?"));
    }
    Ok(reader.parsed)
}

fn header(cursor: &mut Cursor<'_>) -> Result<Version> {
    let first = cursor.rest_of_line();
    if first != b"$MeshFormat" {
        let found = format!("{} at the start", shown(first));
        return Err(cursor.error(found, "expected $MeshFormat: is the file of another kind?"));
    }
    let line = cursor.rest_of_line();
    let (version, kind, size) = match words(line).collect::<Vec<_>>()[..] {
        [version, kind, size] => (version, kind, size),
        _ => return Err(cursor.error(shown(line), "expected version, file type and data size, as 4.1 0 8")),
    };
    let version = match version {
        b"2.2" | b"2.1" | b"2" | b"2.0" => Version::V2,
        b"4.1" => Version::V41,
        other => {
            let found = format!("version {}", shown(other));
            return Err(cursor.error(found, "expected 2.2 or 4.1: `gmsh FILE -save -format msh41` converts"));
        }
    };
    match kind {
        b"0" => {}
        b"1" => {
            if size != b"8" {
                let found = format!("data size {}", shown(size));
                return Err(cursor.error(found, "expected 8: convert to ASCII on the machine that wrote it"));
            }
            cursor.encoding = Encoding::Little;
            match cursor.int("the number 1, which tells the byte order,")? {
                1 => {}
                0x0100_0000 => cursor.encoding = Encoding::Big,
                other => {
                    return Err(cursor.error(format!("{other:#x} as byte order"), "expected the number 1"));
                }
            }
        }
        other => {
            let found = format!("file type {}", shown(other));
            return Err(cursor.error(found, "expected 0 for ASCII or 1 for binary"));
        }
    }
    end(cursor, b"$EndMeshFormat")?;
    Ok(version)
}

fn end(cursor: &mut Cursor<'_>, name: &[u8]) -> Result<()> {
    let found = cursor.word();
    if found == name {
        return Ok(());
    }
    let found = if found.is_empty() { "the end of the file".into() } else { shown(found) };
    Err(cursor.error(found, format!("expected {}: are the counts right?", shown(name))))
}

impl Reader<'_> {
    /// Version 2 writes counts as text even in binary files.
    fn count(&mut self, what: &str) -> Result<u64> {
        let encoding = std::mem::replace(&mut self.cursor.encoding, Encoding::Ascii);
        let count = self.cursor.size(what);
        self.cursor.encoding = encoding;
        let count = count?;
        if encoding != Encoding::Ascii {
            self.cursor.rest_of_line();
        }
        Ok(count)
    }

    /// Version 2 writes ids as 32-bit integers.
    fn id(&mut self, what: &str) -> Result<u64> {
        if self.version == Version::V41 {
            return self.cursor.size(what);
        }
        let id = self.cursor.int(what)?;
        u64::try_from(id)
            .map_err(|_| self.cursor.error(format!("{id} where {what} should be"), "expected a positive id"))
    }

    fn nodes(&mut self) -> Result<()> {
        match self.version {
            Version::V2 => {
                for _ in 0..self.count("the number of nodes")? {
                    let id = self.id("a node's number")?;
                    self.node(id)?;
                }
            }
            Version::V41 => {
                let blocks = self.cursor.size("the number of blocks")?;
                for what in ["the number of nodes", "the least node", "the greatest node"] {
                    self.cursor.size(what)?;
                }
                for _ in 0..blocks {
                    self.node_block()?;
                }
            }
        }
        end(&mut self.cursor, b"$EndNodes")
    }

    fn node_block(&mut self) -> Result<()> {
        let dimension = self.cursor.int("the dimension of an entity")?;
        self.cursor.int("the number of an entity")?;
        let parametric = self.cursor.int("whether nodes are parametric")?;
        if !(0..=3).contains(&dimension) || !(0..=1).contains(&parametric) {
            let found = format!("dimension {dimension}, parametric {parametric}");
            return Err(self.cursor.error(found, "expected a dimension from 0 to 3, and 0 or 1"));
        }
        let count = self.cursor.size("the number of nodes in a block")?;
        let mut ids = Vec::new();
        for _ in 0..count {
            ids.push(self.id("a node's number")?);
        }
        for id in ids {
            self.node(id)?;
            for _ in 0..parametric * dimension {
                self.cursor.double("a parametric coordinate")?;
            }
        }
        Ok(())
    }

    fn node(&mut self, id: u64) -> Result<()> {
        let p = self.cursor.point()?;
        if let Some(axis) = (0..3).find(|&axis| !p[axis].is_finite()) {
            let found = format!("node {id} has {} = {}", ['x', 'y', 'z'][axis], p[axis]);
            return Err(self.cursor.error(found, "coordinates must be finite"));
        }
        // Ids beyond 32 bits would need a file of 100 GB. The limit of `TetMesh` is below that.
        let at = self.parsed.vertices.len() as u32;
        if self.nodes.insert(id, at).is_some() {
            return Err(self.cursor.error(format!("node {id} is there twice"), "expected different numbers"));
        }
        self.parsed.vertices.push(p);
        Ok(())
    }

    fn elements(&mut self) -> Result<()> {
        match (self.version, self.cursor.encoding) {
            (Version::V2, Encoding::Ascii) => {
                for _ in 0..self.count("the number of elements")? {
                    let id = self.id("an element's number")?;
                    let kind = self.cursor.int("an element's type")?;
                    let tags = self.cursor.int("the number of tags")?;
                    self.element(id, kind, tags)?;
                }
            }
            (Version::V2, _) => {
                let mut left = self.count("the number of elements")?;
                while left > 0 {
                    let kind = self.cursor.int("an element type")?;
                    let follow = self.cursor.int("the number of elements that follow")?;
                    let tags = self.cursor.int("the number of tags")?;
                    if follow < 1 || follow as u64 > left {
                        let found = format!("{follow} elements in a block, of {left} that are left");
                        return Err(self.cursor.error(found, "expected a count that fits"));
                    }
                    left -= follow as u64;
                    for _ in 0..follow {
                        let id = self.id("an element's number")?;
                        self.element(id, kind, tags)?;
                    }
                }
            }
            (Version::V41, _) => {
                let blocks = self.cursor.size("the number of blocks")?;
                for what in ["the number of elements", "the least element", "the greatest element"] {
                    self.cursor.size(what)?;
                }
                for _ in 0..blocks {
                    self.cursor.int("the dimension of an entity")?;
                    self.cursor.int("the number of an entity")?;
                    let kind = self.cursor.int("an element type")?;
                    for _ in 0..self.cursor.size("the number of elements in a block")? {
                        let id = self.id("an element's number")?;
                        self.element(id, kind, 0)?;
                    }
                }
            }
        }
        end(&mut self.cursor, b"$EndElements")
    }

    /// Reads the tags and the nodes of an element.
    fn element(&mut self, element: u64, kind: i32, tags: i32) -> Result<()> {
        for _ in 0..tags {
            self.cursor.int("a tag")?;
        }
        let skipped = &mut self.parsed.skipped;
        let nodes = match element_kind(kind) {
            Some(Kind::Tetrahedron) => {
                let mut corners = [0; 4];
                for corner in &mut corners {
                    let node = self.id("a node of an element")?;
                    *corner = *self.nodes.get(&node).ok_or_else(|| {
                        let found = format!("element {element} uses node {node}, which is not in $Nodes");
                        self.cursor.error(found, "expected nodes before the elements: is the file cut short?")
                    })?;
                }
                self.parsed.tetrahedra.push(corners);
                return Ok(());
            }
            Some(Kind::Point(nodes)) => {
                skipped.points += 1;
                nodes
            }
            Some(Kind::Line(nodes)) => {
                skipped.lines += 1;
                nodes
            }
            Some(Kind::Surface(nodes)) => {
                skipped.surfaces += 1;
                nodes
            }
            Some(Kind::Volume(kind)) => {
                let (format, place, kind) = (TetFormat::Msh, self.cursor.place(), kind.to_owned());
                return Err(ReadTetrahedraError::Element { format, place, element, kind });
            }
            None => {
                let found = format!("element {element} is of the unknown type {kind}");
                return Err(self.cursor.error(found, "expected tetrahedra, type 4"));
            }
        };
        for _ in 0..nodes {
            self.id("a node of an element")?;
        }
        Ok(())
    }
}

/// The kind of an element, with its number of nodes for elements that are skipped.
enum Kind {
    Tetrahedron,
    Point(usize),
    Line(usize),
    Surface(usize),
    Volume(&'static str),
}

/// The element types of the reference manual of Gmsh.
fn element_kind(kind: i32) -> Option<Kind> {
    Some(match kind {
        4 => Kind::Tetrahedron,
        15 => Kind::Point(1),
        1 => Kind::Line(2),
        8 => Kind::Line(3),
        26..=28 => Kind::Line(kind as usize - 22),
        2 => Kind::Surface(3),
        3 => Kind::Surface(4),
        9 => Kind::Surface(6),
        10 => Kind::Surface(9),
        16 => Kind::Surface(8),
        20 => Kind::Surface(9),
        21 => Kind::Surface(10),
        22 => Kind::Surface(12),
        23 | 24 => Kind::Surface(15),
        25 => Kind::Surface(21),
        11 => Kind::Volume("a second-order tetrahedron"),
        29..=31 => Kind::Volume("a tetrahedron of higher order"),
        5 | 12 | 17 | 92 | 93 => Kind::Volume("a hexahedron"),
        6 | 13 | 18 => Kind::Volume("a prism"),
        7 | 14 | 19 => Kind::Volume("a pyramid"),
        _ => return None,
    })
}
