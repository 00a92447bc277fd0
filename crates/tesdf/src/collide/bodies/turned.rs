//! How the prism of a cylinder is turned about its axis, so that one of its edges is lowest.
//!
//! The edges of the prism are on the cylinder, and its faces inside. The places where a cylinder
//! touches a plane are on edges then, so it rolls without bumps.
use glam::{DMat3, DVec2, DVec3};

use crate::collide::bodies::field::Field;
use crate::collide::scene::cylinder::Cylinder;
use crate::collide::scene::simple::Simple;

/// Steps towards the lowest place. Over a plane, one is enough.
const STEPS: usize = 4;

/// Halvings of the height at which a line along the axis is lowest.
const HALVINGS: usize = 32;

/// The turn about the z axis of a cylinder whose points p are at `linear` · p + `shift` of a field.
pub fn turn(cylinder: &Cylinder, linear: DMat3, shift: DVec3, field: &Field) -> DMat3 {
    let direction = match field {
        Field::Simple(simple) => lowest_direction(cylinder, linear, shift, simple),
        Field::Mesh(_) => direction_from_axis(cylinder, linear, shift, field),
    };
    let DVec2 { x, y } = direction;
    DMat3::from_cols(DVec3::new(x, y, 0.0), DVec3::new(-y, x, 0.0), DVec3::Z)
}

/// The direction from the axis to the nearest surface of a mesh: from the lowest of its middle and its
/// ends. Where the cylinder touches it elsewhere, too, the faces of the mesh find the lowest places.
fn direction_from_axis(cylinder: &Cylinder, linear: DMat3, shift: DVec3, field: &Field) -> DVec2 {
    let on_axis = [0.0, -cylinder.half_height, cylinder.half_height];
    let values = on_axis.map(|z| field.rough_value(linear * DVec3::new(0.0, 0.0, z) + shift).0);
    let lowest = values.iter().min_by(|a, b| a.distance.total_cmp(&b.distance));
    let down = lowest.map(|value| -(linear.transpose() * value.gradient).truncate());
    down.and_then(|down| down.try_normalize()).unwrap_or(DVec2::X)
}

/// The direction from the axis in which the surface is lowest in the field of a simple shape.
fn lowest_direction(cylinder: &Cylinder, linear: DMat3, shift: DVec3, simple: &Simple) -> DVec2 {
    let Cylinder { half_height, radius } = *cylinder;
    let value = |p: DVec3| simple.value(linear * p + shift);
    let lowest_at = |beside: DVec2| {
        let (mut low, mut high) = (-half_height, half_height);
        for _ in 0..HALVINGS {
            let at = |share: f64| low + share * (high - low);
            let [a, b] = [at(0.45), at(0.55)];
            let [of_a, of_b] = [a, b].map(|z| value(beside.extend(z)).distance);
            (low, high) = if of_a <= of_b { (low, b) } else { (a, high) };
        }
        beside.extend(0.5 * (low + high))
    };
    let mut best = (f64::INFINITY, DVec2::X);
    let mut at = DVec3::ZERO;
    for step in 0..STEPS {
        let is_plane = matches!(simple, Simple::Plane);
        if !is_plane {
            at = lowest_at(at.truncate());
        }
        let value = value(at);
        if step > 0 && value.distance >= best.0 {
            break;
        }
        let down = -(linear.transpose() * value.gradient).truncate();
        let Some(direction) = down.try_normalize() else { break };
        best = (if step > 0 { value.distance } else { f64::INFINITY }, direction);
        if is_plane {
            break;
        }
        at = (radius * direction).extend(0.0);
    }
    best.1
}
