use std::ops::ControlFlow;

use super::{Aabb, AabbTree, Child};

/// Calls `pair` once for each two items whose closed boxes share a point, lower item first, until
/// it breaks off.
///
/// `boxes` must be those that the tree was built from. The order of the calls depends on the boxes
/// alone.
pub fn self_overlaps(
    tree: &AabbTree,
    boxes: &[Aabb],
    mut pair: impl FnMut(u32, u32) -> ControlFlow<()>,
) -> ControlFlow<()> {
    let items = |start: u32, end: u32| &tree.order()[start as usize..end as usize];
    let mut report = |i: u32, j: u32| match boxes[i as usize].overlaps(boxes[j as usize]) {
        true => pair(i.min(j), i.max(j)),
        false => ControlFlow::Continue(()),
    };
    // Each entry represents all pairs of items of two subtrees, or of one subtree when both are the
    // same.
    let mut stack = vec![(tree.root(), tree.root())];
    while let Some((a, b)) = stack.pop() {
        if !a.0.overlaps(b.0) {
            continue;
        }
        match (a.1, b.1) {
            (Child::Node(n), Child::Node(m)) if n == m => {
                let [left, right] = tree.nodes()[n as usize];
                stack.extend([(right, right), (left, left), (left, right)]);
            }
            (Child::Leaf { start, end }, Child::Leaf { start: other, end: other_end }) => {
                for (k, &i) in items(start, end).iter().enumerate() {
                    let rest = if start == other { k + 1 } else { 0 };
                    items(other, other_end)[rest..].iter().try_for_each(|&j| report(i, j))?;
                }
            }
            // The larger of two different subtrees is opened, unless it is a leaf.
            (Child::Node(n), other) if matches!(other, Child::Leaf { .. }) || larger(a.0, b.0) => {
                stack.extend(tree.nodes()[n as usize].map(|side| (side, b)));
            }
            (_, Child::Node(m)) => stack.extend(tree.nodes()[m as usize].map(|side| (a, side))),
            (Child::Node(_), Child::Leaf { .. }) => {}
        }
    }
    ControlFlow::Continue(())
}

fn larger(a: Aabb, b: Aabb) -> bool {
    a.extent().length_squared() >= b.extent().length_squared()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn overlaps_equal_brute_force(
            corners in prop::collection::vec(prop::array::uniform6(0i8..20), 0..80), leaf in 1usize..5
        ) {
            let boxes: Vec<Aabb> = corners
                .iter()
                .map(|c| c.map(f64::from))
                .map(|c| {
                    let min = DVec3::new(c[0], c[1], c[2]);
                    Aabb { min, max: min + 0.2 * DVec3::new(c[3], c[4], c[5]) }
                })
                .collect();
            let mut found = Vec::new();
            let all = self_overlaps(&AabbTree::build(&boxes, leaf), &boxes, |i, j| {
                found.push((i, j));
                ControlFlow::Continue(())
            });
            prop_assert_eq!(all, ControlFlow::Continue(()));
            found.sort_unstable();
            let n = boxes.len() as u32;
            let brute: Vec<_> = (0..n)
                .flat_map(|i| (i + 1..n).map(move |j| (i, j)))
                .filter(|&(i, j)| boxes[i as usize].overlaps(boxes[j as usize]))
                .collect();
            prop_assert_eq!(&found, &brute);
            // The first pair breaks off.
            let mut seen = 0;
            let broken = self_overlaps(&AabbTree::build(&boxes, leaf), &boxes, |_, _| {
                seen += 1;
                ControlFlow::Break(())
            });
            prop_assert_eq!((broken.is_break(), seen), (!brute.is_empty(), brute.len().min(1)));
        }
    }
}
