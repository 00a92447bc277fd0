use std::cell::RefCell;

use glam::{DVec3, Vec3};

use super::kernel::{self, LANES, Nearest};
use super::locate::Faces;
use super::polygon::{MAX_POINTS, PolygonAxes};
use crate::TeSdf;
use crate::asset::layout::{TREE_LEAF, TreeChild};
use crate::geometry::{AabbTree, Closest, Feature};

/// Numbers of items that a query reads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reads {
    /// Faces of the cell's list.
    pub list_entries: usize,
    /// Faces in leaves of the face tree.
    pub tree_faces: usize,
    /// Nodes of the face tree.
    pub tree_nodes: usize,
}

impl Reads {
    /// Sum of faces and nodes.
    pub fn total(self) -> usize {
        self.list_entries + self.tree_faces + self.tree_nodes
    }
}

/// Twice the error of a distance from the `f32` kernel, relative and absolute (local frame).
///
/// Coordinates of points up to 4 from the centre have an error of at most 2^-22, those of faces,
/// within 1, of 2^-25. A face that counts as its edges adds 3.5e-7
/// ([`FaceRecord`](crate::asset::FaceRecord)). A squared distance of some twenty operations has a
/// relative error of 2^-20, including the low bits that name the part.
const F32_RELATIVE: f32 = 4e-6;
const F32_ABSOLUTE: f32 = 4e-6;

/// The constants above hold for cubes with a side up to this, which contain all faces, and for
/// points up to half of this from the centre along each axis (local frame).
const F32_REACH: f64 = 4.0;

// A leaf of the face tree is one step of the kernel.
const _: () = assert!(TREE_LEAF == kernel::LANES);

/// Size of a stack that stores the farther child for later: one entry per level.
const STACK: usize = AabbTree::MAX_DEPTH + 2;

impl TeSdf {
    #[inline]
    pub(super) fn nearest_in_list_f32(&self, faces: &Faces, p: Vec3) -> Nearest {
        kernel::nearest(self.isa, &self.records, faces.chunks(), p, Nearest::NONE)
    }

    /// The nearest of all faces. `p` is relative to the centre of the cube.
    pub(super) fn nearest_in_tree_f32(&self, p: Vec3, reads: &mut Reads) -> Nearest {
        let mut best = Nearest::NONE;
        let beyond = |d: f32, limit: f32| d >= limit;
        reads.tree_nodes += self.walk_tree(squared_box_bound(p), beyond, f32::INFINITY, |start, count| {
            reads.tree_faces += count as usize;
            let faces = std::array::from_fn(|l| start + (l as u32).min(count - 1));
            best = kernel::nearest(self.isa, &self.records, &[faces], p, best);
            best.distance_squared
        });
        best
    }

