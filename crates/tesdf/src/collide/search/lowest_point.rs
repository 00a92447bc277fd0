//! The least signed distance over whole surfaces, by best-first search over their face trees.
use crate::asset::layout::TreeChild;
use crate::collide::bodies::branch::Branch;
use crate::collide::bodies::field::{Field, FieldBody};
use crate::collide::bodies::surface::SurfaceBody;
use crate::collide::scene::simple::Simple;
use crate::collide::search::piece::{FLAT, Looks, Lowest, Piece, Rest};
use crate::collide::search::queue::Queue;
use crate::parallel::*;

/// A surface and the field in which its lowest point is wanted.
pub struct Order<'a> {
    /// The surface.
    pub surface: SurfaceBody<'a>,
    /// The field.
    pub field: FieldBody<'a>,
}

impl Order<'_> {
    /// Whether positions are near enough for double precision.
    pub fn has_distances(&self) -> bool {
        let (center, _) = self.surface.face(0, &self.field, 0.0).ball();
        self.field.rough(center).0.is_finite()
    }

    /// Whether the lowest point is a node: that of a built-in shape over a plane, as the prism of a
    /// cylinder has an edge where it is lowest.
    fn is_lowest_at_node(&self) -> bool {
        matches!(self.field.field, Field::Simple(Simple::Plane)) && !self.surface.is_mesh()
    }

    /// The lowest node of a built-in shape, at which its surface is as low.
    fn lowest_node(&self) -> Option<Lowest> {
        let of_node = |node: u32| {
            let part = self.surface.node(node);
            let point = *part.points().first()?;
            let value = self.field.exact_value(point);
            let (distance, radius) = (value.distance - part.radius, part.radius);
            Some(Lowest { distance, face: self.surface.face_of_node(node), radius, point, value })
        };
        let nodes = (0..self.surface.node_count()).filter_map(of_node);
        nodes.min_by(|a, b| a.distance.total_cmp(&b.distance))
    }
}

/// The lowest point of several surfaces, each in its field. Lengths are in the world's unit, except
/// for those of `lowest`.
#[derive(Clone, Copy, Debug)]
pub struct Least {
    /// The order of the lowest point, by its index.
    pub order: usize,
    /// Its signed distance.
    pub distance: f64,
    /// No point is lower than this.
    pub lower_bound: f64,
    /// The point, in the frame of the order's field.
    pub lowest: Lowest,
    /// Whether the error is within the tolerance.
    pub converged: bool,
}

/// A part of a surface that is still to be searched.
struct Open {
    order: usize,
    item: Item,
}

enum Item {
    Tree(TreeChild),
    Piece(Box<Piece>),
}

/// Number of parts after which the search stops early. Random deep pairs of the meshes of the data
/// take up to some 60,000.
const MAX_PARTS: u64 = 1 << 20;
/// Largest number of parts that are searched in parallel.
const BATCH: usize = 128;
/// Fewer parts are searched on one thread: each takes some microseconds.
const FEW: usize = 16;
/// One part in this number of open parts is searched at a time.
const SHARE: usize = 8;

/// The least signed distance over the surfaces. `None` when positions are too far out for their
/// numbers.
///
/// The search goes best-first over nodes of the face trees, faces and parts of faces, of all orders
/// together: the part that can be lowest is next. Several of the first parts are searched in
/// parallel. Their number and order depend on the parts alone, so the result is the same for any
/// number of threads.
///
/// When the bodies are apart by a distance, no surface comes nearer to the other than that. So as
/// long as no overlap is known, only the first order is searched. Then the other orders are
/// searched for points that are at least as deep as the distance.
pub fn least(orders: &[Order], tolerance: f64) -> Option<Least> {
    Search::new(orders, tolerance, f64::INFINITY).run(MAX_PARTS).least
}

