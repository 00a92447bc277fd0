use std::cell::RefCell;

use glam::{DVec3, Vec3};

use super::kernel::{self, Nearest};
use super::locate::Faces;
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
        let bound = |b: &[f32]| {
            let d = (Vec3::from_slice(b) - p).max(p - Vec3::from_slice(&b[3..])).max(Vec3::ZERO);
            d.length_squared()
        };
        let beyond = |d: f32, limit: f32| d >= limit;
        reads.tree_nodes += self.walk_tree(bound, beyond, f32::INFINITY, |start, count| {
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
    fn walk_tree<D: Copy + PartialOrd + Default>(
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
    pub(super) fn nearest_in_list_f64(&self, faces: &Faces, p: DVec3) -> (u32, Closest) {
        thread_local! {
            static NEAR: RefCell<Vec<u32>> = const { RefCell::new(Vec::new()) };
        }
        let relative = (p - self.cube.middle()).as_vec3();
        let least = self.nearest_in_list_f32(faces, relative).distance_squared;
        let limit = (least.sqrt() * (1.0 + F32_RELATIVE) + F32_ABSOLUTE).powi(2);
        let mut best = Best::NONE;
        NEAR.with_borrow_mut(|near| {
            near.clear();
            if limit.is_finite() {
                kernel::within(self.isa, &self.records, faces.chunks(), relative, limit, near);
            }
            let candidates = if near.is_empty() { faces.ids() } else { near };
            candidates.iter().for_each(|&face| best.try_face(self, face, p));
        });
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
        let least = self.nearest_in_list_f32(faces, relative).distance_squared.sqrt();
        // The least distance over the ball is at most that at its centre.
        let limit = ((least + radius as f32) * (1.0 + F32_RELATIVE) + F32_ABSOLUTE).powi(2);
        if limit.is_finite() {
            let mut near = Vec::with_capacity(faces.ids().len());
            kernel::within(self.isa, &self.records, faces.chunks(), relative, limit, &mut near);
            near.iter().for_each(|&face| {
                offer(face);
            });
        } else {
            faces.ids().iter().for_each(|&face| {
                offer(face);
            });
        }
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

    /// As [`nearest_in_list_f64`](Self::nearest_in_list_f64) for all faces.
    pub(super) fn nearest_in_tree_f64(&self, p: DVec3) -> (u32, Closest) {
        let mut best = Best::NONE;
        // Faces at the same distance are visited too, because the lowest id wins.
        self.walk_tree(
            self.box_bound(p),
            |d: f64, limit: f64| d > limit,
            f64::INFINITY,
            |start, count| {
                (start..start + count).for_each(|face| best.try_face(self, face, p));
                best.closest.distance
            },
        );
        (best.position, best.closest)
    }
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

    fn try_face(&mut self, asset: &TeSdf, position: u32, p: DVec3) {
        let closest = asset.local_triangle(position as usize).closest(p);
        let id = asset.face_ids[position as usize];
        let tie = closest.distance == self.closest.distance && id < self.id;
        if closest.distance < self.closest.distance || tie {
            *self = Self { position, id, closest };
        }
    }
}