    /// Visits the leaves of the face tree, the nearer child first, except leaves whose `bound` is
    /// `beyond` the limit.
    ///
    /// `leaf` receives the first face and the number of faces, and returns the new limit. Returns
    /// the number of nodes read.
    #[inline]
    pub(super) fn walk_tree<D: Copy + PartialOrd + Default>(
        &self,
        bound: impl Fn(&[f32]) -> D,
        beyond: impl Fn(D, D) -> bool,
        mut limit: D,
        mut leaf: impl FnMut(u32, u32) -> D,
    ) -> usize {
        let mut nodes = 0;
        let mut stack = [(D::default(), TreeChild::Node(0)); STACK];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let (d, child) = stack[top];
            if beyond(d, limit) {
                continue;
            }
            match child {
                TreeChild::Leaf(start, count) => limit = leaf(start, count),
                TreeChild::Node(n) => {
                    nodes += 1;
                    let boxes = &self.tree_boxes[n as usize];
                    let [left, right] = self.tree_children[n as usize].map(TreeChild::decode);
                    let (a, b) = ((bound(&boxes[..6]), left), (bound(&boxes[6..]), right));
                    let (near, far) = if a.0 <= b.0 { (a, b) } else { (b, a) };
                    stack[top] = far;
                    stack[top + 1] = near;
                    top += 2;
                }
            }
        }
        nodes
    }

    /// The nearest face of a list: its index and closest point. `p` is in the local frame. Ties go
    /// to the lowest id.
    ///
    /// The `f32` kernel selects the candidates: faces within its rounding of the least distance.
    /// `seen` receives them.
    #[inline]
    pub(super) fn nearest_in_list_f64(
        &self,
        faces: &Faces,
        p: DVec3,
        seen: &mut impl FnMut(u32, &Closest),
    ) -> (u32, Closest) {
        let relative = (p - self.cube.middle()).as_vec3();
        let mut best = Best::NONE;
        self.each_in_list(faces, relative, |least| least, &mut |face| best.try_face(self, face, p, seen));
        (best.position, best.closest)
    }

    /// Offers those faces of a list that can be nearest to a set of points. The set lies within
    /// `radius` of `center` and contains `center` (local frame).
    pub(crate) fn near_in_list(
        &self,
        faces: &Faces,
        center: DVec3,
        radius: f64,
        offer: &mut impl FnMut(u32) -> f64,
    ) {
        let relative = (center - self.cube.middle()).as_vec3();
        // The least distance over the ball is at most that at its centre.
        self.each_in_list(faces, relative, |least| least + radius as f32, &mut |face| {
            offer(face);
        });
    }

    /// Offers the faces of a list whose distance from a point, relative to the centre of the cube,
    /// can be up to `distance`, which receives the least distance of all.
    #[inline]
    fn each_in_list(
        &self,
        faces: &Faces,
        relative: Vec3,
        distance: impl Fn(f32) -> f32,
        offer: &mut impl FnMut(u32),
    ) {
        thread_local! {
            static SQUARED: RefCell<Vec<[f32; LANES]>> = const { RefCell::new(Vec::new()) };
        }
        // The buffer is taken, because `offer` may read another list.
        let mut squared = SQUARED.take();
        squared.resize(squared.len().max(faces.chunks().len()), [0.0; LANES]);
        let least = kernel::distances(self.isa, &self.records, faces.chunks(), relative, &mut squared);
        let limit = squared_limit(distance(least.sqrt()));
        if limit.is_finite() {
            let squared = squared.as_flattened();
            faces.ids().iter().zip(squared).filter(|(_, d)| **d <= limit).for_each(|(&face, _)| offer(face));
        } else {
            faces.ids().iter().copied().for_each(offer);
        }
        SQUARED.set(squared);
    }

    /// Offers the faces that can come within a limit of a convex polygon, those in nearer boxes
    /// first. `points` are those of the polygon, from one to [`MAX_POINTS`]; `normal` is that of
    /// its plane, or zero (local frame). `limit` is the first limit, and `offer` returns the next
    /// one.
    pub(crate) fn near_polygon(
        &self,
        points: &[DVec3],
        normal: DVec3,
        limit: f64,
        offer: &mut impl FnMut(u32) -> f64,
    ) {
        let axes = self.axes(points, normal);
        let mut now = axes.with_slack(limit);
        self.walk_tree(
            |b: &[f32]| axes.to_box(b),
            |d: f32, limit: f32| d > limit,
            now,
            |start, count| {
                now = self.offer_leaf(start, count, &axes, now, offer);
                now
            },
        );
    }

    /// The axes of a polygon in the local frame, with one to [`MAX_POINTS`] points.
    pub(super) fn axes(&self, points: &[DVec3], normal: DVec3) -> PolygonAxes {
        let middle = self.cube.middle();
        let mut relative = [DVec3::ZERO; MAX_POINTS];
        relative.iter_mut().zip(points).for_each(|(to, &p)| *to = p - middle);
        PolygonAxes::new(&relative[..points.len().min(MAX_POINTS)], normal)
    }

    /// Offers the faces of a leaf that can come within a limit of a polygon, the nearer first, as
    /// far as bounds tell. `now` is the limit with slack; returns the next one.
    pub(super) fn offer_leaf(
        &self,
        start: u32,
        count: u32,
        axes: &PolygonAxes,
        mut now: f32,
        offer: &mut impl FnMut(u32) -> f64,
    ) -> f32 {
        let faces: [u32; TREE_LEAF] = std::array::from_fn(|l| start + (l as u32).min(count - 1));
        let bounds = kernel::apart(self.isa, &self.records, &faces, axes);
        // The lanes within the limit, the nearest last.
        let mut near = [0; TREE_LEAF];
        let mut waiting = 0;
        for lane in 0..count as usize {
            if bounds[lane] <= now {
                let mut at = waiting;
                while at > 0 && bounds[near[at - 1]] < bounds[lane] {
                    near[at] = near[at - 1];
                    at -= 1;
                }
                near[at] = lane;
                waiting += 1;
            }
        }
        for &lane in near[..waiting].iter().rev() {
            if bounds[lane] > now {
                break;
            }
            now = axes.with_slack(offer(faces[lane]));
        }
        now
    }

    /// Offers the faces that can be within `limit` of a point. `faces` are those of the list that
    /// answers the point, if it has one.
    pub(crate) fn faces_within(&self, p: DVec3, faces: &Faces, limit: f64, offer: &mut impl FnMut(u32)) {
        if faces.ids().is_empty() {
            let mut offer = |face| {
                offer(face);
                limit
            };
            return self.near_polygon(&[p], DVec3::ZERO, limit, &mut offer);
        }
        let relative = (p - self.cube.middle()).as_vec3();
        self.each_in_list(faces, relative, |_| limit as f32, offer);
    }

    /// As [`near_in_list`](Self::near_in_list) for all faces, from the face tree. `offer` returns
    /// the least distance so far, over the ball.
    pub(crate) fn near_in_tree(&self, center: DVec3, radius: f64, offer: &mut impl FnMut(u32) -> f64) {
        self.walk_tree(
            self.box_bound(center),
            |d: f64, limit: f64| d > limit,
            f64::INFINITY,
            |start, count| (start..start + count).map(&mut *offer).fold(f64::INFINITY, f64::min) + radius,
        );
    }

    /// Lower bound of the distance from `p` to a box. The factor covers the rounding of the bound
    /// itself.
    fn box_bound(&self, p: DVec3) -> impl Fn(&[f32]) -> f64 {
        let relative = p - self.cube.middle();
        move |b: &[f32]| {
            let (low, high) = (Vec3::from_slice(b).as_dvec3(), Vec3::from_slice(&b[3..]).as_dvec3());
            (low - relative).max(relative - high).max(DVec3::ZERO).length() * (1.0 - 1e-14)
        }
    }

    /// Whether the error bounds of distances in `f32` hold at a point.
    pub(super) fn is_in_reach_of_f32(&self, p: DVec3) -> bool {
        let relative = p - self.cube.middle();
        self.cube.side() <= F32_REACH && 2.0 * relative.abs().max_element() <= F32_REACH
    }

    /// As [`nearest_in_list_f64`](Self::nearest_in_list_f64) for all faces.
    pub(super) fn nearest_in_tree_f64(
        &self,
        p: DVec3,
        seen: &mut impl FnMut(u32, &Closest),
    ) -> (u32, Closest) {
        let mut best = Best::NONE;
        if self.is_in_reach_of_f32(p) {
            let relative = (p - self.cube.middle()).as_vec3();
            self.near_in_tree_f32(relative, &mut |face| best.try_face(self, face, p, seen));
        }
        if best.id == Best::NONE.id {
            // Faces at the same distance are visited too, because the lowest id wins.
            self.walk_tree(
                self.box_bound(p),
                |d: f64, limit: f64| d > limit,
                f64::INFINITY,
                |start, count| {
                    (start..start + count).for_each(|face| best.try_face(self, face, p, seen));
                    best.closest.distance
                },
            );
        }
        (best.position, best.closest)
    }

    /// Offers the faces within the rounding of the `f32` kernel of the least distance, of all
    /// faces. `p` is relative to the centre of the cube.
    fn near_in_tree_f32(&self, p: Vec3, offer: &mut impl FnMut(u32)) {
        thread_local! {
            static NEAR: RefCell<Vec<(u32, f32)>> = const { RefCell::new(Vec::new()) };
        }
        let mut near = NEAR.take();
        near.clear();
        let (mut least, mut limit) = (f32::INFINITY, f32::INFINITY);
        self.walk_tree(
            squared_box_bound(p),
            |d, limit| d > limit,
            f32::INFINITY,
            |start, count| {
                let faces = std::array::from_fn(|l| start + (l as u32).min(count - 1));
                let mut squared = [[0.0; LANES]];
                let nearer = kernel::distances(self.isa, &self.records, &[faces], p, &mut squared);
                if nearer < least {
                    (least, limit) = (nearer, squared_limit(nearer.sqrt()));
                }
                let all = faces.into_iter().zip(squared[0]).take(count as usize);
                near.extend(all.filter(|(_, d)| *d <= limit));
                limit
            },
        );
        if limit.is_finite() {
            near.iter().filter(|(_, d)| *d <= limit).for_each(|(face, _)| offer(*face));
        }
        NEAR.set(near);
    }
}

