//! Reads the triangles that Gmsh wrote: MSH 4.1 in ASCII, of second order.
use std::collections::HashMap;

use glam::DVec3;

use super::CadError;
use crate::geometry::Aabb;
use crate::mesh::read::text::{Lines, shown, words};

/// Number of Gmsh for a triangle with a node in the middle of each edge.
const TRIANGLE_6: u64 = 9;

/// The surfaces of a CAD model as triangles.
pub(super) struct Surface {
    /// Corners of triangles, and the middles of their edges, which lie on the curved surface.
    pub positions: Vec<DVec3>,
    /// By their numbers.
    pub faces: Vec<Face>,
    /// By their numbers.
    pub volumes: Vec<Volume>,
}

/// One surface of the model.
pub(super) struct Face {
    pub tag: i64,
    /// Corners. Gmsh orients the triangles of a solid outward.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle, the middles of its edges, beginning with the edge from corner 0 to 1.
    middles: Vec<[u32; 3]>,
}

/// One solid of the model.
pub(super) struct Volume {
    pub tag: i64,
    /// Its surfaces, as indices into those of the model.
    pub faces: Vec<usize>,
}

impl Surface {
    /// Largest distance between the middle of an edge on the curved surface and the straight edge.
    pub fn deviation(&self) -> f64 {
        let at = |v: u32| self.positions[v as usize];
        let mut largest = 0.0_f64;
        for face in &self.faces {
            for (t, m) in face.triangles.iter().zip(&face.middles) {
                for i in 0..3 {
                    let (a, b, middle) = (at(t[i]), at(t[(i + 1) % 3]), at(m[i]));
                    let edge = b - a;
                    let along = (edge.dot(middle - a) / edge.length_squared()).clamp(0.0, 1.0);
                    let along = if along.is_finite() { along } else { 0.0 };
                    largest = largest.max((a + along * edge).distance(middle));
                }
            }
        }
        largest
    }

    /// Length of the diagonal of the bounds.
    pub fn diagonal(&self) -> f64 {
        Aabb::of(&self.positions).extent().length()
    }
}

pub(super) fn read(bytes: &[u8]) -> Result<Surface, CadError> {
    let mut file = File { lines: Lines::new(bytes) };
    let (mut positions, mut nodes) = (Vec::new(), HashMap::new());
    let mut faces: Vec<Face> = Vec::new();
    let mut volumes = Vec::new();
    while let Some((_, line)) = file.lines.next() {
        match line.trim_ascii() {
            b"$Entities" => file.entities(&mut faces, &mut volumes)?,
            b"$Nodes" => file.nodes(&mut positions, &mut nodes)?,
            b"$Elements" => file.elements(&nodes, &mut faces)?,
            _ => {}
        }
    }
    Ok(Surface { positions, faces, volumes })
}

struct File<'a> {
    lines: Lines<'a>,
}

/// The numbers of a line.
type Numbers = Vec<f64>;

impl File<'_> {
    fn error(&self, found: impl Into<String>) -> CadError {
        CadError::Output { line: self.lines.number(), found: found.into() }
    }

    /// The next line, which has at least `least` numbers.
    fn numbers(&mut self, least: usize) -> Result<Numbers, CadError> {
        let Some((_, line)) = self.lines.next() else { return Err(self.error("the file ends")) };
        let number = |word: &[u8]| std::str::from_utf8(word).ok()?.parse().ok();
        let numbers: Option<Numbers> = words(line).map(number).collect();
        match numbers {
            Some(numbers) if numbers.len() >= least => Ok(numbers),
            _ => Err(self.error(format!("{} is not {least} numbers", shown(line)))),
        }
    }

    fn entities(&mut self, faces: &mut Vec<Face>, volumes: &mut Vec<Volume>) -> Result<(), CadError> {
        let counts = self.numbers(4)?;
        for _ in 0..counts[0] as u64 + counts[1] as u64 {
            self.numbers(1)?;
        }
        for _ in 0..counts[2] as u64 {
            let tag = self.numbers(1)?[0] as i64;
            faces.push(Face { tag, triangles: Vec::new(), middles: Vec::new() });
        }
        let by_tag: HashMap<i64, usize> = faces.iter().enumerate().map(|(i, face)| (face.tag, i)).collect();
        for _ in 0..counts[3] as u64 {
            // Number, bounds, physical groups, and the surfaces with a sign.
            let line = self.numbers(9)?;
            let groups = line[7] as usize;
            let around = line.get(8 + groups + 1..).ok_or_else(|| self.error("the line ends"))?;
            let mut own = Vec::new();
            for &tag in around {
                match by_tag.get(&(tag.abs() as i64)) {
                    // A face that bounds a solid from both sides is within it.
                    Some(face) if own.contains(face) => own.retain(|other| other != face),
                    Some(&face) => own.push(face),
                    None => return Err(self.error(format!("there is no surface {tag}"))),
                }
            }
            volumes.push(Volume { tag: line[0] as i64, faces: own });
        }
        Ok(())
    }

    fn nodes(&mut self, positions: &mut Vec<DVec3>, ids: &mut HashMap<u64, u32>) -> Result<(), CadError> {
        let blocks = self.numbers(4)?[0] as u64;
        for _ in 0..blocks {
            let count = self.numbers(4)?[3] as u64;
            let mut tags = Vec::new();
            for _ in 0..count {
                tags.push(self.numbers(1)?[0] as u64);
            }
            for tag in tags {
                let p = self.numbers(3)?;
                ids.insert(tag, positions.len() as u32);
                positions.push(DVec3::new(p[0], p[1], p[2]));
            }
        }
        Ok(())
    }

    fn elements(&mut self, nodes: &HashMap<u64, u32>, faces: &mut [Face]) -> Result<(), CadError> {
        let blocks = self.numbers(4)?[0] as u64;
        let by_tag: HashMap<i64, usize> = faces.iter().enumerate().map(|(i, face)| (face.tag, i)).collect();
        for _ in 0..blocks {
            let block = self.numbers(4)?;
            let face = (block[0] == 2.0).then(|| by_tag.get(&(block[1] as i64))).flatten();
            for _ in 0..block[3] as u64 {
                let Some(&face) = face else {
                    self.numbers(1)?;
                    continue;
                };
                if block[2] as u64 != TRIANGLE_6 {
                    return Err(self.error(format!("an element of type {}", block[2])));
                }
                let line = self.numbers(7)?;
                let mut ids = [0; 6];
                for (id, tag) in ids.iter_mut().zip(&line[1..]) {
                    let node = nodes.get(&(*tag as u64));
                    *id = *node.ok_or_else(|| self.error(format!("there is no node {tag}")))?;
                }
                let [a, b, c, ab, bc, ca] = ids;
                faces[face].triangles.push([a, b, c]);
                faces[face].middles.push([ab, bc, ca]);
            }
        }
        Ok(())
    }
}
