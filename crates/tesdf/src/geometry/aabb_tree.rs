use std::ops::Range;

use glam::DVec3;

use super::Aabb;

/// A child of a node of an [`AabbTree`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Child {
    /// Another node. Its index is always greater than that of its parent.
    Node(u32),
    /// The items `order()[start..end]`.
    Leaf {
        /// First position in the order.
        start: u32,
        /// One past the last position.
        end: u32,
    },
}

/// A static binary tree of boxes over items, built with the binned surface-area heuristic.
///
/// Deterministic: the tree depends on the boxes alone. The items of a leaf are contiguous in
/// [`order`](Self::order), and so are the items of any subtree.
#[derive(Clone, Debug)]
pub struct AabbTree {
    order: Vec<u32>,
    nodes: Vec<[(Aabb, Child); 2]>,
    root: (Aabb, Child),
}

const BINS: usize = 16;
/// Below this depth, nodes are split at the median, so that no input makes a deep tree.
const MEDIAN_DEPTH: usize = 40;

impl AabbTree {
    /// Largest depth of any tree: 40 levels by cost, then at most 29 halvings of 2^29 items.
    pub const MAX_DEPTH: usize = MEDIAN_DEPTH + 30;

    /// Builds the tree. Leaves hold up to `leaf_size` items (at least 1).
    pub fn build(boxes: &[Aabb], leaf_size: usize) -> Self {
        let mut tree = Self {
            order: (0..boxes.len() as u32).collect(),
            nodes: Vec::with_capacity(2 * boxes.len() / leaf_size.max(1)),
            root: (Aabb::EMPTY, Child::Leaf { start: 0, end: 0 }),
        };
        let mut order = std::mem::take(&mut tree.order);
        let all = 0..order.len();
        tree.root = tree.build_range(boxes, &mut order, all, leaf_size.max(1), 0);
        tree.order = order;
        tree
    }

    /// Item indices in leaf order.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Nodes, each with its two children and their boxes.
    pub fn nodes(&self) -> &[[(Aabb, Child); 2]] {
        &self.nodes
    }

    /// The whole tree as a child: its box, and node 0 or the only leaf.
    pub fn root(&self) -> (Aabb, Child) {
        self.root
    }

    /// Recomputes the box of the child `slot` = 2 · node + side from the items or boxes below it.
    /// Returns whether the box changed.
    pub fn refit(&mut self, slot: u32, box_of: impl Fn(u32) -> Aabb) -> bool {
        let (node, side) = (slot as usize / 2, slot as usize % 2);
        let fitted = self.fitted(self.nodes[node][side].1, box_of);
        let changed = self.nodes[node][side].0 != fitted;
        self.nodes[node][side].0 = fitted;
        changed
    }

    /// Recomputes the box of the whole tree, after all boxes below are up to date.
    pub fn refit_root(&mut self, box_of: impl Fn(u32) -> Aabb) {
        self.root.0 = self.fitted(self.root.1, box_of);
    }

    fn fitted(&self, child: Child, box_of: impl Fn(u32) -> Aabb) -> Aabb {
        match child {
            Child::Node(below) => self.nodes[below as usize][0].0.union(self.nodes[below as usize][1].0),
            Child::Leaf { start, end } => self.order[start as usize..end as usize]
                .iter()
                .fold(Aabb::EMPTY, |bounds, &item| bounds.union(box_of(item))),
        }
    }

    /// Calls `leaf` with the items of each leaf. `enter` must accept the boxes of the leaf and of
    /// all its ancestors.
    pub fn visit(&self, mut enter: impl FnMut(Aabb) -> bool, mut leaf: impl FnMut(&[u32])) {
        let mut stack = vec![self.root];
        while let Some((bounds, child)) = stack.pop() {
            if !enter(bounds) {
                continue;
            }
            match child {
                Child::Node(n) => stack.extend(self.nodes[n as usize].iter().rev()),
                Child::Leaf { start, end } => leaf(&self.order[start as usize..end as usize]),
            }
        }
    }

