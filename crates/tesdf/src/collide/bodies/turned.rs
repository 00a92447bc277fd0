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
/// Over a mesh there is none: the faces of the mesh find the lowest places.
pub fn turn(cylinder: &Cylinder, linear: DMat3, shift: DVec3, field: &Field) -> DMat3 {
    let Field::Simple(simple) = *field else { return DMat3::IDENTITY };
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
    let DVec2 { x, y } = best.1;
    DMat3::from_cols(DVec3::new(x, y, 0.0), DVec3::new(-y, x, 0.0), DVec3::Z)
}
