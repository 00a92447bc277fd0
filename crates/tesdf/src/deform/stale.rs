use crate::parallel::*;
use glam::DVec3;

use crate::TeSdf;
use crate::asset::about::About;
use crate::asset::layout::{Label, List, MAX_LIST_OFFSET, Node, TREE_LEAF};
use crate::asset::{Motion, SharedSection};
use crate::base::{Chains, Proved};
use crate::domain::Cell;
use crate::encode::EncodeError;
use crate::encode::candidates::Pool;
use crate::encode::filter::{Scratch, filter};
use crate::encode::lists::Lists;
use crate::encode::sampled::lipschitz_candidates;
use crate::encode::surface::{Surface, Touching};
use crate::geometry::{Aabb, AabbTree};
use crate::mesh::TriangleMesh;

/// The result of [`TeSdf::reencode_stale`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Reencoded {
    /// Number of cells with a list.
    pub cells: usize,
    /// Number of these cells that had to be checked, because a moved face is, or may come, near
    /// enough to matter. Only these cells cost more than a look.
    pub checked: usize,
    /// The cells whose list was made anew, by their [id](crate::asset::CellView::id), ascending.
    pub stale: Vec<u32>,
}

/// A cell with a list.
struct Listed {
    word: u32,
    root: usize,
    cell: Cell,
    label: Label,
    offset: u32,
}

/// A list that no longer holds, with its replacement: positions of faces, and the distance within
/// which they are exact.
struct Stale {
    word: u32,
    label: Label,
    faces: Vec<u32>,
}

/// A cell that was checked.
struct Checked {
    /// Its new list, if the present list does not hold.
    stale: Option<Stale>,
    proved: Proved,
}

impl TeSdf {
    /// The cells whose lists may not hold for the current positions of the vertices, by their
    /// [id](crate::asset::CellView::id), ascending.
    ///
    /// A cell is left out only with a proof. Either nothing that moved can matter to the cell, or
    /// the certified filter, run with the current positions, asks only for parts that the list has.
    ///
    /// # Errors
    /// [`EncodeError::Mesh`] when the moved mesh is not valid.
    pub fn stale_cells(&self) -> Result<Vec<u32>, EncodeError> {
        let Some(motion) = &self.motion else { return Ok(Vec::new()) };
        Ok(self.stale(motion)?.stale.into_iter().map(|s| s.word).collect())
    }

    /// Makes the lists of stale cells anew, with the options of the encoding, and leaves the other
    /// lists as they are. The certificate then holds for the current shape.
    ///
    /// # Errors
    /// [`EncodeError`] when the moved mesh is not valid, or when the lists outgrow the numbers that
    /// a file can store. Nothing has changed then.
    pub fn reencode_stale(&mut self) -> Result<Reencoded, EncodeError> {
        let Some(mut motion) = self.motion.take() else { return Ok(Reencoded::default()) };
        let reencoded = self.stale(&motion).and_then(|found| {
            self.replace_lists(&found.stale)?;
            let stale = found.stale.iter().map(|s| s.word).collect();
            Ok((Reencoded { cells: found.cells, checked: found.checked, stale }, found.proved))
        });
        if let Ok((_, proved)) = &reencoded {
            motion.faces.fill(false);
            motion.tetrahedra.fill(false);
            self.prove_again(*proved);
        }
        self.motion = Some(motion);
        reencoded.map(|(reencoded, _)| reencoded)
    }

