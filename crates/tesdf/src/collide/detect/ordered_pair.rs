//! Two instances in an order: the surface of the first against the signed distance field of the
//! second.
use glam::DVec3;

use crate::collide::bodies::field::FieldBody;
use crate::collide::bodies::reach::Reach;
use crate::collide::bodies::surface::{Candidates, Part, SurfaceBody};
use crate::collide::cones::Cones;
use crate::collide::detect::descent::{OnFace, SLOPE, descends};
use crate::collide::mode::{ContactsPer, FaceOptions, Mode};
use crate::collide::narrow::{Minimum, Search};
use crate::collide::options::CollideOptions;
use crate::collide::pairs::ahead::Ahead;
use crate::collide::pairs::{InstancePair, instance_pairs};
use crate::collide::report::contact::{Contact, FeatureId};
use crate::collide::scene::Scene;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::ids::InstanceId;
use crate::collide::scene::shape::Shape;
use crate::query::Precision;

/// Why a minimum is no contact.
#[derive(Clone, Copy, Debug)]
pub enum Dropped {
    /// The cosine filter drops this cosine.
    ByCosine(f64),
    /// The surface is lower beside the point.
    Descending,
    /// No direction is in the normal cones of both bodies.
    OutOfCones,
}

/// Bodies that close by more than this part of the smaller diagonal within the speculative time may
/// touch at other places than local minima.
const FAST: f64 = 0.1;

/// The surface of one body and the field of another.
pub struct OrderedPair<'a> {
    /// The body that has the faces or nodes.
    pub surface: SurfaceBody<'a>,
    /// The body whose signed distances are used.
    pub field: FieldBody<'a>,
    /// How far each part of the surface looks.
    pub reach: Reach,
    /// The search for minima, up to the greatest of these distances.
    pub search: Search,
    /// The normal cones, where contacts are those of faces.
    pub cones: Option<Cones<'a>>,
    /// Whether the bodies close by so much within the speculative time that they may touch at other
    /// places than local minima.
    is_fast: bool,
    options: &'a CollideOptions,
    pub a: InstanceId,
    pub b: InstanceId,
}

impl<'a> OrderedPair<'a> {
    /// All pairs of instances that can touch, each in both orders.
    pub fn all(scene: &'a Scene, options: &'a CollideOptions) -> Result<Vec<Self>, CollideError> {
        options.validate()?;
        Self::of(&instance_pairs(scene, options.contact_distance, options.speculative_time)?, scene, options)
    }

    /// These pairs of instances, each in both orders.
    pub fn of(
        pairs: &[InstancePair],
        scene: &'a Scene,
        options: &'a CollideOptions,
    ) -> Result<Vec<Self>, CollideError> {
        options.validate()?;
        pairs
            .iter()
            .flat_map(|pair| [(pair.first, pair.second, pair), (pair.second, pair.first, pair)])
            .map(|(a, b, pair)| Self::new(scene, options, a, b, pair.contact_distance))
            .collect()
    }

    /// The contact distance of two instances, in the world's unit.
    pub fn contact_distance(
        scene: &Scene,
        options: &CollideOptions,
        both: [InstanceId; 2],
    ) -> Result<f64, CollideError> {
        let [a, b] = Ahead::of_both(scene, both, options.speculative_time)?;
        Ok(options.contact_distance + a.closing(&b))
    }

    /// `contact_distance` is that of the pair, in the world's unit.
    pub fn new(
        scene: &'a Scene,
        options: &'a CollideOptions,
        a: InstanceId,
        b: InstanceId,
        contact_distance: f64,
    ) -> Result<Self, CollideError> {
        let (of_a, of_b) = (scene.instance(a)?, scene.instance(b)?);
        let (shape_a, shape_b) = (scene.shape(of_a.shape)?, scene.shape(of_b.shape)?);
        let field = FieldBody::new(shape_b, of_b.placement());
        if let Shape::Mesh(asset) = shape_b {
            asset.store_normals();
        }
        let surface = SurfaceBody::new(shape_a, of_a.placement(), &field);
        let diagonals = [(shape_a, of_a), (shape_b, of_b)]
            .map(|(shape, instance)| shape.diagonal().min(f64::MAX) * instance.scale);
        let search = Search::new(options, contact_distance, &field, diagonals);
        let [ahead_a, ahead_b] = Ahead::of_both(scene, [a, b], options.speculative_time)?;
        let least = options.contact_distance.min(contact_distance);
        let reach = Reach::new(&ahead_a.approach(&ahead_b), &field, contact_distance, least);
        let cones = options.mode.faces().map(|faces| {
            let tolerance = faces.tolerance.resolve(diagonals[1]);
            let shapes = [(shape_a, of_a.placement()), (shape_b, of_b.placement())];
            Cones::new(shapes, tolerance, options.precision)
        });
        let smaller = diagonals.into_iter().fold(f64::INFINITY, f64::min);
        let is_fast = contact_distance - options.contact_distance > FAST * smaller;
        Ok(Self { surface, field, reach, search, cones, is_fast, options, a, b })
    }