/// Lower bound of the squared distance from `p` to a box of the face tree, up to rounding.
fn squared_box_bound(p: Vec3) -> impl Fn(&[f32]) -> f32 {
    move |b| {
        let d = (Vec3::from_slice(b) - p).max(p - Vec3::from_slice(&b[3..])).max(Vec3::ZERO);
        d.length_squared()
    }
}

/// The squared distance in `f32` up to which a face can be within `distance`.
fn squared_limit(distance: f32) -> f32 {
    let limit = distance * (1.0 + F32_RELATIVE) + F32_ABSOLUTE;
    limit * limit
}

struct Best {
    position: u32,
    id: u32,
    closest: Closest,
}

impl Best {
    const NONE: Self = Self {
        position: 0,
        id: u32::MAX,
        closest: Closest { distance: f64::INFINITY, point: DVec3::NAN, feature: Feature::Face },
    };

    #[inline]
    fn try_face(&mut self, asset: &TeSdf, position: u32, p: DVec3, seen: &mut impl FnMut(u32, &Closest)) {
        let closest = asset.local_triangle(position as usize).closest(p);
        seen(position, &closest);
        let id = asset.face_ids[position as usize];
        let tie = closest.distance == self.closest.distance && id < self.id;
        if closest.distance < self.closest.distance || tie {
            *self = Self { position, id, closest };
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::asset::FaceRecord;
    use crate::asset::layout::SignHints;
    use crate::base::Isa;
    use crate::geometry::Aabb;
    use crate::geometry::{Triangle, polygon_to_triangle};
    use crate::testing::degenerate;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(crate::testing::rotation::cases(20_000)))]
        // The mesh is within a ball of diameter 1; the polygon may be a hundred times as large.
        #[test]
        fn bounds_are_below_the_distance(
            shape in degenerate::face(),
            face in degenerate::face(),
            size in prop::sample::select(vec![0.25, 25.0]),
            shift in prop::array::uniform3(-0.5..0.5f64),
        ) {
            let points = shape.map(|p| size * p + DVec3::from_array(shift));
            let corners = face.map(|c| 0.25 * c);
            let (whole, triangle) = (Triangle::new(points), Triangle::new(corners));
            let distance = polygon_to_triangle(&points, whole.normal, &triangle, f64::INFINITY)
                .map_or(f64::INFINITY, |found| found.0);
            let axes = PolygonAxes::new(&points, whole.normal);
            let limit = axes.with_slack(distance);
            let record = FaceRecord::new(&triangle, DVec3::ZERO, SignHints::default());
            for &isa in Isa::of_processor() {
                for bound in kernel::apart(isa, &[record], &[0; TREE_LEAF], &axes) {
                    prop_assert!(bound <= limit, "{isa:?}: {bound} of {distance}");
                }
            }
            let bounds = Aabb::of(&corners).rounded_from(DVec3::ZERO);
            prop_assert!(axes.to_box(&bounds) <= limit, "box: {} of {distance}", axes.to_box(&bounds));
            for &isa in Isa::of_processor() {
                for bound in kernel::boxes_apart(isa, &bounds.map(|x| [x; TREE_LEAF]), &axes) {
                    prop_assert!(bound <= limit, "box, {isa:?}: {bound} of {distance}");
                }
            }
        }
    }
}