    fn stale(&self, motion: &Motion) -> Result<StaleCells, EncodeError> {
        let known = self.about().certificate().proved();
        let Some(domain) = &self.conforming else { return Ok(StaleCells::none(known)) };
        let local = |v: &[f64; 3]| self.frame.to_local(DVec3::from_array(*v));
        let mesh = TriangleMesh::new(self.vertices.iter().map(local).collect(), self.faces.to_vec())?;
        let surface = Surface::new(&mesh, self.cube.side(), Touching::Ignored);
        let boxes: Vec<Aabb> = surface.triangles.iter().map(|t| Aabb::of(&t.corners)).collect();
        let tree = AabbTree::build(&boxes, TREE_LEAF);
        let moved: Vec<u32> = (0..self.faces.len() as u32).filter(|&f| motion.faces[f as usize]).collect();
        let moved_boxes: Vec<Aabb> = moved.iter().map(|&f| boxes[f as usize]).collect();
        let search = Search {
            asset: self,
            motion,
            lists: Lists {
                surface: &surface,
                tree: &tree,
                options: &self.about().options,
                scale: self.frame.scale,
                kept_within: self.frame.scale
                    * self.about().options.fit_within(self.about().statistics.diagonal),
            },
            tetrahedra: domain.tetrahedra(),
            moved_tree: AabbTree::build(&moved_boxes, TREE_LEAF),
            moved,
            known: known.chains.unwrap_or(Chains::NONE),
        };
        let cells = self.listed_cells();
        let found: Vec<Option<Checked>> = cells
            .par_iter()
            .map_init(Scratch::default, |scratch, cell| search.check(cell, scratch))
            .collect();
        let mut all = StaleCells { cells: cells.len(), ..StaleCells::none(known) };
        for checked in found.into_iter().flatten() {
            all.checked += 1;
            all.proved = all.proved.and(checked.proved);
            all.stale.extend(checked.stale);
        }
        all.stale.sort_by_key(|s| s.word);
        Ok(all)
    }

    fn listed_cells(&self) -> Vec<Listed> {
        let mut cells = Vec::new();
        let mut stack: Vec<(u32, usize, Cell)> =
            (0..self.root_count()).map(|root| (root as u32, root, self.root(root))).collect();
        while let Some((word, root, cell)) = stack.pop() {
            match Node::decode(self.nodes[word as usize], &self.lists) {
                Node::Split(c) => stack.extend([(c, root, cell.child(0)), (c + 1, root, cell.child(1))]),
                Node::Listed(label, offset) => cells.push(Listed { word, root, cell, label, offset }),
                Node::Far(_) | Node::NotOfDomain => {}
            }
        }
        cells
    }

    fn replace_lists(&mut self, stale: &[Stale]) -> Result<(), EncodeError> {
        let (mut nodes, mut lists) = (self.nodes.to_vec(), self.lists.to_vec());
        for s in stale {
            let raw: Vec<u8> = s.faces.iter().flat_map(|f| f.to_le_bytes()).collect();
            nodes[s.word as usize] = Node::Listed(s.label, lists.len() as u32).encode();
            List::Faces(&raw).encode(&mut lists);
            if lists.len() > MAX_LIST_OFFSET as usize {
                return Err(EncodeError::TooLarge {
                    what: "bytes of lists",
                    found: lists.len(),
                    limit: MAX_LIST_OFFSET as usize,
                });
            }
        }
        self.nodes = SharedSection::of_rows(&nodes);
        self.lists = SharedSection::of_rows(&lists);
        Ok(())
    }

    /// Restores the proof for the shape at rest, reduced to the part that the new lists keep.
    fn prove_again(&mut self, proved: Proved) {
        // Opening has read the metadata before.
        let Ok(rest) = About::from_metadata(self.container().metadata()) else { return };
        self.about_mut().certificate = rest.certificate.with(proved);
    }
}

/// The state of the lists since the vertices moved.
struct StaleCells {
    cells: usize,
    checked: usize,
    stale: Vec<Stale>,
    /// The proof of all lists, with the new lists.
    proved: Proved,
}

impl StaleCells {
    fn none(proved: Proved) -> Self {
        Self { cells: 0, checked: 0, stale: Vec::new(), proved }
    }
}

/// The data that the check of a cell reads.
struct Search<'a> {
    asset: &'a TeSdf,
    motion: &'a Motion,
    lists: Lists<'a>,
    tetrahedra: &'a [[u32; 4]],
    /// Faces that moved, and a tree over them.
    moved: Vec<u32>,
    moved_tree: AabbTree,
    /// The chains of rule C that the present lists rest on.
    known: Chains,
}