    /// The least `distance_squared(item)`, with its item; on ties the lowest item.
    ///
    /// `distance_squared` must not be less than the squared distance from `p` to the item's box.
    pub fn nearest(&self, p: DVec3, distance_squared: impl FnMut(u32) -> f64) -> Option<(f64, u32)> {
        self.nearest_within(p, f64::INFINITY, distance_squared)
    }

    /// As [`nearest`](Self::nearest), but only for items whose squared distance is at most `limit`.
    /// A tight limit makes the search faster.
    pub fn nearest_within(
        &self,
        p: DVec3,
        limit: f64,
        mut distance_squared: impl FnMut(u32) -> f64,
    ) -> Option<(f64, u32)> {
        let mut best: Option<(f64, u32)> = None;
        let mut stack = vec![(self.root.0.distance_squared(p), self.root.1)];
        while let Some((bound, child)) = stack.pop() {
            if bound > best.map_or(limit, |(d, _)| d) {
                continue;
            }
            match child {
                Child::Node(n) => {
                    let mut sides = self.nodes[n as usize].map(|(b, c)| (b.distance_squared(p), c));
                    if sides[0].0 < sides[1].0 {
                        sides.swap(0, 1);
                    }
                    stack.extend(sides);
                }
                Child::Leaf { start, end } => {
                    for &item in &self.order[start as usize..end as usize] {
                        let d = distance_squared(item);
                        if d <= limit && best.is_none_or(|(b, i)| d < b || (d == b && item < i)) {
                            best = Some((d, item));
                        }
                    }
                }
            }
        }
        best
    }

    fn build_range(
        &mut self,
        boxes: &[Aabb],
        order: &mut [u32],
        range: Range<usize>,
        leaf_size: usize,
        depth: usize,
    ) -> (Aabb, Child) {
        let items = &mut order[range.clone()];
        let bounds = items.iter().fold(Aabb::EMPTY, |b, &i| b.union(boxes[i as usize]));
        if items.len() <= leaf_size {
            items.sort_unstable();
            return (bounds, Child::Leaf { start: range.start as u32, end: range.end as u32 });
        }
        let split = range.start + split(boxes, items, depth);
        let node = self.nodes.len() as u32;
        let empty = (Aabb::EMPTY, Child::Leaf { start: 0, end: 0 });
        self.nodes.push([empty, empty]);
        let left = self.build_range(boxes, order, range.start..split, leaf_size, depth + 1);
        let right = self.build_range(boxes, order, split..range.end, leaf_size, depth + 1);
        self.nodes[node as usize] = [left, right];
        (bounds, Child::Node(node))
    }
}

/// Reorders `items` and returns the start of the right side, in `1..items.len()`.
fn split(boxes: &[Aabb], items: &mut [u32], depth: usize) -> usize {
    let center = |i: u32| boxes[i as usize].center();
    let spread = items.iter().fold(Aabb::EMPTY, |b, &i| b.union(Aabb::of(&[center(i)])));
    let extent = spread.extent();
    let by_cost = (depth < MEDIAN_DEPTH)
        .then(|| (0..3).filter(|&a| extent[a] > 0.0).filter_map(|a| best_bin(boxes, items, spread, a)))
        .and_then(|costs| costs.min_by(|a, b| a.0.total_cmp(&b.0)));
    if let Some((_, axis, bin)) = by_cost {
        // A stable partition makes the result depend on the boxes alone.
        let (mut left, right): (Vec<u32>, Vec<u32>) =
            items.iter().partition(|&&i| bin_of(center(i)[axis], spread, axis) <= bin);
        let at = left.len();
        left.extend(right);
        items.copy_from_slice(&left);
        return at;
    }
    let axis = if extent.x >= extent.y && extent.x >= extent.z {
        0
    } else if extent.y >= extent.z {
        1
    } else {
        2
    };
    items.sort_by(|&a, &b| center(a)[axis].total_cmp(&center(b)[axis]).then(a.cmp(&b)));
    items.len() / 2
}

