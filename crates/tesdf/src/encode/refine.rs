//! Refines the domain more than needed, and prunes it on the way back.

use super::candidates::{Candidates, Pool, Survivor};
use super::effort::Effort;
use super::filter::{Scratch, filter};
use super::surface::{Requirement, Surface};
use super::tighten::{Levels, needed};
use crate::base::{Chains, Progress};
use crate::domain::Cell;
use crate::geometry::Aabb;

/// A refined tree of cells.
#[derive(Debug)]
pub enum Tree {
    /// A cell.
    Leaf(Leaf),
    /// The two children of a bisection.
    Split(Box<[Tree; 2]>),
}

/// Where a leaf takes its answers from.
#[derive(Debug)]
pub enum Leaf {
    /// The faces that can be closest in the cell, in ascending order.
    Listed {
        /// Face ids, ascending.
        faces: Vec<u32>,
        /// Whether the surface passes through the cell.
        crossing: bool,
        /// The heaviest chains of rule C that the list rests on.
        chains: Chains,
    },
    /// The cell is far from the surface and its list would be long. The face tree answers, and the
    /// cell knows the sign.
    Far,
    /// The cell is farther out than the band, so it is not of the domain.
    Outside,
}

/// The weights of the pruning. Everything is in the local frame.
#[derive(Clone, Debug)]
pub struct Weights {
    /// How many faces per query one stored byte is worth.
    pub byte: f64,
    /// Half width of the layer around the surface over which volumes are averaged.
    pub near: f64,
    /// Normalisation: 1 / (area · 4 near).
    pub per_volume: f64,
    /// How many faces a query by the face tree counts as.
    pub far_faces: f64,
    /// A cell with a shorter list is never left to the face tree.
    pub far_list: usize,
    /// A cell nearer to the surface than this is never left to the face tree.
    pub far_distance: f64,
    /// Length below which no refinement is expected to bring a list.
    pub floor: f64,
    /// For cells with many faces that are longer than the cell: how many stored bytes the cell must
    /// weigh to be bisected.
    pub long_faces: f64,
    /// Whether a list is read in groups of faces.
    pub groups: Option<GroupWeights>,
}

/// The weights of lists that are read in groups, and how they are shortened.
///
/// A merged cell should fill a group, so the lengths of lists must be known well while cells are
/// merged. So a cell is tightened as soon as it is not bisected any more, and the requirements of
/// merged cells are as tight as those of their parts.
#[derive(Clone, Copy, Debug)]
pub struct GroupWeights {
    /// Faces that are read at once.
    pub size: f64,
    /// In a cell nearer to the surface than this, a list of more than one group counts [`OVERFULL`]
    /// times.
    pub fit_within: f64,
    /// How deep the cells are tightened.
    pub levels: Levels,
}

impl GroupWeights {
    /// How many faces reading a list counts as in a cell that comes as near to the surface as
    /// `nearest`.
    fn read(&self, faces: f64, nearest: f64) -> f64 {
        self.rate(faces, nearest) * self.size * (faces / self.size).ceil()
    }

    fn rate(&self, faces: f64, nearest: f64) -> f64 {
        if faces > self.size && nearest < self.fit_within { OVERFULL } else { 1.0 }
    }
}

/// How much more a list of several groups costs near the surface, where it should fit one group.
///
/// The factor ends the bisection where no cell is small enough, on medial axes and at vertices of
/// many faces.
const OVERFULL: f64 = 16.0;

impl Weights {
    /// How many faces reading a list of this length counts as in a cell that comes as near to the
    /// surface as `nearest`.
    fn read(&self, faces: f64, nearest: f64) -> f64 {
        self.groups.as_ref().map_or(faces, |groups| groups.read(faces, nearest))
    }

    /// Whether the best possible result of bisecting a cell with a list of `faces` would pay.
    fn could_pay(&self, faces: f64, weight: f64, nearest: f64) -> bool {
        let rate = self.groups.as_ref().map_or(1.0, |groups| groups.rate(faces, nearest));
        rate * weight * (faces - self.floor) > self.byte * (LEAF_BYTES + self.floor)
    }

    /// The cost of a cell of this weight when the face tree answers.
    fn by_tree(&self, weight: f64) -> f64 {
        weight * self.far_faces + self.byte * LEAF_BYTES
    }
}

/// Bytes of a leaf besides its entries: two words of the tree, and its share of headers and
/// palettes.
const LEAF_BYTES: f64 = 14.0;
/// Longer sets of requirements are not merged: such a cell is never worth keeping.
const MAX_UNION: usize = 256;

/// More faces than this that are longer than their cell count as many.
const MANY_LONG: usize = 64;

/// The progress that a whole root counts for.
pub const ROOT_VOLUME: u64 = 1 << 40;