impl Search<'_> {
    /// Checks a cell. Returns `None` when nothing that moved matters to it.
    fn check(&self, listed: &Listed, scratch: &mut Scratch) -> Option<Checked> {
        let mut list: Vec<u32> = self.asset.with_list(listed.offset, |faces| faces.ids().to_vec());
        list.sort_unstable();
        let Lists { surface, tree, .. } = self.lists;
        // The chains go on from those of the list, unless these have used up too much of the
        // budget.
        let go_on = 2 * self.known.used() <= Chains::BUDGET;
        let (candidates, chains) = if go_on && self.is_where_it_was(listed, &list) {
            let mut all = self.newcomers(&listed.cell, &list);
            if all.is_empty() {
                return None;
            }
            // Listed faces beat faces that are not listed, and have not moved.
            all.extend(&list);
            all.sort_unstable();
            (all, self.known)
        } else {
            (lipschitz_candidates(surface, tree, &listed.cell), Chains::NONE)
        };
        let pool = Pool::new(surface, &candidates, &listed.cell);
        let filtered = filter(surface, &listed.cell, &pool.candidates(), chains, scratch);
        let has = |r| list.iter().any(|&face| surface.holds(face, r));
        if filtered.survivors.iter().all(|s| has(s.requirement)) {
            let proved = Proved { within: f64::INFINITY, chains: Some(filtered.chains) };
            return Some(Checked { stale: None, proved });
        }
        let tetrahedron = self.tetrahedra.get(listed.root);
        let made = self.lists.of_cell(&listed.cell, tetrahedron, &candidates, chains, scratch);
        let holds = made.faces.iter().all(|face| list.binary_search(face).is_ok());
        let within = made.exact_within * self.asset.frame.inverse_scale();
        let stale = Stale { word: listed.word, label: listed.label, faces: made.faces };
        let proved = Proved { within, chains: made.proof };
        Some(Checked { stale: (!holds).then_some(stale), proved })
    }

    /// Whether neither the cell nor a face of its list has moved, and the list is not truncated.
    fn is_where_it_was(&self, listed: &Listed, list: &[u32]) -> bool {
        self.lists.options.max_entries.is_none()
            && !self.motion.tetrahedra[listed.root]
            && !list.iter().any(|&f| self.motion.faces[f as usize])
    }

    /// For a cell that has not moved, the moved faces that may now be closest somewhere in it:
    /// those that neither Lemma 1 nor rule A drops, compared with the listed faces.
    fn newcomers(&self, cell: &Cell, list: &[u32]) -> Vec<u32> {
        let surface = self.lists.surface;
        let center = cell.centroid();
        let closest = |face: u32, p: DVec3| surface.triangles[face as usize].closest(p);
        let [a, b, c, d] = cell.corners;
        let rivals = [center, a, b, c, d].map(|p| {
            let found = list.iter().map(|&face| closest(face, p));
            found
                .min_by(|x, y| x.distance.total_cmp(&y.distance))
                .map_or(DVec3::INFINITY, |found| found.point)
        });
        let limit = rivals[0].distance(center) + 2.0 * cell.radius();
        let reach = rivals.map(|q| cell.corners.map(|c| c.distance(q) + surface.margin));
        let mut newcomers = Vec::new();
        self.moved_tree.visit(
            |bounds| bounds.distance_squared(center) <= limit * limit,
            |leaf| {
                for &at in leaf {
                    let face = self.moved[at as usize];
                    let seen = cell.corners.map(|corner| closest(face, corner).distance);
                    let dropped = |reach: &[f64; 4]| seen.iter().zip(reach).all(|(d, r)| d >= r);
                    if !reach.iter().any(dropped) && closest(face, center).distance < limit {
                        newcomers.push(face);
                    }
                }
            },
        );
        newcomers
    }
}
