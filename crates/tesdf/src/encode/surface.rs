//! The mesh in the form that the encoder uses: triangles, edges, incident faces, and the parts that
//! a cell can need.

use std::cmp::Reverse;
use std::collections::HashMap;

use crate::base::Isa;
use crate::base::elementary;
use crate::geometry::{Feature, Triangle};
use crate::mesh::TriangleMesh;

/// Rounding margin of the rules, in the local frame, where the diagonal of the body is 0.5 to 1.
///
/// A computed distance has an error of a few 2^-53 of the size of the coordinates, which is the
/// side of the cube. A face is dropped only when another face is closer by more than this margin
/// times the side (at least 1). So rounding cannot make two faces drop each other.
pub const MARGIN: f64 = 4e-15;

/// A part of the surface whose distance a cell needs: a face, an edge or a vertex.
///
/// The order is: faces, then edges, then vertices, each by id.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Requirement(u32);

impl Requirement {
    /// The index: faces first, then edges, then vertices. It is below [`Surface::parts`].
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

/// The part that a [`Requirement`] names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// A face.
    Face(u32),
    /// An edge of [`Surface`].
    Edge(u32),
    /// A vertex.
    Vertex(u32),
}

/// How the filter treats faces that come near to a cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Touching {
    /// They are listed whatever the rules say, because the sign in a crossing cell is counted over
    /// them.
    Kept,
    /// They are treated like other faces: the borders of the cells lie on the surface and tell the
    /// sign.
    Ignored,
}

/// A mesh in the local frame, with the tables of the encoder: normals, edges, incident faces.
#[derive(Debug)]
pub struct Surface {
    /// Faces in the local frame.
    pub triangles: Vec<Triangle>,
    /// Vertex ids of each face.
    pub(crate) faces: Vec<[u32; 3]>,
    /// Edge ids of each face. Edge `k` joins the corners `k` and `k + 1`.
    pub(crate) edges: Vec<[u32; 3]>,
    edge_count: u32,
    /// Faces of each edge.
    edge_faces: Vec<Vec<u32>>,
    /// Faces of each vertex.
    vertex_faces: Vec<Vec<u32>>,
    /// Total area, local frame.
    pub(crate) area: f64,
    /// Longest edge of each face, local frame.
    longest: Vec<f64>,
    needleness: f64,
    /// A distance counts as less when it is less by this: [`MARGIN`] times the size of the domain.
    pub(crate) margin: f64,
    /// How the filter treats faces that come near to a cell.
    pub(crate) touching: Touching,
    /// The instruction set of the filter. The results do not depend on it.
    pub(crate) isa: Isa,
}

impl Surface {
    /// Makes the tables for a mesh that is in the local frame already. The domain has this `side`.
    pub fn new(mesh: &TriangleMesh, side: f64, touching: Touching) -> Self {
        let local = mesh.vertices();
        let faces = mesh.faces().to_vec();
        let triangles: Vec<Triangle> =
            faces.iter().map(|f| Triangle::new(f.map(|v| local[v as usize]))).collect();
        let mut ids = HashMap::with_capacity(faces.len() * 3 / 2);
        let mut edge_faces: Vec<Vec<u32>> = Vec::new();
        let mut edges = Vec::with_capacity(faces.len());
        for (face, corners) in faces.iter().enumerate() {
            edges.push(std::array::from_fn(|k| {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                let key = [a.min(b), a.max(b)];
                let id = *ids.entry(key).or_insert_with(|| {
                    edge_faces.push(Vec::with_capacity(2));
                    edge_faces.len() as u32 - 1
                });
                edge_faces[id as usize].push(face as u32);
                id
            }));
        }
        let mut vertex_faces: Vec<Vec<u32>> = vec![Vec::new(); local.len()];
        for (face, corners) in faces.iter().enumerate() {
            for &v in corners {
                vertex_faces[v as usize].push(face as u32);
            }
        }
        let area: f64 = triangles
            .iter()
            .map(|t| 0.5 * (t.corners[1] - t.corners[0]).cross(t.corners[2] - t.corners[0]).length())
            .sum();
        let sum: f64 = triangles.iter().map(longest_edge).sum();
        Self {
            needleness: sum / (area * faces.len() as f64).sqrt(),
            longest: triangles.iter().map(longest_edge).collect(),
            triangles,
            faces,
            edges,
            edge_count: edge_faces.len() as u32,
            edge_faces,
            vertex_faces,
            area,
            margin: MARGIN * side.max(1.0),
            touching,
            isa: Isa::detect(),
        }
    }

