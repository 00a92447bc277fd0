//! The body of a pair whose surface is tested, and the broad phase, which finds its faces or nodes
//! that can touch a field.
use glam::{DMat3, DVec3, Vec3};

use crate::TeSdf;
use crate::asset::layout::TreeChild;
use crate::base::elementary;
use crate::collide::bodies::branch::Branch;
use crate::collide::bodies::field::{Field, FieldBody};
use crate::collide::bodies::reach::Reach;
use crate::collide::bodies::round_side::RoundSide;
use crate::collide::bodies::turned::turn;
use crate::collide::mode::Mode;
use crate::collide::scene::cylinder::Cylinder;
use crate::collide::scene::pose::Placement;
use crate::collide::scene::shape::Shape;
use crate::collide::scene::simple::{Simple, plane_square};
use crate::geometry::{Aabb, Triangle};
use crate::query::Facing;

/// A surface placed in the world, mapped to the frame of a field.
#[derive(Clone, Debug)]
pub struct SurfaceBody<'a> {
    shape: &'a Shape,
    /// A point p of the shape's frame is `linear` · p + `shift` in the field's frame.
    linear: DMat3,
    shift: DVec3,
    /// Field units per unit of the shape.
    scale: f64,
    /// How far the surfaces lie from the faces and the field's zero: half of the thicknesses of
    /// both bodies, where they are sheets. In the field's frame.
    around: f64,
}

/// The result of the broad phase: faces or nodes of a surface that can touch, in order.
pub type Candidates = Vec<u32>;

/// A face, a node, or the core of a rounded shape, in the field's frame.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    points: [DVec3; 3],
    count: usize,
    /// The surface lies within this distance of the part.
    pub radius: f64,
    /// Unit normal; zero for a rounded shape or a part without area.
    pub normal: DVec3,
    /// Whether the normal is right everywhere on the part.
    pub facing: PartFacing,
}

/// Where the normal of a face points outward.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartFacing {
    /// Everywhere on the face.
    Everywhere,
    /// At its centre. Elsewhere the other side of the face may be outside.
    AtCenter,
}

/// A point is at a side of a box when it is nearer to it than this part of the least half extent:
/// less than what counts as at a side of its faces (`descent.rs`).
const AT_SIDE: f64 = 1e-5;

impl Part {
    pub fn new(points: &[DVec3], radius: f64) -> Self {
        let (normal, facing) = (DVec3::ZERO, PartFacing::Everywhere);
        let mut part = Self { points: [DVec3::ZERO; 3], count: points.len(), radius, normal, facing };
        part.points[..points.len()].copy_from_slice(points);
        if let [a, b, c] = *points {
            part.normal = Triangle::new([a, b, c]).normal;
        }
        part
    }

    /// The one to three points.
    pub fn points(&self) -> &[DVec3] {
        &self.points[..self.count]
    }

    /// A ball around the part's core: the centre of its box, and the radius.
    pub fn ball(&self) -> (DVec3, f64) {
        let center = Aabb::of(self.points()).center();
        (center, self.points().iter().map(|p| p.distance(center)).fold(0.0, f64::max))
    }
}

impl<'a> SurfaceBody<'a> {
    /// A shape at `placement`, mapped to the field's frame.
    pub fn new(shape: &'a Shape, placement: Placement, field: &FieldBody) -> Self {
        // The map is affine, so the images of the origin and the axes define it.
        let shift = field.to_field(placement.to_world(DVec3::ZERO));
        let unit = placement.scale / field.unit();
        let rotate = |axis: DVec3| field.rotate_back(placement.pose.rotation * axis) * unit;
        let linear = DMat3::from_cols(rotate(DVec3::X), rotate(DVec3::Y), rotate(DVec3::Z));
        let own = if let Shape::Mesh(asset) = shape {
            asset.half_thickness * asset.frame.inverse_scale() * unit
        } else {
            0.0
        };
        let linear = match *shape {
            Shape::Cylinder { half_height, radius } => {
                linear * turn(&Cylinder { half_height, radius }, linear, shift, &field.field)
            }
            _ => linear,
        };
        Self { shape, linear, shift, scale: unit, around: own + field.half_thickness() }
    }

