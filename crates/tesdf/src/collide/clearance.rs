use crate::parallel::*;
use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::field::FieldBody;
use super::least::{Least, least};
use super::narrow::Search;
use super::surface::SurfaceBody;
use super::{CollideError, CollideOptions, InstanceId, Mode, Placement, Scene, Shape};
use crate::base::Length;

/// How exactly a clearance is wanted.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClearanceOptions {
    /// Bound on the error; a share of the smaller body's diagonal, or in the world's unit. Rounding comes on top: some 1e-15 of the
    /// largest coordinate.
    pub tolerance: Length,
}

impl Default for ClearanceOptions {
    /// 1e-8 of the smaller diagonal.
    fn default() -> Self {
        Self { tolerance: Length::OfDiagonal(1e-8) }
    }
}

/// How far two bodies are apart, or how deep they are in each other; in the world's unit and frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Clearance {
    /// Positive: the least distance between the surfaces. Negative: the lesser of the least signed distance to *b* over the surface of *a*
    /// and the least to *a* over that of *b*; so a body wholly inside of the other penetrates. Never below the truth
    /// by more than rounding, never above it by more than the tolerance when `converged`.
    pub distance: f64,
    /// The witness on *a*.
    pub point_a: DVec3,
    /// The witness on *b*, `distance` away.
    pub point_b: DVec3,
    /// Unit, from *b* to *a*: ahead of it the clearance of the witnesses grows as *a* moves.
    pub normal: DVec3,
    /// The face of *a* that has `point_a`.
    pub face_a: u32,
    /// The face of *b* that has `point_b`.
    pub face_b: u32,
    /// Whose field it is: the other one's witness is the deepest point of a face, and this one's the nearest point to it.
    pub field: InstanceId,
    /// Whether the error is within the tolerance; false when the search in a hard spot deep inside was cut short.
    pub converged: bool,
    /// Whether the two solids share volume. Where `distance` is negative they do, up to the tolerance. Where it is 0, up to the
    /// tolerance, they do when their surfaces lie on each other with both solids on one side, as of a body and itself in one place:
    /// then no point of a surface is inside of the other body, and yet they overlap.
    pub overlap: bool,
}

/// The clearance of two instances, whatever their worlds, groups and exclusions.
///
/// A best-first search over the face tree of the body with fewer faces in the field of the other, then the other way around for
/// what lies deeper. When the bodies are apart, both ways would give the same, so the second looks for parts inside only.
///
/// Of a sphere or a capsule the surface's signed distance is that of its centre or segment less its radius. That is exact while those
/// are outside of the other body; with them inside, it is at most the value at the surface. A plane's half space is endless:
/// only its field is used, as no point of a plane is deeper in a body than the body reaches below the plane.
///
/// ```
/// use tesdf::collide::{ClearanceOptions, Instance, Pose, Scene, Shape, clearance};
/// use tesdf::glam::DVec3;
///
/// let mut scene = Scene::new();
/// let ball = scene.add_shape(Shape::Sphere { radius: 1.0 })?;
/// let a = scene.add(Instance::new(ball, Pose::IDENTITY))?;
/// let b = scene.add(Instance::new(ball, Pose::at(DVec3::new(0.0, 0.0, 5.0))))?;
/// let found = clearance(&scene, a, b, &ClearanceOptions::default())?;
/// assert_eq!((found.distance, found.point_a, found.normal), (3.0, DVec3::Z, -DVec3::Z));
/// # Ok::<(), tesdf::collide::CollideError>(())
/// ```
///
/// # Errors
/// An instance that is not there, one and the same instance twice, two planes, a tolerance that makes no sense, positions too far
/// out for double precision.
pub fn clearance(
    scene: &Scene,
    a: InstanceId,
    b: InstanceId,
    options: &ClearanceOptions,
) -> Result<Clearance, CollideError> {
    let pair = Pair::new(scene, a, b)?;
    let tolerance = pair.tolerance(options.tolerance)?;
    pair.clearance(tolerance)
}

