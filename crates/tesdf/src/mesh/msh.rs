//! Reads Gmsh's MSH 2.2 and 4.1, ASCII and binary. Only the sections of entities, nodes and
//! elements are read. Memory is allocated for bytes that are there, and never by a count in a file.
use std::collections::{HashMap, HashSet};

use glam::DVec3;

mod cursor;

use super::Place;
use super::text::{shown, words};
use cursor::{Cursor, Encoding};

/// What is read of a file. Other elements are skipped and counted.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Wanted {
    /// Tetrahedra of four nodes. Other volumes are an error.
    Tetrahedra,
    /// The surfaces and volumes of a model in version 4.1, and triangles of second order. Other
    /// surface elements are an error.
    Surfaces,
}

/// The content of a file. Corners are valid indices of `nodes`.
#[derive(Default)]
pub(crate) struct Msh {
    /// Nodes, in the order of the file.
    pub nodes: Vec<DVec3>,
    /// Corners of the tetrahedra, in the order of the file.
    pub tetrahedra: Vec<[u32; 4]>,
    /// For each triangle the number of its surface, its corners, and the middles of its edges,
    /// beginning with the edge from corner 0 to 1.
    pub triangles: Vec<(i32, [u32; 6])>,
    /// Numbers of the surfaces of the model.
    pub surfaces: Vec<i32>,
    /// For each volume of the model its number, and the numbers of its surfaces, which may have a
    /// sign.
    pub volumes: Vec<(i32, Vec<i32>)>,
    /// Numbers of the skipped points, lines and surface elements.
    pub skipped: [usize; 3],
}

/// Why a file cannot be read.
pub(crate) enum MshError {
    /// The bytes do not follow the rules of the format.
    Malformed {
        /// The place in the file.
        place: Place,
        /// What was found there.
        found: String,
        /// What was expected, or what to do.
        help: String,
    },
    /// An element has a volume and is not a tetrahedron of four nodes.
    Volume {
        /// The place in the file.
        place: Place,
        /// The number of the element in the file.
        element: u64,
        /// The kind of the element, such as `a hexahedron`.
        kind: &'static str,
    },
}

type Result<T> = std::result::Result<T, MshError>;

#[derive(Clone, Copy, PartialEq)]
enum Version {
    V2,
    V41,
}

struct Reader<'a> {
    cursor: Cursor<'a>,
    version: Version,
    wanted: Wanted,
    /// The index of each node in `msh.nodes`.
    nodes: HashMap<u64, u32>,
    msh: Msh,
}