fn bin_of(center: f64, spread: Aabb, axis: usize) -> usize {
    let t = (center - spread.min[axis]) / (spread.max[axis] - spread.min[axis]);
    ((t * BINS as f64) as usize).min(BINS - 1)
}

/// The cheapest split along one axis: (cost, axis, last bin of the left side).
fn best_bin(boxes: &[Aabb], items: &[u32], spread: Aabb, axis: usize) -> Option<(f64, usize, usize)> {
    let mut bins = [(Aabb::EMPTY, 0usize); BINS];
    for &i in items {
        let bin = &mut bins[bin_of(boxes[i as usize].center()[axis], spread, axis)];
        *bin = (bin.0.union(boxes[i as usize]), bin.1 + 1);
    }
    let area = |b: Aabb| {
        let e = b.extent().max(DVec3::ZERO);
        e.x * e.y + e.y * e.z + e.z * e.x
    };
    let mut right = [(Aabb::EMPTY, 0usize); BINS];
    for k in (0..BINS - 1).rev() {
        right[k] = (right[k + 1].0.union(bins[k + 1].0), right[k + 1].1 + bins[k + 1].1);
    }
    let mut left = (Aabb::EMPTY, 0usize);
    let mut best: Option<(f64, usize, usize)> = None;
    for k in 0..BINS - 1 {
        left = (left.0.union(bins[k].0), left.1 + bins[k].1);
        // The lowest item is in the first bin; all are there where the extent is not finite.
        if right[k].1 == 0 {
            continue;
        }
        let cost = area(left.0) * left.1 as f64 + area(right[k].0) * right[k].1 as f64;
        if best.is_none_or(|(c, ..)| cost < c) {
            best = Some((cost, axis, k));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(n: usize) -> Vec<DVec3> {
        let mut s = 7u64;
        let mut next = || {
            s = s.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (s >> 40) as f64 / (1u64 << 24) as f64
        };
        (0..n).map(|_| DVec3::new(next(), next(), next())).collect()
    }

    #[test]
    fn nearest_equals_brute_force() {
        let items = points(500);
        let boxes: Vec<Aabb> = items.iter().map(|&p| Aabb::of(&[p])).collect();
        let tree = AabbTree::build(&boxes, 3);
        for q in points(200).iter().map(|p| *p * 2.0 - 0.5) {
            let d = |i: u32| items[i as usize].distance_squared(q);
            let brute = (0..500).map(|i| (d(i), i)).min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
            assert_eq!(tree.nearest(q, d), Some(brute));
            assert_eq!(tree.nearest_within(q, brute.0, d), Some(brute));
            assert_eq!(tree.nearest_within(q, brute.0.next_down(), d), None);
        }
    }

    #[test]
    fn identical_boxes_do_not_make_a_deep_tree() {
        let tree = AabbTree::build(&vec![Aabb::of(&[DVec3::ONE]); 1000], 1);
        let mut items = 0;
        tree.visit(|_| true, |leaf| items += leaf.len());
        assert_eq!(items, 1000);
        assert_eq!(tree.nearest(DVec3::ZERO, |_| 3.0), Some((3.0, 0)));
    }

    /// The items of a subtree.
    fn below(tree: &AabbTree, child: Child) -> Vec<u32> {
        match child {
            Child::Node(n) => {
                tree.nodes()[n as usize].iter().flat_map(|(_, child)| below(tree, *child)).collect()
            }
            Child::Leaf { start, end } => tree.order()[start as usize..end as usize].to_vec(),
        }
    }

    /// All splits between the bins of each axis, from the boxes of both sides.
    #[test]
    fn the_first_split_is_the_cheapest_one() {
        for seed in 0..40 {
            let random = points(120 + 3 * seed);
            let corners = &random[2 * seed..];
            let size = |k: usize| DVec3::new(0.3, 0.1, 0.05) * random[(7 * k + seed) % random.len()];
            let boxes: Vec<Aabb> =
                corners.iter().enumerate().map(|(k, &p)| Aabb::of(&[p + 2.0, p + 2.0 + size(k)])).collect();
            let spread = boxes.iter().fold(Aabb::EMPTY, |b, own| b.union(Aabb::of(&[own.center()])));
            let mut best = (f64::INFINITY, Vec::new());
            for axis in 0..3 {
                for bin in 1..BINS {
                    let share = bin as f64 / BINS as f64;
                    let at = spread.min[axis] + share * spread.extent()[axis];
                    let (left, right): (Vec<u32>, Vec<u32>) =
                        (0..boxes.len() as u32).partition(|&i| boxes[i as usize].center()[axis] < at);
                    let cost = |side: &[u32]| {
                        let [x, y, z] = side
                            .iter()
                            .fold(Aabb::EMPTY, |b, &i| b.union(boxes[i as usize]))
                            .extent()
                            .to_array();
                        side.len() as f64 * (x * y + y * z + z * x)
                    };
                    if !left.is_empty() && !right.is_empty() && cost(&left) + cost(&right) < best.0 {
                        best = (cost(&left) + cost(&right), left);
                    }
                }
            }
            let tree = AabbTree::build(&boxes, 1);
            let mut left = below(&tree, tree.nodes()[0][0].1);
            left.sort_unstable();
            assert_eq!(left, best.1, "seed {seed}");
        }
    }

    #[test]
    fn of_splits_that_cost_the_same_the_first_is_taken() {
        let boxes = [0.0, 1.0, 2.0].map(|x| Aabb::of(&[DVec3::X * x, DVec3::X * x + 0.25]));
        let tree = AabbTree::build(&boxes, 1);
        assert_eq!((below(&tree, tree.nodes()[0][0].1), tree.order()), (vec![0], &[0, 1, 2][..]));
    }

    #[test]
    fn deep_nodes_are_halved_along_their_longest_axis() {
        for lengths in
            [[4, 2, 1], [4, 1, 2], [2, 4, 1], [1, 4, 2], [2, 1, 4], [1, 2, 4], [4, 4, 1], [1, 4, 4]]
        {
            let places: Vec<DVec3> =
                points(64).iter().map(|p| *p * DVec3::from(lengths.map(f64::from))).collect();
            let boxes: Vec<Aabb> = places.iter().map(|&p| Aabb::of(&[p])).collect();
            let (mut items, mut expected): (Vec<u32>, Vec<u32>) = ((0..64).collect(), (0..64).collect());
            let extent = Aabb::of(&places).extent();
            let axis = extent.max_position();
            expected.sort_by(|&a, &b| places[a as usize][axis].total_cmp(&places[b as usize][axis]));
            assert_eq!((split(&boxes, &mut items, MEDIAN_DEPTH), items), (32, expected), "{lengths:?}");
        }
    }

    /// The nearer side is looked at first: few distances are asked for.
    #[test]
    fn the_nearest_item_is_found_at_once() {
        let items: Vec<DVec3> = (0..1024).map(|k| DVec3::X * f64::from(k)).collect();
        let boxes: Vec<Aabb> = items.iter().map(|&p| Aabb::of(&[p])).collect();
        let tree = AabbTree::build(&boxes, 1);
        for k in 0..1023u32 {
            let (q, mut asked) = (items[k as usize] + 0.25 * DVec3::X, 0);
            let nearest = tree.nearest(q, |i| {
                asked += 1;
                items[i as usize].distance_squared(q)
            });
            assert_eq!(nearest, Some((0.0625, k)));
            assert!(asked <= 2, "{asked} of item {k}");
        }
        // On ties the lowest item, from whichever side it is looked at first.
        for q in [-2.0, 2000.0] {
            assert_eq!(tree.nearest(DVec3::X * q, |_| 5e6), Some((5e6, 0)));
        }
    }

    #[test]
    fn a_tree_may_be_empty() {
        let tree = AabbTree::build(&[], 4);
        assert_eq!(tree.nearest(DVec3::ZERO, |_| 0.0), None);
    }

    #[test]
    fn visits_reach_the_leaves_whose_boxes_are_accepted() {
        let items = points(300);
        let boxes: Vec<Aabb> = items.iter().map(|&p| Aabb::of(&[p, p + 0.1])).collect();
        let tree = AabbTree::build(&boxes, 1);
        for q in &items {
            let mut found = Vec::new();
            tree.visit(|b| b.contains(*q), |leaf| found.extend_from_slice(leaf));
            found.sort_unstable();
            let expected: Vec<u32> = (0..300).filter(|&i| boxes[i as usize].contains(*q)).collect();
            assert_eq!(found, expected);
        }
    }

    /// Depth of a subtree, whose boxes must hold all items below.
    fn depth(tree: &AabbTree, (bounds, child): (Aabb, Child), boxes: &[Aabb]) -> usize {
        match child {
            Child::Node(n) => {
                let sides = tree.nodes()[n as usize];
                assert_eq!(bounds, sides[0].0.union(sides[1].0));
                1 + sides.map(|side| depth(tree, side, boxes)).into_iter().max().unwrap()
            }
            Child::Leaf { start, end } => {
                let items = tree.order()[start as usize..end as usize].iter();
                assert_eq!(bounds, items.fold(Aabb::EMPTY, |b, &i| b.union(boxes[i as usize])));
                0
            }
        }
    }

    /// Points that halve their distance from a corner again and again: a split by cost leaves most
    /// of them on one side. And points so far apart that their distance is not a number.
    #[test]
    fn points_of_all_sizes_do_not_make_a_deep_tree() {
        let along = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::Z, DVec3::new(1.0, 2.0, 0.5)];
        for way in along {
            let items: Vec<DVec3> = (0..900).map(|k| way * 2f64.powi(-k)).collect();
            let boxes: Vec<Aabb> = items.iter().map(|&p| Aabb::of(&[p])).collect();
            let tree = AabbTree::build(&boxes, 1);
            let found = depth(&tree, tree.root(), &boxes);
            assert!((MEDIAN_DEPTH..=MEDIAN_DEPTH + 10).contains(&found), "{way}: {found}");
            assert!((found..2 * found).contains(&AabbTree::MAX_DEPTH), "{way}: {found}");
            for k in [0, 1, 100, 400, 899] {
                let near = |i: u32| (items[i as usize] - items[k]).abs().max_element();
                assert_eq!(
                    tree.nearest(items[k], |i| if near(i) == 0.0 { 0.0 } else { 9.0 }),
                    Some((0.0, k as u32))
                );
            }
        }
        let far: Vec<Aabb> =
            (0..64).map(|k| Aabb::of(&[DVec3::X * if k % 2 == 0 { f64::MAX } else { f64::MIN }])).collect();
        let tree = AabbTree::build(&far, 1);
        assert_eq!(depth(&tree, tree.root(), &far), 6);
    }

    #[test]
    fn boxes_follow_items_that_move() {
        let (before, after) = (points(100), points(100).iter().map(|p| *p * 3.0 - 1.0).collect::<Vec<_>>());
        let boxes = |items: &[DVec3]| items.iter().map(|&p| Aabb::of(&[p])).collect::<Vec<_>>();
        let (mut tree, moved) = (AabbTree::build(&boxes(&before), 2), boxes(&after));
        for changed in [true, false] {
            for slot in (0..2 * tree.nodes().len() as u32).rev() {
                assert_eq!(tree.refit(slot, |i| moved[i as usize]), changed, "{slot}");
            }
            tree.refit_root(|i| moved[i as usize]);
            depth(&tree, tree.root(), &moved);
        }
    }
}
