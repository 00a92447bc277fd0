//! The fields of planes, boxes, spheres and capsules, in closed form.
//!
//! Mirrors `collide/scene/simple.rs` of `tesdf`.
use cubecl::prelude::*;

use crate::kernels::geometry::vector::{LEAST_DIVISOR, V3, pick, v3};
use crate::kernels::query::value::Value;
use crate::kernels::scene::shape::{BOX, Field, FieldExpand, KIND, PLANE, SIZES};

/// Distance and gradient, and the nearest side of a box.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
pub struct Simple {
    pub distance: f32,
    pub gradient: V3,
    pub side: u32,
}

/// A sphere or a capsule: all points within a radius of a segment on the z axis.
#[cube]
fn round(p: V3, half_height: f32, radius: f32) -> Simple {
    let core = v3(0.0f32, 0.0f32, p.z.clamp(-half_height, half_height));
    let from_core = p - core;
    let reach = from_core.length();
    let gradient =
        pick(reach <= 0.0f32, v3(1.0f32, 0.0f32, 0.0f32), from_core * (1.0f32 / reach.max(LEAST_DIVISOR)));
    Simple { distance: reach - radius, gradient, side: 0u32 }
}

/// The half space z ≤ 0.
#[cube]
fn plane(p: V3) -> Simple {
    Simple { distance: p.z, gradient: v3(0.0f32, 0.0f32, 1.0f32), side: 0u32 }
}

/// A box of half extents `sizes`.
#[cube]
fn block(p: V3, sizes: V3) -> Simple {
    let clamped =
        v3(p.x.clamp(-sizes.x, sizes.x), p.y.clamp(-sizes.y, sizes.y), p.z.clamp(-sizes.z, sizes.z));
    let outward = p - clamped;
    let depth = sizes - p.abs();
    let x_least = depth.x <= depth.y && depth.x <= depth.z;
    let axis = select(x_least, 0u32, select(depth.y <= depth.z, 1u32, 2u32));
    let sign = select(p.at(axis) < 0.0f32, -1.0f32, 1.0f32);
    let out = outward.length();
    let is_out = out > 0.0f32;
    let inward = v3(
        select(axis == 0u32, sign, 0.0f32),
        select(axis == 1u32, sign, 0.0f32),
        select(axis == 2u32, sign, 0.0f32),
    );
    Simple {
        distance: select(is_out, out, -depth.at(axis)),
        gradient: pick(is_out, outward * (1.0f32 / out.max(LEAST_DIVISOR)), inward),
        side: 2u32 * axis + select(sign > 0.0f32, 1u32, 0u32),
    }
}

#[cube]
impl Field<'_> {
    /// The value of a simple shape.
    pub fn simple_value(self, p: V3) -> Value {
        let kind = self.entry(KIND);
        let sizes = self.vector(SIZES);
        let mut found = round(p, sizes.x, sizes.y);
        if kind == PLANE {
            found = plane(p);
        }
        if kind == BOX {
            found = block(p, sizes);
        }
        Value {
            distance: found.distance,
            gradient: found.gradient,
            point: p + found.gradient * -found.distance,
            face: found.side,
            feature: 0u32,
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};
    use tesdf::collide::Shape;

    use super::*;

    /// The fields equal those of the processor, also on the shapes' symmetry planes.
    #[test]
    fn fields_of_simple_shapes_are_those_of_the_processor() {
        let mut random = fastrand::Rng::with_seed(3);
        for k in 0..20_000 {
            let mut number = || random.f64() * 2.0 - 1.0;
            let mut p = DVec3::new(number(), number(), number());
            p[k % 5 % 3] *= f64::from(u8::from(k % 5 > 1));
            let p = p.as_vec3();
            let at = v3(p.x, p.y, p.z);
            let half = DVec3::new(0.25, 0.5, 0.125);
            let shapes = [
                (Shape::Plane, plane(at)),
                (Shape::Box { half_extents: half }, block(at, v3(0.25, 0.5, 0.125))),
                (Shape::Sphere { radius: 0.5 }, round(at, 0.0, 0.5)),
                (Shape::Capsule { half_height: 0.25, radius: 0.5 }, round(at, 0.25, 0.5)),
            ];
            for (shape, found) in shapes {
                let expected = shape.signed_distance(p.as_dvec3());
                assert!((f64::from(found.distance) - expected).abs() < 2e-7, "{shape:?} at {p}");
                let gradient = Vec3::new(found.gradient.x, found.gradient.y, found.gradient.z);
                assert!((gradient.length() - 1.0).abs() < 1e-6, "{shape:?} at {p}: {gradient}");
                let foot = p.as_dvec3() - f64::from(found.distance) * gradient.as_dvec3();
                assert!(shape.signed_distance(foot).abs() < 1e-6, "{shape:?} at {p}: {foot}");
            }
        }
    }
}