/// All that the recursion reads.
pub struct Refiner<'a> {
    /// The surface.
    pub surface: &'a Surface,
    /// Weights of the pruning.
    pub weights: Weights,
    /// Outer band, local frame.
    pub band: f64,
    /// Bounds of the mesh, local frame. Cells in here that are beyond the band are listed where
    /// that pays.
    pub bounds: Aabb,
    /// Boxes that belong to the domain in addition to the band, local frame.
    pub regions: &'a [Aabb],
    /// Whether a point of the local frame is inside.
    pub inside: &'a (dyn Fn(glam::DVec3) -> bool + Sync),
    /// Bisections from a root to the deepest cell, at most [`MAX_DEPTH`](crate::domain::MAX_DEPTH).
    /// 0 leaves the roots whole.
    pub max_depth: u32,
    /// Is told the volume done, in units of 2^-40 of a root, and says whether to stop.
    pub progress: &'a Progress,
    /// How much effort all roots together may take.
    pub effort: &'a Effort,
}

struct Pruned {
    tree: Tree,
    cost: f64,
    union: Option<Vec<Requirement>>,
    crossing: bool,
    /// The heaviest chains of rule C that `union` rests on.
    chains: Chains,
}

/// Requirements of one cell.
struct Own {
    requirements: Vec<Requirement>,
    crossing: bool,
    chains: Chains,
}

/// What the cost of a cell depends on besides its list.
struct Place {
    weight: f64,
    /// Lower bound of the cell's distance from the surface.
    nearest: f64,
    /// What the cell may be instead of a cell with a list.
    unlisted: Option<Leaf>,
}