pub(crate) fn read(bytes: &[u8], wanted: Wanted) -> Result<Msh> {
    let mut cursor = Cursor::new(bytes);
    let version = header(&mut cursor)?;
    let mut reader = Reader { cursor, version, wanted, nodes: HashMap::new(), msh: Msh::default() };
    let mut has_elements = false;
    loop {
        reader.cursor.skip_space();
        match reader.cursor.rest_of_line() {
            b"" => break,
            b"$Entities" if wanted == Wanted::Surfaces => reader.entities()?,
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
    Ok(reader.msh)
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

    /// The surfaces and volumes of the model.
    fn entities(&mut self) -> Result<()> {
        let mut counts = [0; 4];
        for count in &mut counts {
            *count = self.cursor.size("the number of entities")?;
        }
        let mut surfaces = HashSet::new();
        for (dimension, count) in counts.into_iter().enumerate() {
            for _ in 0..count {
                let number = self.cursor.int("the number of an entity")?;
                // A point has its position, others have their bounds.
                for _ in 0..if dimension == 0 { 3 } else { 6 } {
                    self.cursor.double("a bound of an entity")?;
                }
                for _ in 0..self.cursor.size("the number of physical groups")? {
                    self.cursor.int("a physical group")?;
                }
                let mut around = Vec::new();
                for _ in 0..if dimension == 0 { 0 } else { self.cursor.size("the number of sides")? } {
                    around.push(self.cursor.int("a side of an entity")?);
                }
                match dimension {
                    2 => {
                        surfaces.insert(number);
                        self.msh.surfaces.push(number);
                    }
                    3 => match around.iter().find(|side| !surfaces.contains(&side.saturating_abs())) {
                        Some(side) => {
                            let found = format!("volume {number} has the surface {side}, which is not there");
                            return Err(self.cursor.error(found, "expected surfaces before volumes"));
                        }
                        None => self.msh.volumes.push((number, around)),
                    },
                    _ => {}
                }
            }
        }
        end(&mut self.cursor, b"$EndEntities")
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
        // Ids beyond 32 bits would need a file of 100 GB. Meshes have a limit below that.
        let at = self.msh.nodes.len() as u32;
        if self.nodes.insert(id, at).is_some() {
            return Err(self.cursor.error(format!("node {id} is there twice"), "expected different numbers"));
        }
        self.msh.nodes.push(p);
        Ok(())
    }

    fn elements(&mut self) -> Result<()> {
        match (self.version, self.cursor.encoding) {
            (Version::V2, Encoding::Ascii) => {
                for _ in 0..self.count("the number of elements")? {
                    let id = self.id("an element's number")?;
                    let kind = self.cursor.int("an element's type")?;
                    let tags = self.cursor.int("the number of tags")?;
                    self.element(id, kind, 0, tags)?;
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
                        self.element(id, kind, 0, tags)?;
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
                    let entity = self.cursor.int("the number of an entity")?;
                    let kind = self.cursor.int("an element type")?;
                    for _ in 0..self.cursor.size("the number of elements in a block")? {
                        let id = self.id("an element's number")?;
                        self.element(id, kind, entity, 0)?;
                    }
                }
            }
        }
        end(&mut self.cursor, b"$EndElements")
    }

    /// Reads the tags and the nodes of an element.
    fn element(&mut self, element: u64, kind: i32, entity: i32, tags: i32) -> Result<()> {
        for _ in 0..tags {
            self.cursor.int("a tag")?;
        }
        let (dimension, nodes) = match (element_kind(kind), self.wanted) {
            (Some(Kind::Tetrahedron), Wanted::Tetrahedra) => {
                let corners = self.corners(element)?;
                self.msh.tetrahedra.push(corners);
                return Ok(());
            }
            (Some(Kind::Surface(6)), Wanted::Surfaces) => {
                let corners = self.corners(element)?;
                self.msh.triangles.push((entity, corners));
                return Ok(());
            }
            (Some(Kind::Surface(_)), Wanted::Surfaces) => {
                let found = format!("element {element} is of type {kind}");
                return Err(self.cursor.error(found, "expected triangles of second order, type 9"));
            }
            (Some(Kind::Point(nodes)), _) => (0, nodes),
            (Some(Kind::Line(nodes)), _) => (1, nodes),
            (Some(Kind::Surface(nodes)), _) => (2, nodes),
            (Some(Kind::Tetrahedron), Wanted::Surfaces) => {
                return Err(MshError::Volume { place: self.cursor.place(), element, kind: "a tetrahedron" });
            }
            (Some(Kind::Volume(kind)), _) => {
                return Err(MshError::Volume { place: self.cursor.place(), element, kind });
            }
            (None, _) => {
                let found = format!("element {element} is of the unknown type {kind}");
                return Err(self.cursor.error(found, "expected tetrahedra, type 4"));
            }
        };
        self.msh.skipped[dimension] += 1;
        for _ in 0..nodes {
            self.id("a node of an element")?;
        }
        Ok(())
    }

    fn corners<const N: usize>(&mut self, element: u64) -> Result<[u32; N]> {
        let mut corners = [0; N];
        for corner in &mut corners {
            let node = self.id("a node of an element")?;
            *corner = *self.nodes.get(&node).ok_or_else(|| {
                let found = format!("element {element} uses node {node}, which is not in $Nodes");
                self.cursor.error(found, "expected nodes before the elements: is the file cut short?")
            })?;
        }
        Ok(corners)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle of second order on surface 5, which bounds volume 2.
    const MODEL: &str = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n1 0 1 1\n7 0 0 0 0\n\
        5 0 0 0 1 1 0 1 3 0\n2 0 0 0 1 1 1 0 1 -5\n$EndEntities\n$Nodes\n1 6 1 6\n2 5 0 6\n1\n2\n3\n4\n5\n6\n\
        0 0 0\n1 0 0\n0 1 0\n.5 0 0\n.5 .5 0\n0 .5 0\n$EndNodes\n$Elements\n1 1 1 1\n2 5 9 1\n1 1 2 3 4 5 6\n$EndElements\n";

    fn surfaces(text: &str) -> std::result::Result<Msh, String> {
        read(text.as_bytes(), Wanted::Surfaces).map_err(|e| match e {
            MshError::Malformed { place, found, help } => format!("{place}: {found}; {help}"),
            MshError::Volume { place, element, kind } => format!("{place}: element {element} is {kind}"),
        })
    }

    #[test]
    fn surfaces_of_a_model_are_read() {
        let msh = surfaces(MODEL).unwrap();
        assert_eq!((msh.surfaces, msh.volumes), (vec![5], vec![(2, vec![-5])]));
        assert_eq!((msh.triangles, msh.nodes.len()), (vec![(5, [0, 1, 2, 3, 4, 5])], 6));
        for (from, to, expected) in [
            (" 1 -5\n", " 1 -6\n", "line 8: volume 2 has the surface -6"),
            ("2 5 9 1", "2 5 2 1", "line 29: element 1 is of type 2"),
            ("2 5 9 1", "3 2 4 1", "line 29: element 1 is a tetrahedron"),
            ("1 2 3 4 5 6\n$End", "1 2 3 4 5 8\n$End", "line 29: element 1 uses node 8"),
        ] {
            let error = surfaces(&MODEL.replace(from, to)).map(|_| ()).unwrap_err();
            assert!(error.starts_with(expected), "{error}");
        }
    }

    /// Checks that a file that is cut short is refused, and that any count may have any value.
    #[test]
    fn cut_and_changed_models_are_refused() {
        for end in 0..MODEL.len() - 1 {
            assert!(surfaces(&MODEL[..end]).is_err(), "the first {end} bytes");
        }
        let words: Vec<&str> = MODEL.split_inclusive([' ', '\n']).collect();
        for (at, word) in words.iter().enumerate() {
            for huge in ["4294967295", "18446744073709551615", "-1"] {
                let mut changed = words.clone();
                let word = format!("{huge}{}", &word[word.len() - 1..]);
                changed[at] = &word;
                if let Ok(msh) = surfaces(&changed.concat()) {
                    assert!(msh.nodes.len() <= 6 && msh.triangles.len() <= 1);
                }
            }
        }
    }
}