    /// Length of the longest edge of a face, local frame.
    pub(crate) fn longest(&self, face: u32) -> f64 {
        self.longest[face as usize]
    }

    /// How needle-like the faces are: their mean longest edge over the root of their mean area.
    ///
    /// It is 1.5 for a mesh of equilateral triangles, 2 to 4 for most meshes, and 14 for a gear of
    /// 20,000 faces that are each as long as the gear is thick.
    pub(crate) fn needleness(&self) -> f64 {
        self.needleness
    }

    /// The face with the largest ratio of longest edge to height, and the ratio. Of equal faces it
    /// is the first.
    pub(crate) fn most_slender(&self) -> (u32, f64) {
        let slenderness = |face: usize| {
            let [a, b, c] = self.triangles[face].corners;
            elementary::powi(self.longest[face], 2) / (b - a).cross(c - a).length()
        };
        let faces = (0..self.faces.len()).map(|face| (face as u32, slenderness(face)));
        faces.fold((0, 0.0), |most, next| if next.1 > most.1 { next } else { most })
    }

    /// The requirement that names a feature of a face.
    pub(crate) fn requirement(&self, face: u32, feature: Feature) -> Requirement {
        let (f, e) = (self.faces.len() as u32, self.edge_count);
        Requirement(match feature {
            Feature::Face => face,
            Feature::Edge(k) => f + self.edges[face as usize][k as usize],
            Feature::Vertex(k) => f + e + self.faces[face as usize][k as usize],
        })
    }

    /// The number of requirements: faces, edges and vertices.
    pub(crate) fn parts(&self) -> usize {
        self.faces.len() + self.edge_faces.len() + self.vertex_faces.len()
    }

    /// The part that a requirement names.
    pub(crate) fn part(&self, requirement: Requirement) -> Part {
        let (f, e) = (self.faces.len() as u32, self.edge_count);
        match requirement.0 {
            id if id < f => Part::Face(id),
            id if id < f + e => Part::Edge(id - f),
            id => Part::Vertex(id - f - e),
        }
    }

    /// Number of vertices.
    pub(crate) fn vertex_count(&self) -> usize {
        self.vertex_faces.len()
    }

    /// The faces of an edge.
    pub(crate) fn edge_faces(&self, edge: u32) -> &[u32] {
        &self.edge_faces[edge as usize]
    }

    /// The faces around a vertex.
    pub(crate) fn vertex_faces(&self, vertex: u32) -> &[u32] {
        &self.vertex_faces[vertex as usize]
    }

    /// Whether a requirement is a whole face.
    pub(crate) fn is_face(&self, requirement: Requirement) -> bool {
        requirement.0 < self.faces.len() as u32
    }

    /// Whether `face` holds the feature that `requirement` names.
    pub(crate) fn holds(&self, face: u32, requirement: Requirement) -> bool {
        match self.part(requirement) {
            Part::Face(f) => f == face,
            Part::Edge(e) => self.edges[face as usize].contains(&e),
            Part::Vertex(v) => self.faces[face as usize].contains(&v),
        }
    }

    /// The edges and corners of a face.
    pub(crate) fn implied(&self, face: u32) -> [Requirement; 6] {
        let [a, b, c] = [0, 1, 2].map(|k| self.requirement(face, Feature::Edge(k)));
        let [d, e, f] = [0, 1, 2].map(|k| self.requirement(face, Feature::Vertex(k)));
        [a, b, c, d, e, f]
    }