impl Refiner<'_> {
    /// Refines a root whose lists can only name `faces`. Returns `None` when the work was cancelled
    /// or the effort is exceeded.
    pub fn root(&self, cell: Cell, faces: &[u32]) -> Option<Tree> {
        let pool = Pool::new(self.surface, faces, &cell);
        self.refine(cell, &pool.candidates(), Chains::NONE, &mut Scratch::default()).map(|p| p.tree)
    }

    fn refine(
        &self,
        cell: Cell,
        candidates: &Candidates,
        chains: Chains,
        scratch: &mut Scratch,
    ) -> Option<Pruned> {
        self.effort.spend(candidates.faces.len());
        if self.progress.is_cancelled() || self.effort.is_exceeded() {
            return None;
        }
        let filtered = filter(self.surface, &cell, candidates, chains, scratch);
        let chains = filtered.chains;
        let centroid = cell.centroid();
        let nearest = filtered.distance - filtered.radius;
        let n = filtered.survivors.len();

        let mut own: Vec<Requirement> = filtered.survivors.iter().map(|s| s.requirement).collect();
        own.sort_unstable();

        let reach = Aabb::of(&cell.corners);
        let beyond = nearest > self.band
            && !self.regions.iter().any(|r| r.overlaps(reach))
            && !(self.inside)(centroid);
        if beyond && !reach.overlaps(self.bounds) {
            self.finish(&cell);
            scratch.reuse(filtered);
            let union = (n <= MAX_UNION).then_some(own);
            return Some(Pruned {
                tree: Tree::Leaf(Leaf::Outside),
                cost: 0.0,
                union,
                crossing: false,
                chains,
            });
        }
        let w = &self.weights;
        let weight = cell.volume() * w.per_volume * w.near / (filtered.distance + w.near);
        let split = cell.depth < self.max_depth
            && w.could_pay(n as f64, weight, nearest)
            && self.long_faces_pay(&cell, candidates, &filtered.survivors, weight);
        let far = n >= w.far_list && nearest > w.far_distance && !filtered.crossing;
        let unlisted = match (beyond, far) {
            (true, _) => Some(Leaf::Outside),
            (false, true) => Some(Leaf::Far),
            _ => None,
        };
        let place = Place { weight, nearest, unlisted };

        if !split {
            self.finish(&cell);
            let mut own = Own { requirements: own, crossing: filtered.crossing, chains };
            scratch.reuse(filtered);
            if let Some(groups) = &w.groups {
                let list = self.surface.cover(&own.requirements);
                let levels = groups.levels.of(&list);
                (own.requirements, own.chains) = needed(self.surface, &cell, &list, levels, chains, scratch);
            }
            return Some(self.leaf(own, place));
        }
        let mut pool = scratch.pool();
        pool.narrow(self.surface, &cell, candidates, &filtered.survivors);
        scratch.reuse(filtered);
        let (first, second) = (cell.child_corners(0), cell.child_corners(1));
        let (left, right) = if cell.depth < 14 {
            crate::parallel::join(
                || {
                    self.refine(
                        cell.child(0),
                        &pool.of_child(candidates, first),
                        chains,
                        &mut Scratch::default(),
                    )
                },
                || {
                    self.refine(
                        cell.child(1),
                        &pool.of_child(candidates, second),
                        chains,
                        &mut Scratch::default(),
                    )
                },
            )
        } else {
            let left = self.refine(cell.child(0), &pool.of_child(candidates, first), chains, scratch);
            (left, self.refine(cell.child(1), &pool.of_child(candidates, second), chains, scratch))
        };
        scratch.give_back(pool);
        let (left, right) = (left?, right?);
        Some(self.prune(left, right, Own { requirements: own, crossing: false, chains }, place))
    }

    /// Whether a bisection can pay, given the faces that are longer than the cell.
    ///
    /// Each such face is in two or more of the cells that are half as wide. So lists become half as
    /// long, with twice as many entries in all. (Lists of small faces become a quarter as long,
    /// with no more entries.) A cell with n such faces therefore gives n bytes to gain n / 2 times
    /// its weight. Near the vertex of a fan of n faces this would go on until there are n² entries.
    fn long_faces_pay(
        &self,
        cell: &Cell,
        candidates: &Candidates,
        survivors: &[Survivor],
        weight: f64,
    ) -> bool {
        if survivors.len() <= MANY_LONG || weight >= self.weights.byte * self.weights.long_faces {
            return true;
        }
        let width = cell.width();
        let is_long = |s: &&Survivor| self.surface.longest(candidates.faces[s.index as usize]) > width;
        survivors.iter().filter(is_long).count() <= MANY_LONG
    }

    fn leaf(&self, own: Own, Place { weight, nearest, unlisted }: Place) -> Pruned {
        let Own { requirements: mut own, crossing, chains } = own;
        let w = &self.weights;
        let faces = self.surface.cover(&own);
        let n = faces.len() as f64;
        let listed = weight * w.read(n, nearest) + w.byte * (n + LEAF_BYTES);
        let by_tree = w.by_tree(weight);
        own.truncate(if own.len() > MAX_UNION { 0 } else { own.len() });
        let union = (!own.is_empty()).then_some(own);
        if let Some(leaf) = unlisted
            && by_tree < listed
        {
            return Pruned { tree: Tree::Leaf(leaf), cost: by_tree, union, crossing, chains };
        }
        Pruned {
            tree: Tree::Leaf(Leaf::Listed { faces, crossing, chains }),
            cost: listed,
            union,
            crossing,
            chains,
        }
    }

    /// Keeps the two children, or merges them when one cell costs less.
    fn prune(&self, left: Pruned, right: Pruned, own: Own, place: Place) -> Pruned {
        let split = left.cost + right.cost;
        let crossing = left.crossing || right.crossing;
        let below = left.chains.max(right.chains);
        let most = match self.weights.groups {
            // Requirements of tightened cells are more, and their lists shorter.
            Some(_) => MAX_UNION,
            None => own.requirements.len().min(MAX_UNION),
        };
        let union = match (left.union, right.union) {
            (Some(a), Some(b)) => Some(merged(a, b)).filter(|u| u.len() <= most),
            _ => None,
        };
        let tightest = match union {
            Some(requirements) => Some(Own { requirements, crossing, chains: below }),
            None => (own.requirements.len() <= MAX_UNION).then_some(Own { crossing, ..own }),
        };
        let both_outside =
            matches!((&left.tree, &right.tree), (Tree::Leaf(Leaf::Outside), Tree::Leaf(Leaf::Outside)));
        if both_outside {
            let chains = tightest.as_ref().map_or(below, |t| t.chains);
            let union = tightest.map(|t| t.requirements);
            return Pruned { tree: left.tree, cost: split, union, crossing: false, chains };
        }
        if let Some(all) = tightest {
            let merged = self.leaf(all, place);
            if merged.cost <= split {
                return merged;
            }
            let tree = Tree::Split(Box::new([left.tree, right.tree]));
            return Pruned { tree, cost: split, ..merged };
        }
        let by_tree = self.weights.by_tree(place.weight);
        let tree = match place.unlisted {
            Some(leaf) if by_tree <= split => {
                let cost = by_tree;
                return Pruned { tree: Tree::Leaf(leaf), cost, union: None, crossing, chains: below };
            }
            _ => Tree::Split(Box::new([left.tree, right.tree])),
        };
        Pruned { tree, cost: split, union: None, crossing, chains: below }
    }

    fn finish(&self, cell: &Cell) {
        self.progress.advance(ROOT_VOLUME >> cell.depth.min(40));
    }
}

fn merged(mut a: Vec<Requirement>, b: Vec<Requirement>) -> Vec<Requirement> {
    a.extend(b);
    a.sort_unstable();
    a.dedup();
    a
}