/// A body of a pair.
#[derive(Clone, Copy, Debug)]
pub struct Body<'a> {
    /// Its name.
    pub id: InstanceId,
    /// Its shape.
    pub shape: &'a Shape,
    /// Where it is.
    pub placement: Placement,
}

/// Two bodies between which distances are measured.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'a> {
    /// The first, *a*.
    pub a: Body<'a>,
    /// The second, *b*.
    pub b: Body<'a>,
}

/// Which body's surface goes first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Surface {
    A,
    B,
}

impl<'a> Pair<'a> {
    /// Two instances of a scene.
    ///
    /// # Errors
    /// As [`clearance`], but for the tolerance.
    pub fn new(scene: &'a Scene, a: InstanceId, b: InstanceId) -> Result<Self, CollideError> {
        let body = |id| {
            let instance = scene.instance(id)?;
            Ok(Body { id, shape: scene.shape(instance.shape)?, placement: instance.placement() })
        };
        let pair = Self { a: body(a)?, b: body(b)? };
        let none = |reason| Err(CollideError::NoClearance { a, b, reason });
        if a == b {
            return none("they are one and the same; expected two");
        }
        if matches!((pair.a.shape, pair.b.shape), (Shape::Plane, Shape::Plane)) {
            return none("both are planes, which are endless; expected at most one");
        }
        Ok(pair)
    }

    /// A share of the smaller diagonal, in the world's unit.
    ///
    /// # Errors
    /// When it is not a finite number above 0.
    pub fn tolerance(&self, tolerance: Length) -> Result<f64, CollideError> {
        let (Length::OfDiagonal(value) | Length::Absolute(value)) = tolerance;
        if !(value > 0.0 && value.is_finite()) {
            return Err(CollideError::Option {
                option: "tolerance",
                found: value.to_string(),
                expected: "a finite number greater than 0",
            });
        }
        let diagonal = |body: &Body| body.shape.diagonal() * body.placement.scale;
        Ok(tolerance.resolve(diagonal(&self.a).min(diagonal(&self.b))))
    }

    /// Both ways, to a tolerance in the world's unit.
    ///
    /// # Errors
    /// Positions too far out.
    pub fn clearance(&self, tolerance: f64) -> Result<Clearance, CollideError> {
        let first = self.first();
        let found = self.apart(tolerance)?;
        if matches!(self.a.shape, Shape::Plane) || matches!(self.b.shape, Shape::Plane) {
            return Ok(Clearance { overlap: found.distance < -tolerance, ..found });
        }
        // Apart, no surface is nearer than this to the other: what is lower the other way around is at most its negative.
        let limit = if found.distance > 0.0 { tolerance - found.distance } else { found.distance };
        let second = match first {
            Surface::A => Surface::B,
            Surface::B => Surface::A,
        };
        let other = self.one_way(second, tolerance, limit).filter(|o| o.distance < found.distance);
        let found = other.unwrap_or(found);
        let overlap = match found.distance {
            d if d < -tolerance => true,
            d if d > tolerance => false,
            _ => self.shares_volume(tolerance),
        };
        Ok(Clearance { overlap, ..found })
    }

    /// Whether bodies whose surfaces touch up to the tolerance share volume: whether a point behind a face of one, by more than
    /// the tolerance, is inside of both.
    ///
    /// No face of one is inside of the other then, so a part of one that overlaps the other has its surface in common with it, and a point
    /// behind any face of that part tells.
    fn shares_volume(&self, tolerance: f64) -> bool {
        let deep = |body: &Body, p: DVec3, depth: f64| {
            let scale = body.placement.scale;
            body.shape.signed_distance(body.placement.to_shape(p)) * scale < -0.5 * depth
        };
        let size = |body: &Body| body.shape.diagonal() * body.placement.scale;
        // Within a wall that is thicker than that, and clear of what the tolerance and rounding leave open.
        let depths = [1e-2, 1e-3, 1e-4].map(|share| share * size(&self.a).min(size(&self.b)));
        let behind = self.behind_faces();
        depths.into_iter().filter(|&depth| depth > 8.0 * tolerance).any(|depth| {
            let point = |&(p, inward): &(DVec3, DVec3)| p + depth * inward;
            behind.par_iter().map(point).any(|p| deep(&self.a, p, depth) && deep(&self.b, p, depth))
        })
    }

