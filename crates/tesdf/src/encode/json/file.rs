//! The keys of a file, and what is in it.
use glam::DVec3;

use crate::base::Side;

/// Keys of the positions: of the surface, inside of it, outside of it. Ids of vertices count over
/// the three in this order.
pub const NODES: [&str; 3] = ["surface_nodes", "inner_nodes", "outer_nodes"];
/// Key of the faces: ids of surface nodes, counterclockwise seen from outside.
pub const FACES: &str = "faces";
/// The groups of tetrahedra: those with a surface node inside, the others inside, those with a
/// surface node outside, the others outside.
pub const GROUPS: [Group; 4] = [
    Group {
        tetrahedra: "surface_inner_tetras",
        lengths: "nums_of_encoded_faces_surface_inner",
        lists: "encoded_faces_surface_inner",
        side: Side::Inside,
    },
    Group {
        tetrahedra: "inner_tetras",
        lengths: "nums_of_encoded_faces_inner",
        lists: "encoded_faces_inner",
        side: Side::Inside,
    },
    Group {
        tetrahedra: "surface_outer_tetras",
        lengths: "nums_of_encoded_faces_surface_outer",
        lists: "encoded_faces_surface_outer",
        side: Side::Outside,
    },
    Group {
        tetrahedra: "outer_tetras",
        lengths: "nums_of_encoded_faces_outer",
        lists: "encoded_faces_outer",
        side: Side::Outside,
    },
];
/// What the key of an array has before it in the key of its number of elements.
pub const COUNT: &str = "num_of_";

/// The keys of a group of tetrahedra.
pub struct Group {
    /// Corners, ids of vertices.
    pub tetrahedra: &'static str,
    /// Length of the list of each tetrahedron.
    pub lengths: &'static str,
    /// The lists, one after the other: places in [`FACES`].
    pub lists: &'static str,
    /// Where the tetrahedra are.
    pub side: Side,
}

/// What is in a file. Every id is in range, and each tetrahedron has a list that is not empty.
pub struct Encoded {
    /// Positions of all vertices.
    pub vertices: Vec<DVec3>,
    /// How many of them are of the surface. They come first.
    pub surface_vertices: usize,
    /// The faces.
    pub faces: Vec<[u32; 3]>,
    /// The tetrahedra of all groups, one group after the other.
    pub tetrahedra: Vec<[u32; 4]>,
    /// Number of tetrahedra of each group.
    pub group_sizes: [usize; 4],
    /// For each tetrahedron the faces of its list, ascending, each once.
    pub lists: Vec<Vec<u32>>,
}

impl Encoded {
    /// The group of a tetrahedron, and its place in the group.
    pub fn place(&self, tetrahedron: usize) -> (&'static Group, usize) {
        let mut at = tetrahedron;
        for (group, &size) in GROUPS.iter().zip(&self.group_sizes) {
            if at < size {
                return (group, at);
            }
            at -= size;
        }
        (&GROUPS[3], at)
    }
}