    /// The round side of a cylinder, which its faces are inside of.
    pub fn round_side(&self) -> Option<RoundSide> {
        let Shape::Cylinder { radius, .. } = *self.shape else { return None };
        let axis = self.linear.z_axis.normalize_or_zero();
        Some(RoundSide { center: self.shift, axis, radius: radius * self.scale })
    }

    /// How far the surfaces lie from the faces and the field's zero, in the field's frame.
    pub fn around(&self) -> f64 {
        self.around
    }

    /// From the shape's frame to the field's frame.
    #[inline]
    pub fn to_field(&self, p: DVec3) -> DVec3 {
        self.linear * p + self.shift
    }

    /// From the field's frame to the shape's frame.
    fn out_of_field(&self, p: DVec3) -> DVec3 {
        self.linear.transpose() * (p - self.shift) / (self.scale * self.scale)
    }

    /// Faces of the leaves that can come within `reach` (field's frame) of the solid. For a simple
    /// shape, the indices of its parts.
    pub fn faces_of_leaves(&self, field: &FieldBody, reach: &Reach) -> Candidates {
        let mut faces = Vec::new();
        match self.shape {
            Shape::Mesh(asset) => {
                self.visit_leaves(asset, field, reach, |start, count| faces.extend(start..start + count));
            }
            Shape::Plane => faces.extend(0..2),
            simple => faces.extend(0..Simple::from(simple).part_count()),
        }
        faces
    }

    /// Faces that can come within `reach` (field's frame) of the solid. For a simple shape, the
    /// indices of its parts.
    pub fn faces(&self, field: &FieldBody, reach: &Reach) -> Candidates {
        let mut faces = self.faces_of_leaves(field, reach);
        faces.retain(|&face| {
            let part = self.face(face, field, reach.most);
            let (center, ball) = part.ball();
            !field.is_beyond(center, ball, reach.of(part.points(), part.radius) + part.radius)
        });
        faces
    }

