use bytemuck::Pod;
use tesdf::TeSdf;
use tesdf::asset::layout::{self, List, Node};
use tesdf::domain::{Cell, DomainCube};
use tesdf::geometry::internal::LocalFrame;
use tesdf::glam::DVec3;

use super::random::Random;

/// A leaf of the forest.
pub struct Located {
    pub cell: Cell,
    pub node: Node,
    /// Faces of the list by their index in the file, in stored order.
    pub positions: Vec<u32>,
    /// Faces of the list by their ids in the source.
    pub faces: Vec<u32>,
}

/// The cells of an asset, decoded from its sections alone.
pub struct Cells {
    pub frame: LocalFrame,
    pub cube: DomainCube,
    pub leaves: Vec<Located>,
    nodes: Vec<u32>,
    lists: Vec<u8>,
    /// For each word of the forest, its leaf.
    leaf_of: Vec<Option<u32>>,
}

pub fn section<T: Pod>(asset: &TeSdf, spec: tesdf::asset::SectionSpec) -> Vec<T> {
    asset.container().section(spec.name).expect("typed as written").map_or(Vec::new(), <[T]>::to_vec)
}

impl Cells {
    pub fn of(asset: &TeSdf) -> Self {
        let placed: Vec<f64> = section(asset, layout::FRAME);
        let v = |k: usize| DVec3::from_slice(&placed[k..]);
        let nodes: Vec<u32> = section(asset, layout::NODES);
        let mut cells = Self {
            frame: LocalFrame::new(v(0), placed[3]),
            cube: DomainCube::new(v(4), placed[7]),
            leaves: Vec::new(),
            leaf_of: vec![None; nodes.len()],
            nodes,
            lists: section(asset, layout::LISTS),
        };
        let lists = Lists {
            starts: section(asset, layout::PALETTE_STARTS),
            low: section(asset, layout::PALETTES),
            high: section(asset, layout::PALETTES_HIGH),
            ids: section(asset, layout::FACE_IDS),
        };
        let mut reached = vec![false; cells.nodes.len()];
        for root in 0..6 {
            cells.read(root, cells.cube.root(root), &lists, &mut reached);
        }
        assert!(reached.iter().all(|r| *r), "words that nothing leads to");
        cells
    }

    fn read(&mut self, word: usize, cell: Cell, lists: &Lists, reached: &mut [bool]) {
        assert!(!std::mem::replace(&mut reached[word], true), "word {word} is reached twice");
        let node = Node::decode(self.nodes[word], &self.lists);
        let positions = match node {
            Node::Split(children) => {
                let halves = [cell.child(0), cell.child(1)];
                assert!(
                    halves.iter().all(|h| h.volume() == 0.5 * cell.volume()),
                    "children do not halve {cell:?}"
                );
                for (side, half) in halves.into_iter().enumerate() {
                    self.read(children as usize + side, half, lists, reached);
                }
                return;
            }
            Node::Listed(_, offset) => lists.positions(List::decode(&self.lists, offset).expect("a list")),
            Node::Far(_) | Node::NotOfDomain => Vec::new(),
        };
        self.leaf_of[word] = Some(self.leaves.len() as u32);
        let faces = positions.iter().map(|&p| lists.ids[p as usize]).collect();
        self.leaves.push(Located { cell, node, positions, faces });
    }

    /// The cell that point location finds. `p` is in the local frame.
    pub fn locate(&self, p: DVec3) -> Option<&Located> {
        let (mut word, mut lambda) = self.cube.locate(p, 0)?;
        let mut depth = 0;
        while let Node::Split(children) = Node::decode(self.nodes[word], &self.lists) {
            word = children as usize + lambda.descend(depth);
            depth += 1;
        }
        self.leaf_of[word].map(|leaf| &self.leaves[leaf as usize])
    }

    /// A point of a cell of the domain where rounding matters most: on a corner, an edge or a side,
    /// exactly or a few ulp beside it. In the mesh's unit.
    pub fn border_point(&self, random: &mut Random) -> DVec3 {
        let leaf = &self.leaves[random.index(self.leaves.len())];
        let mut weights: [f64; 4] = random.weights();
        let zeros = 1 + random.index(3);
        let first = random.index(4);
        (0..zeros).for_each(|k| weights[(first + k) % 4] = 0.0);
        let p = combine(&leaf.cell.corners, &weights);
        let aside = match random.index(3) {
            0 => DVec3::ZERO,
            1 => 3e-16 * random.in_cube(),
            _ => 1e-12 * random.in_cube(),
        };
        self.frame.to_world(p + aside)
    }
}

struct Lists {
    starts: Vec<u32>,
    low: Vec<u16>,
    high: Vec<u8>,
    ids: Vec<u32>,
}

impl Lists {
    fn positions(&self, list: List) -> Vec<u32> {
        match list {
            List::Slots(palette, slots) => slots
                .iter()
                .map(|&slot| {
                    let at = self.starts[palette as usize] as usize + slot as usize;
                    u32::from(self.low[at]) | self.high.get(at).map_or(0, |&h| u32::from(h) << 16)
                })
                .collect(),
            List::Faces(bytes) => {
                bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
            }
        }
    }
}

/// The weighted mean of the corners. The weights are normalised to sum 1.
pub fn combine(corners: &[DVec3; 4], weights: &[f64; 4]) -> DVec3 {
    let sum: f64 = weights.iter().sum();
    (0..4).map(|k| weights[k] / sum * corners[k]).sum()
}

/// Barycentric coordinates of `p`.
pub fn barycentric(corners: &[DVec3; 4], p: DVec3) -> [f64; 4] {
    let volume = |t: [DVec3; 4]| (t[1] - t[0]).cross(t[2] - t[0]).dot(t[3] - t[0]);
    let whole = volume(*corners);
    std::array::from_fn(|k| {
        let mut t = *corners;
        t[k] = p;
        volume(t) / whole
    })
}

/// The points of a lattice over a cell, including its corners.
pub fn lattice(corners: &[DVec3; 4], n: usize) -> Vec<DVec3> {
    let mut points = Vec::new();
    for i in 0..=n {
        for j in 0..=n - i {
            for k in 0..=n - i - j {
                points.push(combine(corners, &[i, j, k, n - i - j - k].map(|w| w as f64)));
            }
        }
    }
    points
}