    /// Broad phase.
    pub fn candidates(&self) -> Candidates {
        match self.options.mode {
            Mode::Node => self.surface.nodes(&self.field, &self.reach),
            // The search over a face begins with the test by which `faces` drops it.
            Mode::Face { .. } | Mode::Exact(_) if self.search.is_of_faces() => {
                self.surface.faces_of_leaves(&self.field, &self.reach)
            }
            Mode::Face { .. } | Mode::Exact(_) => self.surface.faces(&self.field, &self.reach),
        }
    }

    /// Whether the contacts of the other order are all.
    pub fn is_of_other_order(&self) -> bool {
        let (cones, per) = (self.cones.as_ref(), self.options.mode.contacts_per());
        cones.zip(per).is_some_and(|(cones, per)| cones.are_of_other_order(per))
    }

    /// The search for minima of some parts, up to the greatest of their own contact distances.
    pub fn search_of<'p>(&self, parts: impl IntoIterator<Item = &'p Part>) -> Search {
        let reach = parts.into_iter().map(|part| self.reach.of(part.points(), part.radius));
        self.search.within(reach.fold(f64::NEG_INFINITY, f64::max))
    }

    /// The mode of the detection.
    pub fn mode(&self) -> Mode {
        self.options.mode
    }

    /// A candidate, the id of its face, and its feature: the id of the node or the face.
    pub fn part(&self, candidate: u32) -> (Part, u32, u32) {
        match self.options.mode {
            Mode::Node => (self.surface.node(candidate), self.surface.face_of_node(candidate), candidate),
            Mode::Face { .. } | Mode::Exact(_) => {
                let face = self.surface.face_id(candidate);
                (self.surface.face(candidate, &self.field, self.reach.most), face, face)
            }
        }
    }

    /// A minimum of a candidate, with the cosine between its gradient and the normal of its part.
    /// Where the other side of a face is outside there, the gradient is the one that most opposes
    /// that side. Where both sides are alike, any side counts.
    pub fn faced(&self, part: &Part, candidate: u32, minimum: Minimum) -> (Minimum, f64) {
        let cosine = minimum.value.gradient.dot(part.normal);
        if part.points().len() < 3 {
            return (minimum, cosine);
        }
        let turned = match self.surface.outward_at(candidate, minimum.point) {
            None => return (minimum, cosine),
            Some(DVec3::ZERO) => return (minimum, -cosine.abs()),
            Some(normal) if normal.dot(part.normal) > 0.0 => return (minimum, cosine),
            Some(normal) => normal,
        };
        let value = match self.options.mode.contacts_per() {
            Some(ContactsPer::Cell) | None => minimum.value,
            Some(ContactsPer::Face | ContactsPer::Minimum) => {
                self.field.opposing(minimum.point, turned, self.options.precision)
            }
        };
        (Minimum { value, ..minimum }, value.gradient.dot(turned))
    }

    /// The contact of a minimum of a candidate, or why it is none: Eq. (10), which does not apply to
    /// rounded shapes and sheets, because they have normals in all directions; or a lower point
    /// beside it; or normal cones without a common direction.
    ///
    /// `cosine` is that of [`faced`](Self::faced), `ids` are the face and the feature of
    /// [`part`](Self::part).
    pub fn contact(
        &self,
        part: &Part,
        candidate: u32,
        minimum: &Minimum,
        cosine: f64,
        ids: [u32; 2],
    ) -> Result<Contact, Dropped> {
        if let Some(faces) = self.options.mode.faces() {
            self.check_face(faces, part, candidate, minimum, cosine)?;
        }
        let contact = self.touching(part, minimum, ids);
        let (Some(cones), Some(per)) = (&self.cones, self.options.mode.contacts_per()) else {
            return Ok(contact);
        };
        let faces = [candidate, minimum.value.position];
        cones.contact(contact, faces, per).ok_or(Dropped::OutOfCones)
    }

    fn check_face(
        &self,
        options: &FaceOptions,
        part: &Part,
        candidate: u32,
        minimum: &Minimum,
        cosine: f64,
    ) -> Result<(), Dropped> {
        let gradient = minimum.value.gradient;
        if part.points().len() == 3
            && !self.surface.is_sheet()
            && options.cos_theta.is_some_and(|cos| cosine > -cos)
        {
            return Err(Dropped::ByCosine(cosine));
        }
        let Minimum { point, is_lowest, .. } = *minimum;
        let at = || {
            let distance = match self.options.precision {
                Precision::F64 => minimum.value.distance,
                Precision::F32 => self.field.field.exact_value(point).distance,
            };
            OnFace { face: candidate, point, distance, gradient, is_lowest }
        };
        match options.contacts_per == ContactsPer::Minimum && self.descends(&at()) {
            true => Err(Dropped::Descending),
            false => Ok(()),
        }
    }

    /// Whether the surface is lower beside a point of a face, which is then no local minimum. So is
    /// then a contact there. Of bodies that close by much, all places count: they may pass the
    /// lowest one by.
    pub fn descends(&self, at: &OnFace) -> bool {
        !self.is_fast
            && self.surface.may_fall(at.point, at.gradient, SLOPE)
            && descends(&self.surface, &self.field, at, |face| {
                let around = self.surface.around();
                let reach = self.reach.of(&face.corners, around) + around;
                match self.options.mode {
                    // Frank–Wolfe need not find the lower point.
                    Mode::Face { iterations, .. } => {
                        self.search.within(reach).frank_wolfe(&self.field, face, iterations) < at.distance
                    }
                    Mode::Node | Mode::Exact(_) => at.distance <= reach,
                }
            })
    }

    /// The vertex at which a minimum is, by its bits; `None` in the mode node, where each
    /// vertex has one contact, and for contacts per cell.
    pub fn vertex(&self, part: &Part, minimum: &Minimum) -> Option<[u64; 3]> {
        let corner = minimum.corner.filter(|_| self.search.is_of_faces())?;
        Some(part.points()[usize::from(corner)].to_array().map(f64::to_bits))
    }

    fn touching(&self, part: &Part, minimum: &Minimum, [face_a, feature]: [u32; 2]) -> Contact {
        let Minimum { point, value, cell, converged, .. } = *minimum;
        let (face_b, feature_b) = self.field.names(&value);
        let [point_a, point_b] = self.field.surface_points(point, part.radius, &value);
        Contact {
            point_a: self.field.to_world(point_a),
            point_b: self.field.to_world(point_b),
            normal: self.field.rotate(value.gradient),
            distance: (value.distance - part.radius) * self.field.unit(),
            face_a,
            face_b,
            tet_b: cell,
            instance_a: self.a,
            instance_b: self.b,
            feature: FeatureId { a: feature, b: feature_b },
            converged,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;
    use crate::collide::scene::Instance;
    use crate::collide::scene::pose::Pose;
    use crate::testing::random;

    /// Of the points of a box at random poses over other shapes: its corners, and points near them, on
    /// its edges and sides.
    #[test]
    fn nothing_falls_where_a_box_tells_that_it_does_not() {
        let mut state = 1;
        let (mut told, mut falling) = (0, 0);
        for case in 0..4000 {
            let mut number = || random(&mut state);
            let half_extents = 0.2 + DVec3::new(number(), number(), number());
            let field = match case % 3 {
                0 => Shape::Plane,
                1 => Shape::Sphere { radius: 0.5 + number() },
                _ => Shape::Box { half_extents: 0.2 + DVec3::new(number(), number(), number()) },
            };
            let axis = (DVec3::new(number(), number(), number()) - 0.5).normalize();
            let rotation = DQuat::from_axis_angle(axis, [0.0, 0.05, 0.3, 3.0][case / 3 % 4] * number());
            let translation = DVec3::new(number() - 0.5, number() - 0.5, 1.5 * number());
            let mut scene = Scene::new();
            let shapes =
                [(Shape::Box { half_extents }, Pose { translation, rotation }), (field, Pose::IDENTITY)];
            let [a, b] = shapes.map(|(shape, pose)| {
                let shape = scene.add_shape(shape).expect("valid sizes");
                scene.add(Instance::new(shape, pose)).expect("a valid pose")
            });
            let options = CollideOptions::default();
            let pair = OrderedPair::new(&scene, &options, a, b, 10.0).expect("instances of the scene");
            for face in 0..pair.surface.face_count() {
                let Some(triangle) = pair.surface.face_triangle(face) else { continue };
                let [p, q, r] = triangle.corners;
                let near = [1e-3, 1e-5, 1e-7][case % 3];
                for point in
                    [p, q, r, 0.5 * (p + q), p + near * (r - p), q + near * (r - q), (p + q + r) / 3.0]
                {
                    let value = pair.field.exact_value(point);
                    let is_lowest = (case + face as usize).is_multiple_of(2);
                    let (distance, gradient) = (value.distance, value.gradient);
                    let at = OnFace { face, point, distance, gradient, is_lowest };
                    let falls = descends(&pair.surface, &pair.field, &at, |_| true);
                    let may_fall = pair.surface.may_fall(point, gradient, SLOPE);
                    assert!(may_fall || !falls, "case {case}, face {face}, {at:?}");
                    (told, falling) = (told + usize::from(!may_fall), falling + usize::from(falls));
                }
            }
        }
        assert!(told > 5000 && falling > 5000, "{told} told, {falling} falling");
    }
}
