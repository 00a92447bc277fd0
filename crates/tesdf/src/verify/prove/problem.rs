//! What must be proved in one cell: the list, and the nearby faces, edges and vertices that the
//! list does not hold.
use std::collections::{HashMap, HashSet};

use glam::DVec3;

use super::exact::U;
use super::parts::{Edge, Face, Part, rounding};
use super::surface::Surface;

/// A part of the surface, by its kind and index in a [`Problem`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Item {
    /// A vertex.
    Vertex(u32),
    /// An edge.
    Edge(u32),
    /// A face.
    Face(u32),
}

/// A face that is not in the list.
pub struct OpenFace {
    /// Its index in the file.
    pub position: u32,
    /// The face, relative to the centroid of the cell.
    pub shape: Face,
    /// Its edges. An edge whose ends are one point is a vertex.
    pub border: [Item; 3],
}

/// What must be proved in one cell. All points are relative to its centroid.
pub struct Problem {
    /// The faces of the list.
    pub list: Vec<Face>,
    /// The faces near the cell that are not in the list.
    pub faces: Vec<OpenFace>,
    /// The edges of `faces`.
    pub edges: Vec<Edge>,
    /// Ends of the edges, as indices into `vertices`.
    pub ends: Vec<[u32; 2]>,
    /// The vertices of `faces`.
    pub vertices: Vec<DVec3>,
    /// For each edge, the faces around it.
    pub around_edge: Vec<Vec<Item>>,
    /// For each vertex, the edges and faces around it.
    pub around_vertex: Vec<Vec<Item>>,
    /// Items that are part of a face of the list.
    pub held: Vec<Item>,
    /// Bound of the error of a distance.
    pub error: f64,
    /// Largest accepted difference between the distances of the list and of a face.
    pub delta: f64,
    /// A point this far inside a region still counts as outside, at this cost.
    pub touch: f64,
    /// Only points nearer to the surface than this are proved.
    pub within: f64,
}

/// A face whose height is at most this fraction of `delta` counts as its edges.
const THIN: f64 = 1.0 / 64.0;

impl Problem {
    /// The problem of a cell. `corners` are relative to its centroid `middle`. `near` are the faces
    /// that can be closest in it.
    pub fn new(
        surface: &Surface,
        middle: DVec3,
        corners: &[DVec3; 4],
        list: &[u32],
        near: &[u32],
        delta: f64,
        within: f64,
    ) -> Self {
        let local = |v: u32| surface.points[v as usize] - middle;
        let of = |&face: &u32| surface.faces[face as usize];
        let mut reach = corners.iter().map(|c| c.length()).fold(0.0, f64::max);
        reach += near.iter().chain(list).flat_map(of).map(|v| local(v).length()).fold(0.0, f64::max);
        let error = rounding(reach * (1.0 + 16.0 * U));
        let thin = THIN * delta;
        let mut problem = Self {
            list: list.iter().map(|f| Face::new(of(f).map(local), thin)).collect(),
            faces: Vec::new(),
            edges: Vec::new(),
            ends: Vec::new(),
            vertices: Vec::new(),
            around_edge: Vec::new(),
            around_vertex: Vec::new(),
            held: Vec::new(),
            error,
            delta,
            touch: 2.0 * error + delta / 64.0,
            within,
        };
        let held = Held::new(list.iter().map(of));
        let mut places = Places::default();
        for face in near {
            let corners = of(face);
            if !held.faces.contains(&sorted(corners)) {
                problem.add_face(*face, corners, &local, thin, &held, &mut places);
            }
        }
        problem
    }

    fn add_face(
        &mut self,
        position: u32,
        corners: [u32; 3],
        local: &impl Fn(u32) -> DVec3,
        thin: f64,
        held: &Held,
        places: &mut Places,
    ) {
        let face = Item::Face(self.faces.len() as u32);
        let vertices = corners.map(|v| self.vertex(v, local, held, places));
        let border = [0, 1, 2].map(|k| {
            let next = (k + 1) % 3;
            if corners[k] == corners[next] {
                return Item::Vertex(vertices[k]);
            }
            let key = pair(corners[k], corners[next]);
            let at = *places.edges.entry(key).or_insert_with(|| {
                let at = self.edges.len() as u32;
                let ends = if key == [corners[k], corners[next]] { [k, next] } else { [next, k] };
                self.edges.push(Edge::new(key.map(local)));
                self.ends.push(ends.map(|end| vertices[end]));
                self.around_edge.push(Vec::new());
                ends.iter().for_each(|&end| self.around_vertex[vertices[end] as usize].push(Item::Edge(at)));
                if held.edges.contains(&key) {
                    self.held.push(Item::Edge(at));
                }
                at
            });
            self.around_edge[at as usize].push(face);
            Item::Edge(at)
        });
        vertices.iter().for_each(|&v| self.around_vertex[v as usize].push(face));
        self.faces.push(OpenFace { position, shape: Face::new(corners.map(local), thin), border });
    }

    fn vertex(&mut self, v: u32, local: &impl Fn(u32) -> DVec3, held: &Held, places: &mut Places) -> u32 {
        *places.vertices.entry(v).or_insert_with(|| {
            let at = self.vertices.len() as u32;
            self.vertices.push(local(v));
            self.around_vertex.push(Vec::new());
            if held.vertices.contains(&v) {
                self.held.push(Item::Vertex(at));
            }
            at
        })
    }

    /// Number of items of all kinds.
    pub fn items(&self) -> usize {
        self.vertices.len() + self.edges.len() + self.faces.len()
    }

    /// The index of an item among the items of all kinds.
    pub fn place(&self, item: Item) -> usize {
        match item {
            Item::Vertex(at) => at as usize,
            Item::Edge(at) => self.vertices.len() + at as usize,
            Item::Face(at) => self.vertices.len() + self.edges.len() + at as usize,
        }
    }

    /// The set of points of an item.
    pub fn part(&self, item: Item) -> Part<'_> {
        match item {
            Item::Vertex(at) => Part::Vertex(&self.vertices[at as usize]),
            Item::Edge(at) => Part::Edge(&self.edges[at as usize]),
            Item::Face(at) => Part::Face(&self.faces[at as usize].shape),
        }
    }
}

/// Indices, in a problem, of the vertices and edges of the surface.
#[derive(Default)]
struct Places {
    vertices: HashMap<u32, u32>,
    edges: HashMap<[u32; 2], u32>,
}

/// Faces, edges and vertices that the list holds.
struct Held {
    faces: HashSet<[u32; 3]>,
    edges: HashSet<[u32; 2]>,
    vertices: HashSet<u32>,
}

impl Held {
    fn new(faces: impl Iterator<Item = [u32; 3]>) -> Self {
        let mut held = Self { faces: HashSet::new(), edges: HashSet::new(), vertices: HashSet::new() };
        for corners in faces {
            held.faces.insert(sorted(corners));
            for k in 0..3 {
                held.edges.insert(pair(corners[k], corners[(k + 1) % 3]));
                held.vertices.insert(corners[k]);
            }
        }
        held
    }
}

fn pair(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn sorted(mut corners: [u32; 3]) -> [u32; 3] {
    corners.sort_unstable();
    corners
}