/// As [`least`], of signed distances below `below`, until one is at most `enough`. Nothing is found
/// where none is lower than `below` by more than the tolerance.
pub fn least_until(orders: &[Order], tolerance: f64, below: f64, enough: f64) -> Below {
    Search { enough, ..Search::new(orders, tolerance, below) }.run(MAX_PARTS)
}

/// As [`least`], of any number of pairs, of points below a signed distance of at most 0: nothing is
/// found where none is lower than `below` by more than the tolerance. Distances outside are then
/// never wanted, which take most of the time where bodies touch.
pub fn least_below(orders: &[Order], tolerance: f64, below: f64) -> Below {
    let parts = MAX_PARTS.saturating_mul(orders.len().max(1) as u64);
    Search::new(orders, tolerance, below.min(0.0)).run(parts)
}

/// What a search below a signed distance found.
#[derive(Clone, Copy, Debug)]
pub struct Below {
    /// The lowest point, if one is below.
    pub least: Option<Least>,
    /// No point is lower than this.
    pub lower_bound: f64,
    /// Whether the error is within the tolerance.
    pub converged: bool,
}

struct Search<'a> {
    orders: &'a [Order<'a>],
    /// The share of the tolerance that is left for the search, and that by which surfaces may be lower
    /// than their pieces.
    tolerance: f64,
    beside: f64,
    /// Only signed distances below this are wanted.
    below: f64,
    /// The search ends with a signed distance up to this.
    enough: f64,
    /// The lowest signed distance, in the world's unit, its order and its point.
    best: Option<(f64, usize, Lowest)>,
    /// The bounds are lower bounds of the signed distances, in the world's unit.
    open: Queue<Open>,
    /// Roots of orders that are searched later.
    waiting: Vec<usize>,
}

/// What a search has to do.
enum Next {
    /// These parts, with their lower bounds.
    Batch(Vec<(f64, Open)>),
    /// Nothing: the lower bound of what is left.
    Done(f64),
}