    /// The vertices of the faces in the leaves that can come within `reach`. For a simple shape,
    /// all its nodes.
    pub fn nodes(&self, field: &FieldBody, reach: &Reach) -> Candidates {
        let Shape::Mesh(asset) = self.shape else {
            return (0..self.node_count()).collect();
        };
        let mut nodes = Vec::new();
        self.visit_leaves(asset, field, reach, |start, count| {
            nodes.extend(asset.faces[start as usize..(start + count) as usize].as_flattened());
        });
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// A candidate face.
    pub fn face(&self, face: u32, field: &FieldBody, reach: f64) -> Part {
        match self.shape {
            Shape::Mesh(asset) if asset.faces_look_outward() => {
                Part::new(&asset.face_corners(face as usize).map(|p| self.to_field(p)), self.around)
            }
            Shape::Mesh(asset) => {
                let [a, b, c] = asset.face_corners(face as usize).map(|p| self.to_field(p));
                let center = asset.local_corners(face as usize).iter().sum::<DVec3>() / 3.0;
                let points = match asset.facing(face, center) {
                    Facing::Inward => [a, c, b],
                    Facing::Outward | Facing::Either => [a, b, c],
                };
                Part { facing: PartFacing::AtCenter, ..Part::new(&points, self.around) }
            }
            Shape::Plane => {
                // Only the part over or under the field's body matters.
                let (center, radius) = field.ball();
                let center = self.out_of_field(center);
                let square = plane_square(center, (radius + reach) / self.scale);
                Part::new(&square[face as usize % 2].map(|p| self.to_field(p)), self.around)
            }
            simple => {
                let simple = Simple::from(simple);
                let mut points = simple.part(face);
                points.iter_mut().for_each(|p| *p = self.to_field(*p));
                Part::new(&points, simple.radius() * self.scale + self.around)
            }
        }
    }

    /// The normal that points outward at a point of a face (field's frame); zero where it points
    /// outward on both sides or on none. `None` where the face's part has it.
    pub fn outward_at(&self, face: u32, point: DVec3) -> Option<DVec3> {
        match self.shape {
            Shape::Mesh(asset) if !asset.faces_look_outward() => {
                let normal = asset.outward_normal(face, asset.frame.to_local(self.out_of_field(point)));
                Some((self.linear * normal).normalize_or_zero())
            }
            _ => None,
        }
    }

    /// Whether it is that of a mesh.
    pub fn is_mesh(&self) -> bool {
        matches!(self.shape, Shape::Mesh(_))
    }

    /// Whether the faces are those of a sheet, which has a surface on both sides of them.
    pub fn is_sheet(&self) -> bool {
        matches!(self.shape, Shape::Mesh(asset) if asset.half_thickness > 0.0)
    }

    /// The corners of a face, or of the core of a rounded shape, whose surface lies within the
    /// radius. A segment has two equal corners.
    pub fn triangle(&self, face: u32, field: &FieldBody) -> ([DVec3; 3], f64) {
        match self.shape {
            Shape::Mesh(asset) => (asset.face_corners(face as usize).map(|p| self.to_field(p)), self.around),
            _ => {
                let part = self.face(face, field, 0.0);
                let points = part.points();
                (std::array::from_fn(|k| points[k.min(points.len() - 1)]), part.radius)
            }
        }
    }

    /// A face in the field's frame; `None` for planes and rounded shapes, which have none.
    pub fn face_triangle(&self, face: u32) -> Option<Triangle> {
        let corners = match self.shape {
            Shape::Mesh(asset) => asset.face_corners(face as usize),
            Shape::Plane => return None,
            simple => Simple::from(simple).part(face).into_inner().ok()?,
        };
        Some(Triangle::new(corners.map(|p| self.to_field(p))))
    }

    /// Whether a function with this gradient (field's frame) may fall along the surface from one of
    /// its points, by more than `slope` per unit of length. `false` is certain. Only a box knows.
    pub fn may_fall(&self, p: DVec3, gradient: DVec3, slope: f64) -> bool {
        let Shape::Box { half_extents: half } = *self.shape else { return true };
        let at = self.out_of_field(p);
        let down = -(self.linear.transpose() * gradient) / self.scale;
        let near = AT_SIDE * half.min_element();
        // A way in a side of the box has two components along its axes, and out of the box there is
        // none.
        (0..3).any(|axis| {
            let is_at_side = half[axis] - at[axis].abs() <= near;
            let fall = if is_at_side { -down[axis] * at[axis].signum() } else { down[axis].abs() };
            fall > 0.5 * slope
        })
    }

    /// Whether one of the other faces that share all of these corners of a face is accepted. Faces
    /// are left out to which a direction `across` is perpendicular, up to an angle whose sine is
    /// `level`.
    pub fn any_beside(
        &self,
        face: u32,
        corners: &[usize],
        (across, level): (DVec3, f64),
        mut accept: impl FnMut(&Triangle) -> bool,
    ) -> bool {
        let mut accept =
            |other: u32| other != face && self.face_triangle(other).is_some_and(|triangle| accept(&triangle));
        let across = (self.linear.transpose() * across).normalize_or_zero();
        // Most neighbours are, and `f32` is enough to tell.
        let cosine = (1.0 - level * level).sqrt() + 1e-5;
        let is_across = |normal: DVec3| across.dot(normal).abs() > cosine;
        match self.shape {
            Shape::Mesh(asset) => {
                let own = asset.faces[face as usize];
                let shares = |other: &[u32; 3]| corners.iter().all(|&k| other.contains(&own[k]));
                let is_level = |other: u32| is_across(asset.records[other as usize].triangle().normal);
                let around = corners.first().map_or(&[][..], |&k| asset.faces_at(own[k])).iter();
                around
                    .copied()
                    .any(|other| shares(&asset.faces[other as usize]) && !is_level(other) && accept(other))
            }
            simple => {
                let simple = Simple::from(simple);
                let is_level = |other: u32| simple.normal(other).is_some_and(is_across);
                simple.parts_with(face, corners).any(|other| !is_level(other) && accept(other))
            }
        }
    }

    /// A candidate node as a part of one point.
    pub fn node(&self, node: u32) -> Part {
        match self.shape {
            Shape::Mesh(asset) => {
                let at = DVec3::from_array(asset.vertices[node as usize]);
                Part::new(&[self.to_field(at)], self.around)
            }
            simple => {
                let simple = Simple::from(simple);
                Part::new(&[self.to_field(simple.node(node))], simple.radius() * self.scale + self.around)
            }
        }
    }

    /// The id of a face in the user's numbering.
    pub fn face_id(&self, face: u32) -> u32 {
        match self.shape {
            Shape::Mesh(asset) => asset.face_ids[face as usize],
            Shape::Plane => 0,
            _ => face,
        }
    }

    /// The id, in the user's numbering, of the lowest face that has a node.
    pub fn face_of_node(&self, node: u32) -> u32 {
        match self.shape {
            Shape::Mesh(asset) => asset.lowest_faces()[node as usize],
            simple => Simple::from(simple).part_of_node(node),
        }
    }

    /// Number of faces; for a simple shape, of its parts.
    pub fn face_count(&self) -> u32 {
        match self.shape {
            Shape::Mesh(asset) => asset.face_count() as u32,
            Shape::Plane => 2,
            simple => Simple::from(simple).part_count(),
        }
    }

    /// Number of nodes: vertices, or distinct points of a simple shape's parts.
    pub fn node_count(&self) -> u32 {
        match self.shape {
            Shape::Mesh(asset) => asset.vertices.len() as u32,
            simple => Simple::from(simple).node_count(),
        }
    }

    /// Whether a range of faces contains a face, or in node mode a node.
    pub fn holds(&self, start: u32, count: u32, candidate: u32, mode: Mode) -> bool {
        match (mode, self.shape) {
            (Mode::Node, Shape::Mesh(asset)) => {
                asset.faces[start as usize..(start + count) as usize].as_flattened().contains(&candidate)
            }
            _ => (start..start + count).contains(&candidate),
        }
    }

    /// The candidates of a leaf of the face tree, or of all parts of a simple shape. In node mode,
    /// a vertex belongs to the leaf of its lowest face.
    pub fn of_leaf(&self, start: u32, count: u32, mode: Mode) -> Candidates {
        match (mode, self.shape) {
            (Mode::Node, Shape::Mesh(asset)) => {
                let lowest = asset.lowest_faces();
                let of_face = |face: u32| {
                    let id = asset.face_ids[face as usize];
                    let corners = asset.faces[face as usize];
                    corners.into_iter().filter(move |&node| lowest[node as usize] == id)
                };
                let mut nodes: Candidates = (start..start + count).flat_map(of_face).collect();
                nodes.sort_unstable();
                nodes.dedup();
                nodes
            }
            (Mode::Node, _) => (0..self.node_count()).collect(),
            _ => (start..start + count).collect(),
        }
    }

    /// The root of the face tree, or all parts of a simple shape.
    pub fn whole(&self) -> TreeChild {
        match self.shape {
            Shape::Mesh(_) => TreeChild::Node(0),
            _ => TreeChild::Leaf(0, self.face_count()),
        }
    }

    /// The two children of a node of the face tree; `None` for simple shapes.
    pub fn halves(&self, node: u32) -> Option<[Branch; 2]> {
        match self.shape {
            Shape::Mesh(asset) => Some(self.branches(asset, node)),
            _ => None,
        }
    }

    fn branches(&self, asset: &TeSdf, node: u32) -> [Branch; 2] {
        let children = asset.tree_children[node as usize].map(TreeChild::decode);
        let (boxes, _) = asset.tree_boxes[node as usize].as_chunks::<6>();
        [0, 1].map(|side| {
            let low = Vec3::from_slice(&boxes[side]).as_dvec3();
            let high = Vec3::from_slice(&boxes[side][3..]).as_dvec3();
            Branch {
                child: children[side],
                center: self.to_field(asset.frame.to_world(0.5 * (low + high) + asset.cube.middle())),
                radius: 0.5 * (high - low).length() * asset.frame.inverse_scale() * self.scale + self.around,
            }
        })
    }

    /// The greatest distance of a point of the faces below from the nearest corner of its face, in
    /// the field's frame.
    pub fn corner_reach(&self, child: TreeChild) -> f64 {
        match (self.shape, child) {
            (Shape::Mesh(asset), TreeChild::Node(node)) => {
                f64::from(asset.corner_reaches()[node as usize]) * asset.frame.inverse_scale() * self.scale
            }
            // Faces of leaves are tested one by one.
            _ => f64::INFINITY,
        }
    }

    /// The [`inner ball`](Shape::inner_ball) in the field's frame: centre and radius.
    pub fn inner_ball(&self) -> Option<(DVec3, f64)> {
        let (center, radius) = self.shape.inner_ball()?;
        Some((self.to_field(center), radius * self.scale))
    }

    /// Bounds in the field's frame; infinite for a plane.
    pub fn bounds(&self) -> Aabb {
        match self.shape {
            Shape::Plane => Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY },
            _ => image(self.shape.bounds(), &|p| self.to_field(p)),
        }
    }

