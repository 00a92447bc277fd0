use std::sync::Arc;

use glam::DVec3;
use rapier3d_f64::geometry::{Aabb, FeatureId, Ray, RayIntersection, Shape, ShapeType, TypedShape};
use rapier3d_f64::parry::bounding_volume::BoundingSphere;
use rapier3d_f64::parry::mass_properties::MassProperties;
use rapier3d_f64::parry::query::{PointProjection, PointQuery, RayCast};
use tesdf::TeSdf;
use tesdf::query::Answer;
use tesdf_sim::MassProperties as SolidMass;

/// An encoded mesh as a shape of parry and Rapier, with a uniform scale.
///
/// The shape is a solid: its interior belongs to it. A clone shares the asset.
/// [`TesdfDispatcher`](crate::TesdfDispatcher) finds its contacts; parry's own dispatcher does not
/// know the shape.
#[derive(Clone, Debug)]
pub struct TesdfShape {
    asset: Arc<TeSdf>,
    scale: f64,
}

impl TesdfShape {
    /// The mesh, where one unit of the mesh is one world unit.
    pub fn new(asset: Arc<TeSdf>) -> Self {
        Self { asset, scale: 1.0 }
    }

    /// The mesh, where one unit of the mesh is `scale` world units. Returns `None` unless `scale`
    /// is finite and positive.
    pub fn scaled(asset: Arc<TeSdf>, scale: f64) -> Option<Self> {
        (scale > 0.0 && scale.is_finite()).then_some(Self { asset, scale })
    }

    /// The encoded mesh.
    pub fn asset(&self) -> &Arc<TeSdf> {
        &self.asset
    }

    /// World units per unit of the mesh.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    fn answer(&self, p: DVec3) -> Answer {
        self.asset.query(p / self.scale)
    }
}

impl PointQuery for TesdfShape {
    fn project_local_point(&self, p: DVec3, solid: bool) -> PointProjection {
        let answer = self.answer(p);
        let inside = answer.signed_distance < 0.0;
        let point = if inside && solid { p } else { answer.closest_point * self.scale };
        PointProjection::new(inside, point)
    }

    fn project_local_point_and_get_feature(&self, p: DVec3) -> (PointProjection, FeatureId) {
        let answer = self.answer(p);
        let projection =
            PointProjection::new(answer.signed_distance < 0.0, answer.closest_point * self.scale);
        (projection, FeatureId::Face(answer.face))
    }
}

impl RayCast for TesdfShape {
    fn cast_local_ray_and_get_normal(&self, ray: &Ray, limit: f64, solid: bool) -> Option<RayIntersection> {
        if solid && self.contains_local_point(ray.origin) {
            return Some(RayIntersection::new(0.0, DVec3::ZERO, FeatureId::Unknown));
        }
        // The direction is divided as well, so the parameter t stays the same.
        let hit = self.asset.ray_cast(ray.origin / self.scale, ray.dir / self.scale, limit)?;
        // As for parry's shapes, a ray from inside gets a normal that points against the ray.
        let normal = if hit.normal.dot(ray.dir) > 0.0 { -hit.normal } else { hit.normal };
        Some(RayIntersection::new(hit.t, normal, FeatureId::Face(hit.face)))
    }
}

impl Shape for TesdfShape {
    fn compute_local_aabb(&self) -> Aabb {
        let bounds = self.asset.bounds();
        Aabb::new(bounds.min * self.scale, bounds.max * self.scale)
    }

    fn compute_local_bounding_sphere(&self) -> BoundingSphere {
        let bounds = self.compute_local_aabb();
        BoundingSphere::new(bounds.center(), bounds.half_extents().length())
    }

    fn clone_dyn(&self) -> Box<dyn Shape> {
        Box::new(self.clone())
    }

    /// Returns `None` unless the scale is uniform and positive: only then do distances stay exact.
    fn scale_dyn(&self, scale: DVec3, _: u32) -> Option<Box<dyn Shape>> {
        let uniform = scale == DVec3::splat(scale.x);
        let shape = Self::scaled(self.asset.clone(), self.scale * scale.x).filter(|_| uniform)?;
        Some(Box::new(shape))
    }

    /// Mass properties of the solid; zero for a mesh without volume or a density that is not
    /// positive.
    fn mass_properties(&self, density: f64) -> MassProperties {
        match SolidMass::of_shape(&self.asset.clone().into(), self.scale, density) {
            Ok(SolidMass { mass, center, inertia }) => {
                MassProperties::with_inertia_matrix(center, mass, inertia)
            }
            Err(_) => MassProperties::default(),
        }
    }

    fn shape_type(&self) -> ShapeType {
        ShapeType::Custom
    }

    fn as_typed_shape(&self) -> TypedShape<'_> {
        TypedShape::Custom(self)
    }

    /// Zero, as for parry's meshes: the smallest wall thickness is not known.
    fn ccd_thickness(&self) -> f64 {
        0.0
    }

    fn ccd_angular_thickness(&self) -> f64 {
        std::f64::consts::FRAC_PI_2
    }
}
