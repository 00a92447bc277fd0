use glam::DVec3;

use super::{Aabb, AabbTree, Child, signed_crossing};

/// The winding number of a triangle mesh, exact and deterministic.
///
/// It counts how often the surface goes around a point: 1 inside a simple outward surface, 0
/// outside, 2 where two such solids overlap, -1 inside an inverted solid. For a closed surface it
/// is an integer that depends on the surface alone. A surface is closed when every directed edge is
/// used as often as its reverse. For an open surface the results have no meaning.
///
/// The method compares a point with a far point by the crossings of the segment between them
/// ([`signed_crossing`]). The segment runs along an axis, through the nearest side of the bounds.
/// It is therefore a box itself, and finding the boxes of the tree that it meets needs no rounding.
#[derive(Clone, Debug)]
pub struct WindingNumber {
    tree: AabbTree,
    /// Corners of the faces, in tree order.
    triangles: Vec<[DVec3; 3]>,
    bounds: Aabb,
}

const LEAF_SIZE: usize = 4;

impl WindingNumber {
    /// Builds the tree over triangles.
    pub fn of_triangles(triangles: Vec<[DVec3; 3]>) -> Self {
        let boxes: Vec<Aabb> = triangles.iter().map(|t| Aabb::of(t)).collect();
        let tree = AabbTree::build(&boxes, LEAF_SIZE);
        let triangles = tree.order().iter().map(|&f| triangles[f as usize]).collect();
        let bounds = tree.root().0;
        Self { tree, triangles, bounds }
    }

    /// Winding number at `x`, which must not be on the surface. On the surface the result may be
    /// the number on either side or another number. It is 0 for NaN.
    pub fn at(&self, x: DVec3) -> i32 {
        if !self.bounds.contains(x) {
            return 0;
        }
        self.crossings(x, self.far_point(x))
    }

    /// Winding number at `p + (e, e^2, e^3)` with `e > 0` infinitesimal. It is defined for every
    /// `p`, also on the surface. It is 0 for NaN.
    pub fn at_perturbed(&self, p: DVec3) -> i32 {
        let mut sum = 0;
        self.for_each_crossing_to(p, |_, sign| sum += sign);
        sum
    }

    /// `winding(x) - winding(p')` with `p' = p + (e, e^2, e^3)`: the sum of [`signed_crossing`]
    /// over the faces. `x` must not be on the surface.
    pub fn crossings(&self, x: DVec3, p: DVec3) -> i32 {
        let mut sum = 0;
        self.for_each_crossing(x, p, |_, sign| sum += sign);
        sum
    }

    /// The tree over the faces.
    pub(crate) fn tree(&self) -> &AabbTree {
        &self.tree
    }

    /// Calls `crossed` for each face that the segment from the far point to `p + (e, e^2, e^3)`
    /// crosses, with the change of the winding number there. [`at_perturbed`](Self::at_perturbed)
    /// adds up these changes.
    pub(crate) fn for_each_crossing_to(&self, p: DVec3, mut crossed: impl FnMut(u32, i32)) {
        if self.bounds.contains(p) {
            self.for_each_crossing(self.far_point(p), p, |face, sign| crossed(face, -sign));
        }
    }

    fn for_each_crossing(&self, x: DVec3, p: DVec3, mut crossed: impl FnMut(u32, i32)) {
        let segment = Segment::new(x, p);
        let mut stack = vec![self.tree.root()];
        while let Some((bounds, child)) = stack.pop() {
            if !segment.may_meet(bounds) {
                continue;
            }
            match child {
                Child::Node(n) => stack.extend(self.tree.nodes()[n as usize]),
                Child::Leaf { start, end } => {
                    for i in start as usize..end as usize {
                        match signed_crossing(x, p, self.triangles[i]) {
                            0 => {}
                            sign => crossed(self.tree.order()[i], sign),
                        }
                    }
                }
            }
        }
    }