impl<'a> Search<'a> {
    fn new(orders: &'a [Order<'a>], tolerance: f64, below: f64) -> Self {
        let is_round = orders.iter().any(|order| order.surface.round_side().is_some());
        let beside = if is_round { FLAT * tolerance } else { 0.0 };
        let tolerance = tolerance - beside;
        let (best, enough) = (None, f64::NEG_INFINITY);
        Self { orders, tolerance, beside, below, enough, best, open: Queue::new(), waiting: Vec::new() }
    }

    /// Searches at most this number of parts.
    fn run(mut self, max_parts: u64) -> Below {
        for order in 0..self.orders.len() {
            self.dive(order);
        }
        self.waiting = (1..self.orders.len()).collect();
        if !self.orders.is_empty() {
            self.push_whole(0);
        }
        let bound = self.rest(max_parts);
        let within = self.least() - self.tolerance;
        let (lower_bound, converged) = (bound.min(within) - self.beside, bound >= within);
        let least = self.best.map(|(distance, order, lowest)| Least {
            order,
            distance,
            lower_bound,
            lowest,
            converged,
        });
        Below { least, lower_bound, converged }
    }

    /// Searches open parts; from the first large batch on, in the pool. Returns a lower bound of
    /// what it leaves.
    fn rest(&mut self, max_parts: u64) -> f64 {
        let mut parts = 0;
        loop {
            match self.next(&mut parts, max_parts) {
                Next::Done(bound) => return bound,
                Next::Batch(batch) if batch.len() >= FEW => {
                    return in_pool(|| self.rest_from(batch, parts, max_parts));
                }
                Next::Batch(batch) => self.search_all(batch),
            }
        }
    }

    /// The same from a batch on, where there have been `parts`.
    fn rest_from(&mut self, mut batch: Vec<(f64, Open)>, mut parts: u64, max_parts: u64) -> f64 {
        loop {
            self.search_all(batch);
            batch = match self.next(&mut parts, max_parts) {
                Next::Done(bound) => return bound,
                Next::Batch(batch) => batch,
            };
        }
    }

    /// The next parts, which are added to `parts`.
    fn next(&mut self, parts: &mut u64, max_parts: u64) -> Next {
        if self.best.is_some_and(|(distance, ..)| distance <= self.enough) {
            return Next::Done(self.bound_of_the_rest(self.open.least()));
        }
        let overlap = self.least() <= 0.0;
        let is_done = self.open.least().is_none_or(|bound| bound >= self.least() - self.tolerance);
        if overlap || is_done {
            for order in std::mem::take(&mut self.waiting) {
                self.push_whole(order);
            }
        }
        let batch = self.batch();
        if batch.is_empty() {
            return Next::Done(f64::INFINITY);
        }
        *parts += batch.len() as u64;
        if *parts > max_parts {
            return Next::Done(self.bound_of_the_rest(batch.iter().map(|(bound, _)| *bound)));
        }
        Next::Batch(batch)
    }

    /// Searches the parts of a batch.
    fn search_all(&mut self, batch: Vec<(f64, Open)>) {
        let found: Vec<SearchedPart> = match batch.len() {
            ..FEW => batch.into_iter().map(|(bound, open)| self.search(bound, open)).collect(),
            _ => batch.into_par_iter().map(|(bound, open)| self.search(bound, open)).collect(),
        };
        found.into_iter().for_each(|found| self.take(found));
    }

    fn least(&self) -> f64 {
        self.best.map_or(self.below, |(distance, ..)| distance)
    }

    /// Lower bound of what parts with these bounds and the surfaces that wait can have.
    fn bound_of_the_rest(&self, bounds: impl IntoIterator<Item = f64>) -> f64 {
        // Nothing is known about surfaces that wait.
        let waiting = if self.waiting.is_empty() { f64::INFINITY } else { f64::NEG_INFINITY };
        bounds.into_iter().fold(waiting, f64::min)
    }

    /// Signed distances of an order above this are not wanted.
    fn limit(&self, order: usize) -> f64 {
        match self.least() {
            least if order > 0 && least > 0.0 => self.tolerance - least,
            least => least,
        }
    }

    fn push(&mut self, bound: f64, order: usize, item: Item) {
        self.open.push(bound, Open { order, item });
    }

    /// Adds a whole surface, whose lowest point is not known yet.
    fn push_whole(&mut self, order: usize) {
        if !self.orders[order].is_lowest_at_node() {
            self.push(f64::NEG_INFINITY, order, Item::Tree(self.orders[order].surface.whole()));
        }
    }

    /// The parts that are searched next, with their bounds.
    fn batch(&mut self) -> Vec<(f64, Open)> {
        let size = (self.open.len() / SHARE).clamp(1, BATCH);
        let mut batch = Vec::with_capacity(size);
        while batch.len() < size
            && let Some((bound, open)) = self.open.pop()
        {
            if bound < self.least() - self.tolerance && bound <= self.limit(open.order) {
                batch.push((bound, open));
            }
        }
        batch
    }

    fn looks(&self, order: usize) -> Looks<'_> {
        let field = &self.orders[order].field;
        let to_field = 1.0 / field.unit();
        Looks {
            field,
            tolerance: self.tolerance * to_field,
            limit: self.limit(order) * to_field,
            least: self.least() * to_field,
            lowest: None,
        }
    }

    /// Descends to a leaf where the surface is low, for a first upper bound; or finds the lowest
    /// point.
    fn dive(&mut self, order: usize) {
        if self.orders[order].is_lowest_at_node() {
            let lowest = self.orders[order].lowest_node();
            return self.take(SearchedPart { order, lowest, open: Vec::new() });
        }
        let Order { surface, field } = &self.orders[order];
        let mut looks = self.looks(order);
        let mut child = surface.whole();
        while let TreeChild::Node(node) = child {
            let bound = |branch: &Branch| field.least_within(branch.center, branch.radius);
            let lower = |branches: [Branch; 2]| {
                let [a, b] = [0, 1].map(|k| bound(&branches[k]));
                branches[usize::from(b < a)].child
            };
            child = surface.halves(node).map_or(TreeChild::Leaf(0, 0), lower);
        }
        if let TreeChild::Leaf(start, count) = child {
            for face in start..start + count {
                let part = surface.face(face, field, 0.0);
                looks.first(Piece::new(surface, face, &part), f64::NEG_INFINITY);
            }
        }
        let lowest = looks.lowest;
        self.take(SearchedPart { order, lowest, open: Vec::new() });
    }

    /// Searches a part.
    fn search(&self, bound: f64, Open { order, item }: Open) -> SearchedPart {
        let Order { surface, field } = &self.orders[order];
        let (mut looks, mut found) = (self.looks(order), Vec::new());
        let bound = bound / field.unit();
        let mut rest = |rest: Rest| {
            if let Rest::Pieces(bound, pieces) = rest {
                found.extend(pieces.into_iter().map(|piece| (bound, Item::Piece(Box::new(piece)))));
            }
        };
        match item {
            Item::Tree(TreeChild::Node(node)) => {
                for branch in surface.halves(node).into_iter().flatten() {
                    if let Some(own) = field.least_up_to(branch.center, branch.radius, looks.limit) {
                        found.push((own.max(bound), Item::Tree(branch.child)));
                    }
                }
            }
            Item::Tree(TreeChild::Leaf(start, count)) => {
                for face in start..start + count {
                    let part = surface.face(face, field, 0.0);
                    rest(looks.first(Piece::new(surface, face, &part), bound));
                }
            }
            Item::Piece(piece) => rest(looks.look(*piece, bound)),
        }
        SearchedPart { order, lowest: looks.lowest, open: found }
    }

    fn take(&mut self, found: SearchedPart) {
        let unit = self.orders[found.order].field.unit();
        if let Some(lowest) = found.lowest.filter(|lowest| lowest.distance * unit < self.least()) {
            self.best = Some((lowest.distance * unit, found.order, lowest));
        }
        for (bound, item) in found.open {
            self.push(bound * unit, found.order, item);
        }
    }
}

