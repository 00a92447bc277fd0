use std::sync::Arc;

use glam::DVec3;

use crate::TeSdf;
use crate::asset::InnerBall;
use crate::collide::scene::cylinder::Cylinder;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::simple::Simple;
use crate::geometry::Aabb;

/// Accepted sizes, and accepted diagonals of placed shapes in the world's unit; the same range as
/// for meshes. Their squares and cubes stay far from the ends of the range of 64-bit floats.
pub(in crate::collide) const SIZE: std::ops::RangeInclusive<f64> = 1e-50..=1e50;

/// The geometry of a body, in its own frame. All its instances share it.
#[derive(Clone, Debug)]
pub enum Shape {
    /// An encoded mesh.
    Mesh(Arc<TeSdf>),
    /// The half-space z ≤ 0. Its surface is the plane z = 0.
    Plane,
    /// A box centred on the origin.
    Box {
        /// Half of the edge lengths; positive.
        half_extents: DVec3,
    },
    /// A sphere centred on the origin.
    Sphere {
        /// Radius; positive.
        radius: f64,
    },
    /// All points within `radius` of the segment from `-half_height` to `half_height` on the z
    /// axis.
    Capsule {
        /// Half of the segment's length; positive.
        half_height: f64,
        /// Radius; positive.
        radius: f64,
    },
    /// All points within `radius` of the z axis, between `-half_height` and `half_height`.
    Cylinder {
        /// Half of its length; positive.
        half_height: f64,
        /// Radius; positive.
        radius: f64,
    },
}

impl Shape {
    /// Checks the sizes.
    ///
    /// # Errors
    /// [`CollideError::Shape`] names the shape and the size.
    pub fn validate(&self) -> Result<(), CollideError> {
        let positive = |x: f64| SIZE.contains(&x);
        let (shape, found, good) = match *self {
            Self::Mesh(_) | Self::Plane => return Ok(()),
            Self::Box { half_extents: h } => {
                ("box", format!("half extents {h}"), h.to_array().into_iter().all(positive))
            }
            Self::Sphere { radius } => ("sphere", format!("radius {radius}"), positive(radius)),
            Self::Capsule { half_height, radius } => (
                "capsule",
                format!("half height {half_height}, radius {radius}"),
                positive(half_height) && positive(radius),
            ),
            Self::Cylinder { half_height, radius } => (
                "cylinder",
                format!("half height {half_height}, radius {radius}"),
                positive(half_height) && positive(radius),
            ),
        };
        if good {
            return Ok(());
        }
        Err(CollideError::Shape { shape, found, expected: "numbers from 1e-50 to 1e50" })
    }

    /// Bounds in the shape's frame; infinite for a plane.
    pub fn bounds(&self) -> Aabb {
        match self {
            Self::Mesh(asset) => asset.bounds_of_solid(),
            simple => Simple::from(simple).bounds(),
        }
    }

    /// Centre and radius of a ball inside, in the shape's frame. The radius is a lower bound of the
    /// thickness of the body. For a mesh, it is the largest of the balls that touch the surface at
    /// the centroids of up to 64 faces, and for a sheet that of half of its thickness on a face;
    /// computed on first use. `None` for a plane, and for a mesh in which no ball was found.
    pub fn inner_ball(&self) -> Option<(DVec3, f64)> {
        match self {
            Self::Mesh(asset) => {
                let InnerBall { center, radius } = asset.inner_ball();
                let frame = asset.frame;
                (radius > 0.0).then(|| (frame.to_world(center), radius * frame.inverse_scale()))
            }
            simple => Simple::from(simple).inner_radius().map(|radius| (DVec3::ZERO, radius)),
        }
    }

    /// The parts that represent the surface of a simple shape in tests: convex polygons of one to
    /// three points, and a radius. The surface lies within the radius of the polygons. A box has
    /// twelve triangles, a capsule its segment, a sphere its centre, and a cylinder a prism with 32
    /// sides, whose edges are on it. Meshes and planes have faces of their own, so their list is
    /// empty.
    pub fn parts(&self) -> (Vec<Vec<DVec3>>, f64) {
        match self {
            Self::Mesh(_) | Self::Plane => (Vec::new(), 0.0),
            simple => {
                let simple = Simple::from(simple);
                (simple.parts().map(|points| points.to_vec()).collect(), simple.radius())
            }
        }
    }

    /// The distinct points of the [`parts`](Self::parts), each with the lowest part that has it.
    pub fn nodes(&self) -> Vec<(DVec3, u32)> {
        match self {
            Self::Mesh(_) | Self::Plane => Vec::new(),
            simple => Simple::from(simple).nodes().collect(),
        }
    }

    /// Diagonal of the bounds, in the shape's unit; infinite for a plane. For an open mesh, that of
    /// its faces.
    pub fn diagonal(&self) -> f64 {
        match self {
            Self::Mesh(asset) if asset.jump().is_some() => asset.bounds().extent().length(),
            _ => self.bounds().extent().length(),
        }
    }
}

/// Of two sizes the smaller and the larger one; infinite ones, those of planes, do not count.
pub(in crate::collide) fn least_and_most(sizes: [f64; 2]) -> (f64, f64) {
    let finite = sizes.into_iter().filter(|size| size.is_finite());
    finite.fold((f64::INFINITY, 0.0), |(least, most), size| (size.min(least), size.max(most)))
}

impl From<&Shape> for Simple {
    /// For any shape except a mesh. A mesh has no formula and becomes a point.
    fn from(shape: &Shape) -> Self {
        match *shape {
            Shape::Plane => Self::Plane,
            Shape::Box { half_extents } => Self::Box(half_extents),
            Shape::Sphere { radius } => Self::Round { half_height: 0.0, radius },
            Shape::Capsule { half_height, radius } => Self::Round { half_height, radius },
            Shape::Cylinder { half_height, radius } => Self::Cylinder(Cylinder { half_height, radius }),
            Shape::Mesh(_) => Self::Round { half_height: 0.0, radius: 0.0 },
        }
    }
}

impl From<Arc<TeSdf>> for Shape {
    fn from(asset: Arc<TeSdf>) -> Self {
        Self::Mesh(asset)
    }
}

impl From<TeSdf> for Shape {
    fn from(asset: TeSdf) -> Self {
        Self::Mesh(Arc::new(asset))
    }
}
