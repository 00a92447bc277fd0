//! A moving body, and the parts of its surface at a time: nodes of its face tree and faces.
use arrayvec::ArrayVec;
use glam::{DMat3, DVec3, Vec3};

use crate::asset::layout::TreeChild;
use crate::base::elementary;
use crate::collide::clearance::Body;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::motion::{Motion, Twist};
use crate::collide::scene::pose::Placement;
use crate::collide::scene::shape::Shape;
use crate::geometry::Triangle;

/// A part of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MovingPart {
    /// All of it.
    Whole,
    /// One of the two children of a node of the face tree.
    Half { node: u32, side: u8 },
    /// A face of a mesh.
    Face(u32),
    /// All of a simple shape.
    Simple,
}

impl MovingPart {
    /// Whether it has no parts.
    pub fn is_face(&self) -> bool {
        match self {
            Self::Whole | Self::Half { .. } => false,
            Self::Face(_) | Self::Simple => true,
        }
    }
}

/// A body in motion. Lengths are in the world's unit; places are seen from an origin that the two
/// bodies of a pair share.
#[derive(Clone, Debug)]
pub struct MovingBody<'a> {
    shape: &'a Shape,
    placement: Placement,
    motion: Motion,
    origin: DVec3,
    twist: Twist,
    /// The surface lies within this distance of its parts.
    pub radius: f64,
}

impl<'a> MovingBody<'a> {
    /// A body that is where it is at time 0.
    ///
    /// # Errors
    /// The motion is invalid, or the body is a plane that turns.
    pub fn new(body: &Body<'a>, motion: Motion, origin: DVec3) -> Result<Self, CollideError> {
        let Body { id, shape, placement } = *body;
        let refuse = |reason| Err(CollideError::Instance { instance: id.0, reason });
        if let Err(reason) = motion.validate() {
            return refuse(reason);
        }
        let twist = motion.twist(placement.pose);
        if twist.rotates() && matches!(shape, Shape::Plane) {
            return refuse(
                "a plane that turns has points of any speed; expected a motion without turning".into(),
            );
        }
        let radius = match shape {
            Shape::Mesh(asset) => asset.half_thickness * asset.frame.inverse_scale(),
            Shape::Sphere { radius } | Shape::Capsule { radius, .. } => *radius,
            Shape::Plane | Shape::Box { .. } | Shape::Cylinder { .. } => 0.0,
        };
        Ok(Self { shape, placement, motion, origin, twist, radius: radius * placement.scale })
    }

    /// Whether it is a half-space.
    pub fn is_plane(&self) -> bool {
        matches!(self.shape, Shape::Plane)
    }

    /// The whole surface.
    pub fn whole(&self) -> MovingPart {
        if matches!(self.shape, Shape::Mesh(_)) { MovingPart::Whole } else { MovingPart::Simple }
    }

    /// The parts of a part; none of a face.
    pub fn parts_of(&self, part: MovingPart) -> Vec<MovingPart> {
        let node = match (self.shape, part) {
            (Shape::Mesh(asset), MovingPart::Half { node, side }) => {
                match TreeChild::decode(asset.tree_children[node as usize][usize::from(side)]) {
                    TreeChild::Node(node) => node,
                    TreeChild::Leaf(start, count) => {
                        return (start..start + count).map(MovingPart::Face).collect();
                    }
                }
            }
            (_, MovingPart::Whole) => 0,
            _ => return Vec::new(),
        };
        vec![MovingPart::Half { node, side: 0 }, MovingPart::Half { node, side: 1 }]
    }

    /// The body at a time.
    pub fn at(&self, time: f64) -> BodyAt<'_> {
        let pose = self.motion.pose_at(self.placement.pose, time);
        let Twist { drift, spin, center } = self.twist;
        let linear = DMat3::from_quat(pose.rotation) * self.placement.scale;
        let (shift, center) = (pose.translation - self.origin, center + time * drift - self.origin);
        // The numbers of which places are sums.
        let size = self.origin.length() + self.twist.center.length() + 2.0 * center.length() + shift.length();
        BodyAt { body: self, linear, shift, drift, spin, center, size: size + time * drift.length() }
    }
}

/// A moving body at a time.
#[derive(Clone, Debug)]
pub struct BodyAt<'a> {
    body: &'a MovingBody<'a>,
    /// A point p of the shape is at `linear` · p + `shift`.
    linear: DMat3,
    shift: DVec3,
    drift: DVec3,
    spin: DVec3,
    /// A point of the axis of the rotation.
    center: DVec3,
    size: f64,
}