    /// A point outside the bounds, from `x` along an axis through the nearest side.
    pub(crate) fn far_point(&self, x: DVec3) -> DVec3 {
        let Aabb { min, max } = self.bounds;
        let step = self.bounds.extent().max_element();
        let mut best = (f64::INFINITY, x);
        for axis in 0..3 {
            // Far from the origin, rounding can swallow the step. The next floating-point number is
            // then outside too.
            let up = (max[axis] + step).max(max[axis].next_up());
            let down = (min[axis] - step).min(min[axis].next_down());
            for (distance, to) in [(max[axis] - x[axis], up), (x[axis] - min[axis], down)] {
                if distance < best.0 {
                    let mut far = x;
                    far[axis] = to;
                    best = (distance, far);
                }
            }
        }
        best.1
    }
}

/// A segment, prepared for tests that it misses a box.
struct Segment {
    bounds: Aabb,
    /// Its middle, half of its direction vector, and the absolute values of that half.
    middle: DVec3,
    half: DVec3,
    half_abs: DVec3,
    /// A bound of the rounding errors of [`may_meet`](Self::may_meet) for boxes that overlap the
    /// segment's bounds.
    margin: f64,
    along_axis: bool,
}

impl Segment {
    fn new(x: DVec3, p: DVec3) -> Self {
        let (middle, half) = (0.5 * (x + p), 0.5 * (p - x));
        let scale = x.abs().max(p.abs()).max_element();
        Self {
            bounds: Aabb::of(&[x, p]),
            middle,
            half,
            half_abs: half.abs(),
            margin: 1e-14 * scale,
            along_axis: half.to_array().into_iter().filter(|&h| h != 0.0).count() <= 1,
        }
    }

