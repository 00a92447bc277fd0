use std::ops::Range;

/// Connectivity of a mesh: its edges, the faces on each edge, and connected components.
///
/// Faces with two equal corners are left out. Such a face uses each of its edges once in both
/// directions or not at all, so leaving it out changes no balance.
#[derive(Clone, Debug)]
pub struct Topology {
    faces: Vec<[u32; 3]>,
    edges: Vec<Edge>,
    uses: Vec<EdgeUse>,
}

/// An undirected edge.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edge {
    /// Its two vertices, lower first, 0-based.
    pub vertices: [u32; 2],
    uses: Range<u32>,
    /// Number of faces that run from the lower vertex to the higher.
    pub forward: u32,
    /// Number of faces that run from the higher vertex to the lower.
    pub backward: u32,
}

/// The use of an edge by one face.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EdgeUse {
    /// Face, 0-based.
    pub face: u32,
    /// Whether the face runs from the lower vertex to the higher.
    pub forward: bool,
}

impl Edge {
    /// Whether as many faces run along the edge in one direction as in the other. The winding
    /// number is an integer everywhere exactly when all edges are balanced.
    pub fn is_balanced(&self) -> bool {
        self.forward == self.backward
    }

    /// Whether the edge has exactly two faces, and they run along it in opposite directions.
    pub fn is_manifold(&self) -> bool {
        (self.forward, self.backward) == (1, 1)
    }

    /// Number of faces on the edge.
    pub fn face_count(&self) -> u32 {
        self.forward + self.backward
    }
}

impl Topology {
    /// Component number of a face with two equal corners.
    pub const NO_COMPONENT: u32 = u32::MAX;

    /// Finds the edges of `faces`. The edges are ordered by their vertices.
    pub fn new(faces: &[[u32; 3]]) -> Self {
        let mut half_edges = Vec::with_capacity(3 * faces.len());
        for (f, corners) in faces.iter().enumerate().filter(|(_, c)| !has_repeated_corner(**c)) {
            for k in 0..3 {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                half_edges.push((a.min(b), a.max(b), f as u32, a < b));
            }
        }
        half_edges.sort_unstable();
        let mut edges: Vec<Edge> = Vec::with_capacity(half_edges.len() / 2);
        let mut uses = Vec::with_capacity(half_edges.len());
        for (a, b, face, forward) in half_edges {
            let at = uses.len() as u32;
            if edges.last().is_none_or(|e| e.vertices != [a, b]) {
                edges.push(Edge { vertices: [a, b], uses: at..at, forward: 0, backward: 0 });
            }
            uses.push(EdgeUse { face, forward });
            if let Some(edge) = edges.last_mut() {
                edge.uses.end = at + 1;
                *(if forward { &mut edge.forward } else { &mut edge.backward }) += 1;
            }
        }
        Self { faces: faces.to_vec(), edges, uses }
    }

    /// The edges, ordered by their vertices.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// The edge between two vertices, given the lower one first.
    pub fn edge(&self, vertices: [u32; 2]) -> Option<&Edge> {
        let found = self.edges.binary_search_by(|edge| edge.vertices.cmp(&vertices)).ok()?;
        self.edges.get(found)
    }

    /// The faces on an edge of this mesh, ordered by face.
    pub fn uses(&self, edge: &Edge) -> &[EdgeUse] {
        &self.uses[edge.uses.start as usize..edge.uses.end as usize]
    }

    /// Whether all edges are balanced; see [`Edge::is_balanced`].
    pub fn is_closed(&self) -> bool {
        self.edges.iter().all(Edge::is_balanced)
    }

    /// The component number of each face, and the number of components. Faces are connected over
    /// the edges that `across` accepts. Components are numbered by their lowest face. Faces with a
    /// repeated corner have [`NO_COMPONENT`](Self::NO_COMPONENT).
    pub fn components(&self, across: impl Fn(&Edge) -> bool) -> (Vec<u32>, usize) {
        let mut sets = DisjointSets::new(self.faces.len());
        for edge in self.edges.iter().filter(|e| across(e)) {
            for pair in self.uses(edge).windows(2) {
                sets.join(pair[0].face, pair[1].face);
            }
        }
        let mut number = vec![Self::NO_COMPONENT; self.faces.len()];
        let mut count = 0;
        let component = |f: usize| {
            if has_repeated_corner(self.faces[f]) {
                return Self::NO_COMPONENT;
            }
            let root = sets.find(f as u32) as usize;
            if number[root] == Self::NO_COMPONENT {
                number[root] = count;
                count += 1;
            }
            number[root]
        };
        ((0..self.faces.len()).map(component).collect(), count as usize)
    }

    /// Number of fans around each vertex. A fan is a group of faces of the vertex that are
    /// connected over edges at the vertex. An unused vertex has 0 fans, a vertex of a manifold 1.
    pub fn fans(&self, vertices: usize) -> Vec<u32> {
        let corner_of = |face: u32, v: u32| {
            let k = self.faces[face as usize].iter().position(|&w| w == v).unwrap_or(0);
            3 * face + k as u32
        };
        let mut sets = DisjointSets::new(3 * self.faces.len());
        for edge in &self.edges {
            for pair in self.uses(edge).windows(2) {
                for v in edge.vertices {
                    sets.join(corner_of(pair[0].face, v), corner_of(pair[1].face, v));
                }
            }
        }
        let mut fans = vec![0; vertices];
        for (f, corners) in self.faces.iter().enumerate().filter(|(_, c)| !has_repeated_corner(**c)) {
            for (k, &v) in corners.iter().enumerate() {
                let corner = (3 * f + k) as u32;
                fans[v as usize] += u32::from(sets.find(corner) == corner);
            }
        }
        fans
    }