    /// Whether the bounds of the shape and a box of the field's frame may have a common point.
    /// False only when a side of one of them separates them.
    pub fn may_meet(&self, other: Aabb) -> bool {
        let own = self.shape.bounds();
        let back = self.linear.transpose() * (1.0 / (self.scale * self.scale));
        other.min.cmple(other.max).all()
            && image(own, &|p| self.to_field(p)).overlaps(other)
            && image(other, &|p| back * (p - self.shift)).overlaps(own)
    }

    /// Visits the leaves of the face tree that can come within `reach` of the solid. The field is
    /// 1-Lipschitz, so a node is skipped when the ball around its box is out of reach.
    fn visit_leaves(&self, asset: &TeSdf, field: &FieldBody, reach: &Reach, mut leaf: impl FnMut(u32, u32)) {
        let mut stack = vec![TreeChild::Node(0)];
        while let Some(child) = stack.pop() {
            match child {
                TreeChild::Leaf(start, count) => leaf(start, count),
                // Reversed, so that the first child is visited first.
                TreeChild::Node(node) => stack.extend(
                    self.branches(asset, node)
                        .into_iter()
                        .rev()
                        .filter(|branch| !branch.is_beyond(field, reach))
                        .map(|branch| branch.child),
                ),
            }
        }
    }