impl BodyAt<'_> {
    fn place(&self, p: DVec3) -> DVec3 {
        self.linear * p + self.shift
    }

    /// A part at the time.
    pub fn part(&self, part: MovingPart) -> PartAt {
        let of_face = |corners: &[DVec3]| {
            let mut points = [DVec3::ZERO; 3];
            for (k, point) in points.iter_mut().enumerate() {
                *point = self.place(corners[k.min(corners.len() - 1)]);
            }
            let center = points.iter().sum::<DVec3>() / 3.0;
            (center, Extent::Hull { points, count: corners.len() })
        };
        let of_box = |low: DVec3, high: DVec3| {
            let half = 0.5 * (high - low);
            let halves = [0, 1, 2].map(|k| self.linear.col(k) * half[k]);
            (self.place(0.5 * (low + high)), Extent::Box { halves })
        };
        let (center, extent) = match (self.body.shape, part) {
            (Shape::Mesh(asset), MovingPart::Half { node, side }) => {
                let (boxes, _) = asset.tree_boxes[node as usize].as_chunks::<6>();
                let corner = |k: usize| {
                    let local = Vec3::from_slice(&boxes[usize::from(side)][k..]).as_dvec3();
                    asset.frame.to_world(local + asset.cube.middle())
                };
                of_box(corner(0), corner(3))
            }
            (Shape::Mesh(asset), MovingPart::Face(face)) => of_face(&asset.face_corners(face as usize)),
            (Shape::Mesh(asset), MovingPart::Whole) => {
                let bounds = asset.bounds();
                of_box(bounds.min, bounds.max)
            }
            (&Shape::Cylinder { half_height, radius }, _) => {
                let [half_height, radius] =
                    [half_height, radius].map(|size| size * self.body.placement.scale);
                let axis = self.linear.z_axis.normalize_or_zero();
                (self.place(DVec3::ZERO), Extent::Cylinder { axis, half_height, radius })
            }
            // A plane is the half-space of a direction, so one of its points stands for it.
            (Shape::Plane | Shape::Sphere { .. }, _) => of_face(&[DVec3::ZERO]),
            (&Shape::Capsule { half_height, .. }, _) => {
                of_face(&[-half_height * DVec3::Z, half_height * DVec3::Z])
            }
            (shape, _) => {
                let bounds = shape.bounds();
                of_box(bounds.min, bounds.max)
            }
        };
        PartAt { is_simple: part == MovingPart::Simple, center, extent }
    }

    /// The outward direction of a plane.
    pub fn plane_normal(&self) -> Option<DVec3> {
        self.body.is_plane().then(|| self.linear.z_axis.normalize_or_zero())
    }

    /// Component along `n` of the velocity of a part's middle, now.
    pub fn speed(&self, part: &PartAt, n: DVec3) -> f64 {
        // n · (spin × r) = r · (n × spin)
        n.dot(self.drift) + n.cross(self.spin).dot(part.center - self.center)
    }

    /// The angular velocity of a part about its middle. A cylinder is the same however it turns about
    /// its axis.
    pub fn spin(&self, part: &PartAt) -> DVec3 {
        match part.extent {
            Extent::Cylinder { axis, .. } => self.spin - self.spin.dot(axis) * axis,
            _ => self.spin,
        }
    }

    /// The speed that the rotation gives a part's points at most, and the acceleration, at all times.
    pub fn rotation(&self, part: &PartAt) -> (f64, f64) {
        let rate = self.spin.length();
        // Of the middle, the distance from the axis.
        let arm = (part.center - self.center).cross(self.spin.normalize_or_zero()).length();
        let (tilting, reach) = (self.spin(part).length(), part.reach());
        // A cylinder that does not turn about its own axis has the angular velocity `tilting`, which
        // itself turns with its axis.
        let turning = match part.extent {
            Extent::Cylinder { axis, .. } => tilting + self.spin.dot(axis).abs(),
            _ => rate,
        };
        (rate * arm + tilting * reach, rate * rate * arm + turning * tilting * reach)
    }

    /// Velocity of the axis.
    pub fn drift(&self) -> DVec3 {
        self.drift
    }

    /// Radians per unit of time.
    pub fn rotation_rate(&self) -> f64 {
        self.spin.length()
    }

    /// The size of the numbers of which a part's places are sums.
    pub fn size(&self, part: &PartAt) -> f64 {
        self.size + part.center.length() + part.reach()
    }
}