    /// Finds the faces to reverse so that the two faces of every edge with exactly two faces run
    /// along it in opposite directions. Returns a flag for each face, and the conflicting edges.
    ///
    /// In each component the fewest possible faces are reversed. In a component without an
    /// orientation (a non-orientable surface) no face is reversed, and the lowest conflicting edge
    /// is returned.
    pub fn consistent_orientation(&self) -> (Vec<bool>, Vec<usize>) {
        let mut across = vec![Vec::new(); self.faces.len()];
        for (e, edge) in self.edges.iter().enumerate().filter(|(_, e)| e.face_count() == 2) {
            if let [u, v] = *self.uses(edge) {
                across[u.face as usize].push((v.face, u.forward == v.forward, e));
                across[v.face as usize].push((u.face, u.forward == v.forward, e));
            }
        }
        let mut reversed: Vec<Option<bool>> = vec![None; self.faces.len()];
        let mut conflicts = Vec::new();
        for first in 0..self.faces.len() {
            if reversed[first].is_some() {
                continue;
            }
            reversed[first] = Some(false);
            let mut component = vec![first];
            let mut conflict: Option<usize> = None;
            let mut next = 0;
            while next < component.len() {
                let face = component[next];
                next += 1;
                for &(other, same, edge) in &across[face] {
                    let expected = Some((reversed[face] == Some(true)) != same);
                    match reversed[other as usize] {
                        None => {
                            reversed[other as usize] = expected;
                            component.push(other as usize);
                        }
                        found if found != expected => conflict = Some(conflict.map_or(edge, |c| c.min(edge))),
                        Some(_) => {}
                    }
                }
            }
            let count = component.iter().filter(|&&f| reversed[f] == Some(true)).count();
            if let Some(edge) = conflict {
                conflicts.push(edge);
                component.iter().for_each(|&f| reversed[f] = Some(false));
            } else if 2 * count > component.len() {
                component.iter().for_each(|&f| reversed[f] = reversed[f].map(|r| !r));
            }
        }
        (reversed.into_iter().map(|r| r == Some(true)).collect(), conflicts)
    }
}

/// Whether two corners of a face are the same vertex.
pub fn has_repeated_corner([a, b, c]: [u32; 3]) -> bool {
    a == b || b == c || c == a
}

/// Disjoint sets (union-find). The representative of a set is its lowest member.
#[derive(Clone, Debug)]
pub struct DisjointSets(Vec<u32>);

impl DisjointSets {
    /// `n` sets with one member each.
    pub fn new(n: usize) -> Self {
        Self((0..n as u32).collect())
    }

    /// The lowest member of the set of `i`.
    pub fn find(&mut self, i: u32) -> u32 {
        let mut i = i;
        while self.0[i as usize] != i {
            self.0[i as usize] = self.0[self.0[i as usize] as usize];
            i = self.0[i as usize];
        }
        i
    }

    /// Unites the sets of `i` and `j`.
    pub fn join(&mut self, i: u32, j: u32) {
        let (i, j) = (self.find(i), self.find(j));
        self.0[i.max(j) as usize] = i.min(j);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TETRAHEDRON: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];

    #[test]
    fn a_tetrahedron_is_closed_and_connected() {
        let t = Topology::new(&TETRAHEDRON);
        assert_eq!(t.edges().len(), 6);
        assert!(t.is_closed() && t.edges().iter().all(Edge::is_manifold));
        assert_eq!(t.components(Edge::is_manifold), (vec![0; 4], 1));
        assert_eq!(t.fans(5), [1, 1, 1, 1, 0]);
        assert_eq!(t.consistent_orientation(), (vec![false; 4], vec![]));
    }

    #[test]
    fn a_reversed_face_is_found() {
        let mut faces = TETRAHEDRON;
        faces[2].swap(0, 1);
        let t = Topology::new(&faces);
        assert!(!t.is_closed());
        assert_eq!(t.consistent_orientation(), (vec![false, false, true, false], vec![]));
    }

    #[test]
    fn a_moebius_strip_has_no_orientation() {
        let faces: Vec<[u32; 3]> = (0..5).map(|i| [i, (i + 1) % 5, (i + 2) % 5]).collect();
        let (reversed, conflicts) = Topology::new(&faces).consistent_orientation();
        assert_eq!((reversed, conflicts.len()), (vec![false; 5], 1));
    }

    #[test]
    fn faces_with_repeated_corners_are_left_out() {
        let mut faces = TETRAHEDRON.to_vec();
        faces.extend([[0, 0, 1], [2, 2, 2]]);
        let t = Topology::new(&faces);
        assert!(t.is_closed());
        assert_eq!(t.edges().len(), 6);
        assert_eq!(t.components(Edge::is_manifold).0[4..], [Topology::NO_COMPONENT; 2]);
    }

    #[test]
    fn two_fans_where_tetrahedra_touch_in_a_vertex() {
        let mut faces = TETRAHEDRON.to_vec();
        faces.extend(TETRAHEDRON.map(|f| f.map(|v| if v == 0 { 0 } else { v + 3 })));
        let t = Topology::new(&faces);
        assert_eq!(t.fans(7), [2, 1, 1, 1, 1, 1, 1]);
        assert_eq!(t.components(Edge::is_manifold).1, 2);
    }
}