    /// The bound by which the broad phase skips all leaves that `holds` (first face, number of
    /// faces) accepts: the least signed distance that the skipped node's ball can have (field's
    /// frame). `None` when the broad phase keeps such a leaf.
    pub fn pruned_by(
        &self,
        field: &FieldBody,
        reach: &Reach,
        holds: impl Fn(u32, u32) -> bool,
    ) -> Option<f64> {
        let mut least: Option<f64> = None;
        let mut stack = vec![(self.whole(), None)];
        while let Some((child, pruned)) = stack.pop() {
            match child {
                TreeChild::Leaf(start, count) if holds(start, count) => {
                    let bound: f64 = pruned?;
                    least = Some(least.map_or(bound, |l| l.min(bound)));
                }
                TreeChild::Leaf(..) => {}
                TreeChild::Node(node) => {
                    for branch in self.halves(node).into_iter().flatten() {
                        let beyond = || {
                            branch
                                .is_beyond(field, reach)
                                .then(|| field.least_within(branch.center, branch.radius))
                        };
                        stack.push((branch.child, pruned.or_else(beyond)));
                    }
                }
            }
        }
        least
    }
}

/// Bounds of the image of a box under an affine map.
fn image(b: Aabb, to: &dyn Fn(DVec3) -> DVec3) -> Aabb {
    let corner = |k: usize| {
        let pick = |axis: usize| if k >> axis & 1 == 1 { b.max[axis] } else { b.min[axis] };
        to(DVec3::new(pick(0), pick(1), pick(2)))
    };
    Aabb::of(&std::array::from_fn::<_, 8, _>(corner))
}

impl FieldBody<'_> {
    /// Bounds of the body, in the field's frame; infinite for a plane.
    pub fn bounds(&self) -> Aabb {
        match self.field {
            Field::Mesh(asset) => asset.local_bounds().grown(asset.reach_beyond()),
            Field::Simple(simple) => simple.bounds(),
        }
    }

    /// A ball around the body, in the field's frame; infinite for a plane.
    fn ball(&self) -> (DVec3, f64) {
        let bounds = match self.field {
            Field::Mesh(asset) => asset.local_bounds().grown(asset.reach_beyond()),
            Field::Simple(Simple::Box(half)) => Aabb { min: -half, max: half },
            Field::Simple(Simple::Round { half_height, radius }) => {
                return (DVec3::ZERO, half_height + radius);
            }
            Field::Simple(Simple::Cylinder(Cylinder { half_height, radius })) => {
                return (DVec3::ZERO, elementary::hypot(half_height, radius));
            }
            Field::Simple(Simple::Plane) => return (DVec3::ZERO, f64::INFINITY),
        };
        (bounds.center(), 0.5 * bounds.extent().length())
    }
}