/// A part of a surface at a time, without the radius.
#[derive(Clone, Copy, Debug)]
pub struct PartAt {
    /// Whether it is a whole simple shape.
    pub is_simple: bool,
    /// Its middle.
    pub center: DVec3,
    extent: Extent,
}

#[derive(Clone, Copy, Debug)]
enum Extent {
    /// All points at most these vectors from the middle.
    Box { halves: [DVec3; 3] },
    /// The hull of one to three points; the last one is repeated.
    Hull { points: [DVec3; 3], count: usize },
    /// A cylinder with a unit vector along its axis.
    Cylinder { axis: DVec3, half_height: f64, radius: f64 },
}

impl PartAt {
    /// How far it reaches from its middle against the direction of `m`, times the length of `m`.
    pub fn half_width(&self, m: DVec3) -> f64 {
        match &self.extent {
            Extent::Box { halves } => halves.iter().map(|half| m.dot(*half).abs()).sum(),
            Extent::Hull { points, .. } => {
                points.iter().map(|p| m.dot(self.center - *p)).fold(f64::NEG_INFINITY, f64::max)
            }
            Extent::Cylinder { axis, half_height, radius } => {
                half_height * m.dot(*axis).abs() + radius * m.cross(*axis).length()
            }
        }
    }

    /// A point of it that is farthest in the direction of `m`.
    pub fn support(&self, m: DVec3) -> DVec3 {
        match &self.extent {
            Extent::Box { halves } => {
                self.center + halves.iter().map(|half| half * 1f64.copysign(m.dot(*half))).sum::<DVec3>()
            }
            Extent::Hull { points: [first, rest @ ..], .. } => {
                rest.iter().fold(*first, |most, p| if m.dot(*p - most) > 0.0 { *p } else { most })
            }
            Extent::Cylinder { axis, half_height, radius } => {
                // Perpendicular to the axis also where `m` is along it, up to rounding.
                let aside = axis.cross(m).cross(*axis).normalize_or_zero();
                self.center + half_height.copysign(m.dot(*axis)) * axis + radius * aside
            }
        }
    }

    /// Greatest distance of a point of it from its middle.
    pub fn reach(&self) -> f64 {
        match &self.extent {
            Extent::Box { halves } => halves.iter().map(|half| half.length_squared()).sum::<f64>().sqrt(),
            Extent::Hull { points, .. } => points.iter().map(|p| p.distance(self.center)).fold(0.0, f64::max),
            Extent::Cylinder { half_height, radius, .. } => elementary::hypot(*half_height, *radius),
        }
    }

    /// The points of a face, a sphere's centre or a capsule's segment.
    pub fn points(&self) -> Option<&[DVec3]> {
        match &self.extent {
            Extent::Box { .. } | Extent::Cylinder { .. } => None,
            Extent::Hull { points, count } => Some(&points[..*count]),
        }
    }

    /// A face, whose last point is repeated where it has fewer than three.
    pub fn triangle(&self) -> Option<Triangle> {
        match self.extent {
            Extent::Box { .. } | Extent::Cylinder { .. } => None,
            Extent::Hull { points, .. } => Some(Triangle::new(points)),
        }
    }

    /// The directions of its straight edges, and of the round side of a cylinder.
    pub fn edges(&self) -> ArrayVec<DVec3, 3> {
        let edges = match self.extent {
            Extent::Box { halves } => halves,
            Extent::Hull { points: [a, b, c], .. } => [b - a, c - b, a - c],
            Extent::Cylinder { axis, .. } => [axis, DVec3::ZERO, DVec3::ZERO],
        };
        edges.into_iter().filter_map(DVec3::try_normalize).collect()
    }

    /// Directions in which it is likely to be thin.
    pub fn axes(&self) -> impl Iterator<Item = DVec3> {
        let axes = match self.extent {
            Extent::Box { halves } => halves,
            Extent::Hull { points: [a, b, c], .. } => [(b - a).cross(c - a), DVec3::ZERO, DVec3::ZERO],
            Extent::Cylinder { axis, .. } => [axis, DVec3::ZERO, DVec3::ZERO],
        };
        axes.into_iter().filter_map(DVec3::try_normalize)
    }
}