    /// False only when the segment misses the closed box. Separating axes: the axes of the box
    /// exactly, their cross products with the segment with a margin.
    fn may_meet(&self, b: Aabb) -> bool {
        if !self.bounds.overlaps(b) {
            return false;
        }
        if self.along_axis {
            return true;
        }
        let size = 0.5 * b.extent();
        let to = self.middle - b.center();
        // Each coordinate of `to`, `size` and `half` has an error of some ulps of the coordinates
        // of the box or the segment.
        let margin = self.margin + 1e-14 * b.min.abs().max(b.max.abs()).max_element();
        let (h, g) = (self.half, self.half_abs);
        let misses = |i: usize, j: usize| {
            let reach = size[i] * g[j] + size[j] * g[i];
            let slack = margin * (g[i] + g[j] + size[i] + size[j] + to[i].abs() + to[j].abs());
            (to[i] * h[j] - to[j] * h[i]).abs() > reach + slack
        };
        !(misses(1, 2) || misses(2, 0) || misses(0, 1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::strategy::point;
    use crate::testing::random;
    use proptest::prelude::*;

    /// Two cubes that overlap, one within the other, and one inverted: outward, edge and lowest
    /// corner.
    fn cubes() -> Vec<[DVec3; 3]> {
        let cube = |(low, edge, outward): (DVec3, f64, bool)| {
            let corner =
                move |k: usize| low + edge * DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
            let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
            sides.into_iter().flat_map(move |[a, b, c, d]| {
                [[a, b, c], [a, c, d]]
                    .map(|t| if outward { t.map(corner) } else { [t[0], t[2], t[1]].map(corner) })
            })
        };
        let all = [
            (DVec3::ZERO, 4.0, true),
            (DVec3::splat(2.0), 4.0, true),
            (DVec3::ONE, 1.0, true),
            (DVec3::X * 8.0, 2.0, false),
        ];
        all.into_iter().flat_map(cube).collect()
    }

    /// Points of a lattice with corners, edges and sides of the cubes, and outside.
    #[test]
    fn cubes_count_as_often_as_they_contain_a_point() {
        let winding = WindingNumber::of_triangles(cubes());
        let held = |p: DVec3, low: f64, edge: f64| {
            i32::from(p.cmpge(DVec3::splat(low)).all() && p.cmplt(DVec3::splat(low + edge)).all())
        };
        for k in 0..24 * 16 * 16 {
            let p = 0.5 * DVec3::new((k % 24) as f64, (k / 24 % 16) as f64, (k / 384) as f64) - 0.5;
            // The point moves up by an infinitesimal step, so that the lower sides contain it.
            let moved = held(p, 0.0, 4.0) + held(p, 2.0, 4.0) + held(p, 1.0, 1.0)
                - held(p - DVec3::X * 8.0, 0.0, 2.0);
            assert_eq!(winding.at_perturbed(p), moved, "{p}");
            let inside = p + 0.13;
            let expected = winding.at_perturbed(inside);
            assert_eq!(winding.at(inside), expected, "{inside}");
            assert_eq!(winding.crossings(inside, p), expected - moved, "{p}");
        }
        assert_eq!((winding.at(DVec3::NAN), winding.at_perturbed(DVec3::NAN)), (0, 0));
    }

    #[test]
    fn the_far_point_is_beyond_the_nearest_side() {
        for at in [0.0, -1e3, 1e17, -1e17] {
            let moved = cubes().iter().map(|t| t.map(|c| c + at)).collect();
            let winding = WindingNumber::of_triangles(moved);
            let Aabb { min, max } = winding.bounds;
            for axis in 0..3 {
                for (side, beyond) in [(min, -10.0), (max, 10.0)] {
                    let mut p = winding.bounds.center();
                    p[axis] = side[axis];
                    let far = winding.far_point(p);
                    assert!(!winding.bounds.contains(far), "{at} {far}");
                    assert_eq!((0..3).filter(|&k| far[k] != p[k]).count(), 1, "{at} {far}");
                    // At 1e17, the cubes have no extent along two axes, and all sides are as near.
                    assert!(at.abs() > 1e9 || far[axis] == side[axis] + beyond, "{at} {far}");
                }
            }
        }
    }

    /// The part of a segment in a box, by clipping with each side: its length, or how far the
    /// segment misses.
    fn clipped(x: DVec3, p: DVec3, b: Aabb) -> f64 {
        let (mut first, mut last) = (0f64, 1f64);
        for axis in 0..3 {
            let along = p[axis] - x[axis];
            if along == 0.0 {
                if x[axis] < b.min[axis] || x[axis] > b.max[axis] {
                    return -1.0;
                }
                continue;
            }
            let (s, t) = ((b.min[axis] - x[axis]) / along, (b.max[axis] - x[axis]) / along);
            (first, last) = (first.max(s.min(t)), last.min(s.max(t)));
        }
        last - first
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]
        #[test]
        fn segments_meet_the_boxes_that_clip_them(
            x in point(), p in point(), flat in 0usize..4, corners in [point(), point()], unit in -200..200
        ) {
            let unit = 2f64.powi(unit);
            let (x, mut p, corners) = (unit * x, unit * p, corners.map(|p| unit * p));
            if flat < 3 {
                p[flat] = x[flat];
            }
            let b = Aabb::of(&corners);
            let length = clipped(x, p, b);
            prop_assume!(length.abs() > 1e-9);
            prop_assert_eq!(Segment::new(x, p).may_meet(b), length > 0.0, "{}", length);
            let along = DVec3::new(p.x, x.y, x.z);
            prop_assert_eq!(Segment::new(x, along).may_meet(b), clipped(x, along, b) >= 0.0);
        }
    }

    /// A corner of the box lies on the segment, at its end or in its middle. Coordinates are integers
    /// of up to 53 bits times a unit, so that this is exact, but sums and products of them are not.
    #[test]
    fn segments_meet_the_boxes_that_they_touch() {
        let mut state = 5;
        for k in 0..60_000u32 {
            let unit = [1.0, 2f64.powi(-52), 2f64.powi(-90)][k as usize % 3];
            let mut bits = |of: &[[i32; 3]]| {
                let choice = of[(random(&mut state) * of.len() as f64) as usize];
                DVec3::from_array(choice.map(|bits| ((random(&mut state) - 0.5) * 2f64.powi(bits)).round()))
            };
            let corner = bits(&[[53; 3], [30, 53, 40], [40, 3, 53], [53, 9, 9]]);
            let way = bits(&[[50; 3], [2, 52, 2], [3, 40, 2], [52, 3, 30], [9, 30, 52], [9; 3]]);
            let other = bits(&[[50; 3], [1, 1, 52], [2, 52, 2], [52, 2, 2], [2; 3]]);
            let b = Aabb::of(&[unit * corner, unit * (corner + other)]);
            for (x, p) in [(corner, corner + way), (corner - way, corner + way), (corner + way, corner)] {
                assert!(Segment::new(unit * x, unit * p).may_meet(b), "{x} {p} {b:?}");
            }
        }
    }
}