    /// For each face of *a* a point of it and the direction inward; the world's frame. Of a simple shape one place is enough, as it is convex.
    fn behind_faces(&self) -> Vec<(DVec3, DVec3)> {
        let Body { shape, placement, .. } = &self.a;
        let rotate = |n: DVec3| placement.pose.rotation * n;
        let of_face = |[a, b, c]: [DVec3; 3]| {
            let normal = (b - a).cross(c - a).try_normalize()?;
            Some((placement.to_world((a + b + c) / 3.0), rotate(-normal)))
        };
        match shape {
            Shape::Mesh(asset) => {
                (0..asset.face_count()).filter_map(|f| of_face(asset.face_corners(f))).collect()
            }
            Shape::Plane => Vec::new(),
            // From the middle of its upper side down.
            simple => vec![(placement.to_world(DVec3::Z * simple.bounds().max.z), rotate(DVec3::NEG_Z))],
        }
    }

    /// One way, which is the clearance when neither body is inside of the other.
    ///
    /// # Errors
    /// Positions too far out.
    pub fn apart(&self, tolerance: f64) -> Result<Clearance, CollideError> {
        self.one_way(self.first(), tolerance, f64::INFINITY).ok_or(CollideError::NoClearance {
            a: self.a.id,
            b: self.b.id,
            reason: "their positions are too far out for double precision; expected the bodies nearer to the origin",
        })
    }

    /// That of fewer faces; of a plane there is no surface to go over.
    fn first(&self) -> Surface {
        let faces = |body: &Body| match body.shape {
            Shape::Mesh(asset) => asset.face_count(),
            Shape::Plane => usize::MAX,
            _ => 0,
        };
        if faces(&self.b) < faces(&self.a) { Surface::B } else { Surface::A }
    }

    /// The least signed distance over one surface that is at most `limit`.
    fn one_way(&self, of: Surface, tolerance: f64, limit: f64) -> Option<Clearance> {
        let (of_surface, of_field) = match of {
            Surface::A => (&self.a, &self.b),
            Surface::B => (&self.b, &self.a),
        };
        let field = FieldBody::new(of_field.shape, of_field.placement);
        let surface = SurfaceBody::new(of_surface.shape, of_surface.placement, &field);
        // Half for the search over a face, half for what is no longer searched.
        let half = 0.5 * tolerance;
        let exact =
            CollideOptions { tolerance: Length::Absolute(half), ..CollideOptions::with_mode(Mode::Exact) };
        let search = Search::new(&exact, 0.0, &field, 0.0);
        let found = least(&surface, &field, &search, half / field.unit(), limit / field.unit())?;
        let Least { distance, face, part, minimum, converged } = found;
        let gradient = minimum.value.gradient;
        let on_surface = field.to_world(minimum.point - part.radius * gradient);
        let on_field = field.to_world(minimum.value.closest_point);
        let away = field.rotate(gradient);
        let (face_surface, (face_field, _)) = (surface.face_id(face), field.names(&minimum.value));
        let (point_a, point_b, normal, face_a, face_b) = match of {
            Surface::A => (on_surface, on_field, away, face_surface, face_field),
            Surface::B => (on_field, on_surface, -away, face_field, face_surface),
        };
        let distance = distance * field.unit();
        let field = of_field.id;
        let overlap = distance < -tolerance;
        Some(Clearance { distance, point_a, point_b, normal, face_a, face_b, field, converged, overlap })
    }
}