    /// Chooses few faces that hold all of `requirements`, greedily. `requirements` is sorted, and
    /// may contain an entry several times. The result is ascending.
    ///
    /// Required faces are taken as they are. Then each edge that no chosen face has takes, of its
    /// faces, the face that has most of the open requirements. Then vertices do likewise.
    pub(crate) fn cover(&self, requirements: &[Requirement]) -> Vec<u32> {
        let first_part = requirements.partition_point(|&r| self.is_face(r));
        let mut kept: Vec<u32> = requirements[..first_part].iter().map(|r| r.0).collect();
        let whole = kept.len();
        let mut open = Open::default();
        for asked in requirements[first_part..].chunk_by(|a, b| a == b) {
            let faces = self.faces_of(asked[0]);
            // The whole faces are in ascending order too.
            let held = if faces.len() < whole {
                faces.iter().any(|face| kept.binary_search(face).is_ok())
            } else {
                kept.iter().any(|&face| self.holds(face, asked[0]))
            };
            if !held {
                open.parts.push(asked[0]);
                open.times.push(asked.len());
            }
        }
        for first in 0..open.parts.len() {
            if open.times[first] == 0 {
                continue;
            }
            let Some(best) = self.most_shared(&open, first) else { break };
            kept.push(best);
            for r in self.implied(best) {
                if let Ok(at) = open.parts.binary_search(&r) {
                    open.times[at] = 0;
                }
            }
        }
        kept.sort_unstable();
        kept
    }

    /// Of the faces that hold the part at `first`, the face that holds most of the open
    /// requirements. Of equal faces it is the lowest.
    fn most_shared(&self, open: &Open, first: usize) -> Option<u32> {
        let part = open.parts[first];
        let own = self.faces_of(part);
        if own.len() <= SMALL_FAN {
            let times = |r: &Requirement| open.parts.binary_search(r).map_or(0, |at| open.times[at]);
            let gain = |face: u32| self.implied(face).iter().map(times).sum::<usize>();
            return own.iter().copied().max_by_key(|&f| (gain(f), Reverse(f)));
        }
        // Few of these faces hold anything else, so they are found from the other open parts.
        // Earlier parts are no longer open.
        let others = open.parts.iter().zip(&open.times).skip(first + 1).filter(|(_, times)| **times > 0);
        let mut shared: Vec<(u32, usize)> = others
            .flat_map(|(&other, &times)| self.faces_of(other).iter().map(move |&face| (face, times)))
            .filter(|&(face, _)| self.holds(face, part))
            .collect();
        shared.sort_unstable();
        let gains =
            shared.chunk_by(|a, b| a.0 == b.0).map(|run| (run[0].0, run.iter().map(|s| s.1).sum::<usize>()));
        gains
            .max_by_key(|&(face, gain)| (gain, Reverse(face)))
            .map_or(own.first().copied(), |(face, _)| Some(face))
    }

    /// The faces that hold an edge or a vertex, ascending. Empty for a face.
    pub(crate) fn faces_of(&self, requirement: Requirement) -> &[u32] {
        match self.part(requirement) {
            Part::Face(_) => &[],
            Part::Edge(e) => &self.edge_faces[e as usize],
            Part::Vertex(v) => &self.vertex_faces[v as usize],
        }
    }
}

/// Edges and vertices that no chosen face has yet.
#[derive(Default)]
struct Open {
    /// The parts, ascending, each once.
    parts: Vec<Requirement>,
    /// How often each part is asked for. 0 once a chosen face has it.
    times: Vec<usize>,
}

/// In a fan of up to this many faces, each face is asked what else it holds.
const SMALL_FAN: usize = 32;

fn longest_edge(t: &Triangle) -> f64 {
    let [a, b, c] = t.corners;
    a.distance(b).max(b.distance(c)).max(c.distance(a))
}
