//! Building blocks of closed surfaces: rings, bands between them, and flat faces with holes.
//!
//! Neighbouring blocks share their vertices by number, so a surface without a missing block is
//! closed by construction. [`Surface::finish`] checks this, and that nothing overlaps.
use std::collections::VecDeque;

use spade::handles::{FixedFaceHandle, PossiblyOuterTag};
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};
use tesdf::glam::{DVec2, DVec3};
use tesdf::mesh::{Defect, Severity};
use tesdf::{SolidMesh, TriangleMesh};

use crate::error::PartError;

/// Vertex numbers of a closed curve, counter-clockwise seen from above (from +z), or of an open
/// one.
pub(crate) type Loop = Vec<u32>;

/// The direction that a level face looks to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Facing {
    Up,
    Down,
}

/// Most faces of a part: as many as a `.tesdf` file can have.
const MOST_FACES: f64 = (1 << 24) as f64;

/// A surface under construction.
pub(crate) struct Surface {
    part: &'static str,
    vertices: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
}

impl Surface {
    pub(crate) fn new(part: &'static str) -> Self {
        Self { part, vertices: Vec::new(), faces: Vec::new() }
    }

    pub(crate) fn vertex(&mut self, position: DVec3) -> u32 {
        self.vertices.push(position);
        (self.vertices.len() - 1) as u32
    }

    pub(crate) fn position(&self, vertex: u32) -> DVec3 {
        self.vertices[vertex as usize]
    }

    pub(crate) fn curve(&mut self, points: impl IntoIterator<Item = DVec3>) -> Loop {
        points.into_iter().map(|p| self.vertex(p)).collect()
    }

    /// A plane outline at the height `z`.
    pub(crate) fn outline(&mut self, outline: &[DVec2], z: f64) -> Loop {
        self.curve(outline.iter().map(|p| p.extend(z)))
    }

    /// A triangle. Triangles with a repeated corner, which blocks have at their ends, are left out.
    pub(crate) fn triangle(&mut self, a: u32, b: u32, c: u32) {
        if a != b && b != c && c != a {
            self.faces.push([a, b, c]);
        }
    }

    /// A strip between two open curves. It looks outwards when the curves run counter-clockwise
    /// around the part and `high` is above `low`.
    pub(crate) fn strip(&mut self, low: &[u32], high: &[u32]) {
        for (l, h) in low.windows(2).zip(high.windows(2)) {
            self.triangle(l[0], l[1], h[1]);
            self.triangle(l[0], h[1], h[0]);
        }
    }

    /// A band between two closed curves. It looks outwards when `high` is above `low`; the band of
    /// a bore takes its upper curve first.
    pub(crate) fn band(&mut self, low: &[u32], high: &[u32]) {
        self.strip(low, high);
        if let ([l0, .., l1], [h0, .., h1]) = (low, high) {
            self.strip(&[*l1, *l0], &[*h1, *h0]);
        }
    }

    /// A strip between two curves of different lengths, which takes the next vertex of the curve
    /// that is less far along. It looks outwards when both curves run upwards and `right` is
    /// counter-clockwise of `left`.
    pub(crate) fn zip(&mut self, left: &[u32], right: &[u32]) {
        let (mut i, mut j) = (0, 0);
        while i + 1 < left.len() || j + 1 < right.len() {
            let share = |k: usize, curve: &[u32]| (k + 1) as f64 / curve.len() as f64;
            let take_left = j + 1 == right.len() || (i + 1 < left.len() && share(i, left) <= share(j, right));
            if take_left {
                self.triangle(left[i], right[j], left[i + 1]);
                i += 1;
            } else {
                self.triangle(left[i], right[j], right[j + 1]);
                j += 1;
            }
        }
    }

    /// Triangles from a point to a closed curve.
    pub(crate) fn fan(&mut self, centre: DVec3, curve: &[u32], facing: Facing) {
        let centre = self.vertex(centre);
        for (i, &a) in curve.iter().enumerate() {
            let b = curve[(i + 1) % curve.len()];
            match facing {
                Facing::Up => self.triangle(centre, a, b),
                Facing::Down => self.triangle(centre, b, a),
            }
        }
    }

    /// A flat face in a level plane. The first curve is its outline, the others are holes.
    pub(crate) fn level(&mut self, facing: Facing, curves: &[&[u32]]) -> Result<(), PartError> {
        match facing {
            Facing::Up => self.flat(DVec3::X, DVec3::Y, curves),
            Facing::Down => self.flat(DVec3::Y, DVec3::X, curves),
        }
    }