/// The result of the search of one part.
struct SearchedPart {
    order: usize,
    lowest: Option<Lowest>,
    /// What remains to be searched, with lower bounds in the field's frame.
    open: Vec<(f64, Item)>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collide::scene::pose::{Placement, Pose};
    use crate::collide::scene::shape::Shape;
    use glam::{DQuat, DVec3};

    #[test]
    fn a_search_that_stops_early_says_how_far_off_it_can_be() {
        let capsule = Shape::Capsule { half_height: 1.0, radius: 0.25 };
        let cube = Shape::Box { half_extents: DVec3::ONE };
        let at = |translation, rotation| Placement { pose: Pose { translation, rotation }, scale: 1.0 };
        let field = FieldBody::new(&capsule, at(DVec3::ZERO, DQuat::from_rotation_x(0.5)));
        let beside = at(DVec3::new(0.3, 0.9, 1.1), DQuat::from_rotation_y(0.2));
        let surface = SurfaceBody::new(&cube, beside, &field);
        let orders = [Order { surface, field }];
        let exact = least(&orders, 1e-9).expect("a value");
        assert!(exact.converged && exact.distance < 0.0, "{exact:?}");
        let mut early = 0;
        for parts in 1..40 {
            let found = Search::new(&orders, 1e-9, f64::INFINITY).run(parts).least.expect("a value");
            assert!(found.lower_bound <= exact.distance, "{parts}: {found:?} {exact:?}");
            assert!(exact.lower_bound <= found.distance, "{parts}: {found:?} {exact:?}");
            early += u32::from(!found.converged);
        }
        assert!(early > 1, "the search takes more than two parts");
    }
}