    /// A flat face between closed curves. It looks to `u` × `v`. A point belongs to it when an odd
    /// number of curves goes around the point.
    pub(crate) fn flat(&mut self, u: DVec3, v: DVec3, curves: &[&[u32]]) -> Result<(), PartError> {
        let crossing = || PartError::Outlines { part: self.part };
        let mut net = ConstrainedDelaunayTriangulation::<Corner>::new();
        for curve in curves {
            let mut handles = Vec::with_capacity(curve.len());
            for &vertex in *curve {
                let p = self.position(vertex);
                let corner = Corner { vertex, position: Point2::new(p.dot(u), p.dot(v)) };
                handles.push(net.insert(corner).map_err(|_| crossing())?);
            }
            for (i, &from) in handles.iter().enumerate() {
                let to = handles[(i + 1) % handles.len()];
                // A side that passes through a vertex would be split, and no longer fit its band.
                if net.try_add_constraint(from, to).len() != 1 {
                    return Err(crossing());
                }
            }
        }
        if net.num_vertices() != curves.iter().map(|curve| curve.len()).sum::<usize>() {
            return Err(crossing());
        }
        for face in inside(&net) {
            let face = net.face(face);
            if let Some(face) = face.as_inner() {
                self.faces.push(face.vertices().map(|corner| corner.data().vertex));
            }
        }
        Ok(())
    }

    /// Turns all faces around that were added so far, for a surface that is built inside out.
    pub(crate) fn turn_over(&mut self) {
        for face in &mut self.faces {
            face.swap(1, 2);
        }
    }

    /// The side of a prism between two heights, looking outwards. Returns its lower and upper
    /// curve.
    pub(crate) fn prism(&mut self, outline: &[DVec2], low: f64, high: f64) -> [Loop; 2] {
        let loops = [low, high].map(|z| self.outline(outline, z));
        self.band(&loops[0], &loops[1]);
        loops
    }

    /// Checks a number of faces, before memory is taken for them or for their check.
    pub(crate) fn check_count(&self, faces: f64) -> Result<(), PartError> {
        match faces <= MOST_FACES {
            true => Ok(()),
            false => Err(PartError::TooFine { part: self.part, faces, limit: MOST_FACES }),
        }
    }

    /// Checks the surface: closed, oriented outwards, and free of overlaps.
    pub(crate) fn finish(self) -> Result<SolidMesh, PartError> {
        self.check_count(self.faces.len() as f64)?;
        let Self { part, vertices, faces } = self;
        let mesh = TriangleMesh::new(vertices, faces).map_err(|source| PartError::Mesh { part, source })?;
        let solid = SolidMesh::new(mesh).map_err(|source| PartError::NotSolid { part, source })?;
        if solid.is_simple() {
            return Ok(solid);
        }
        let first = |defect: &&Defect| defect.severity == Severity::Warning;
        let defect = solid.warnings().iter().find(first).or(solid.warnings().first());
        let defect = defect.map_or_else(String::new, |defect| defect.message.clone());
        Err(PartError::Overlap { part, defect })
    }
}

/// A corner of a flat face.
struct Corner {
    vertex: u32,
    position: Point2<f64>,
}

impl HasPosition for Corner {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.position
    }
}

/// The triangles that an odd number of curves goes around, by walking inwards from the outside.
fn inside(net: &ConstrainedDelaunayTriangulation<Corner>) -> Vec<FixedFaceHandle<PossiblyOuterTag>> {
    let mut parity = vec![None; net.num_all_faces()];
    let outer = net.outer_face().fix();
    parity[outer.index()] = Some(false);
    let mut next = VecDeque::from([outer]);
    let mut found = Vec::new();
    // The outer face has no list of its sides, so the walk begins at the hull.
    while let Some(face) = next.pop_front() {
        let here = parity[face.index()] == Some(true);
        if here {
            found.push(face);
        }
        let sides: Vec<_> = match net.face(face).as_inner() {
            Some(inner) => inner.adjacent_edges().to_vec(),
            None => net.convex_hull().collect(),
        };
        for side in sides {
            // A hull edge has the outer face on its own side.
            let across = if side.face().fix() == face { side.rev().face().fix() } else { side.face().fix() };
            let odd = here != side.is_constraint_edge();
            if parity[across.index()].is_none() {
                parity[across.index()] = Some(odd);
                next.push_back(across);
            }
        }
    }
    found
}
