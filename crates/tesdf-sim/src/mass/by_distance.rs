//! Mass properties of a solid whose faces do not enclose it: by cubes, and the signed distances at
//! their centres.
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use tesdf::TeSdf;
use tesdf::base::elementary;
use tesdf::collide::Shape;

use super::integral::Integral;
use super::{MassError, MassProperties};

/// The longest side of the bounds has this many cubes at first.
const CUBES: f64 = 16.0;
/// A cube that the surface can pass through is halved along each axis this many times.
const HALVINGS: u32 = 3;

/// The mass properties of density 1. Cubes that the surface passes through are 1/128 of the longest
/// side; each counts by the share that a plane at its distance leaves. The error falls with the
/// square of that size.
pub fn by_distance(asset: &TeSdf, shape: &Shape) -> Result<MassProperties, MassError> {
    let bounds = shape.bounds();
    let (middle, extent) = (bounds.center(), bounds.extent());
    let edge = extent.max_element() / CUBES;
    if !(edge > 0.0 && edge.is_finite()) {
        return Err(MassError::NoVolume { volume: 0.0 });
    }
    let counts = (extent / edge).ceil().max(DVec3::ONE);
    let solid = Solid { asset, middle, jumps: asset.about().certificate().jumps() };
    let [x, y, z] = counts.to_array().map(|n| n as usize);
    let cube = |k: usize| {
        let at = DVec3::new((k % x) as f64, (k / x % y) as f64, (k / x / y) as f64);
        solid.cube(middle + edge * (at + 0.5 - 0.5 * counts), edge, HALVINGS)
    };
    // Summed in order, for any number of threads.
    let parts: Vec<Integral> = (0..x * y * z).into_par_iter().map(cube).collect();
    parts.into_iter().sum::<Integral>().about(middle)
}

struct Solid<'a> {
    asset: &'a TeSdf,
    /// The reference point.
    middle: DVec3,
    /// Whether the side can change without a face.
    jumps: bool,
}

impl Solid<'_> {
    fn cube(&self, center: DVec3, edge: f64, halvings: u32) -> Integral {
        let at = self.asset.query(center);
        let half = 0.5 * edge;
        let corner = |k: u32| {
            let side = |axis: u32| if k >> axis & 1 == 1 { half } else { -half };
            center + DVec3::new(side(0), side(1), side(2))
        };
        let is_inside = at.signed_distance < 0.0;
        let same_side = |k: u32| (self.asset.query(corner(k)).signed_distance < 0.0) == is_inside;
        let is_whole =
            at.signed_distance.abs() >= 3f64.sqrt() * half && (!self.jumps || (0..8).all(same_side));
        if !is_whole && halvings > 0 {
            let part = |k| self.cube(center.midpoint(corner(k)), half, halvings - 1);
            return (0..8).map(part).sum();
        }
        // Where two solids overlap, faces have the inside on both sides.
        let beyond = at.closest_point + 0.01 * edge * (at.closest_point - center).normalize_or_zero();
        let share = if is_whole || (self.asset.query(beyond).signed_distance < 0.0) == is_inside {
            f64::from(u8::from(is_inside))
        } else {
            // How far a plane with this normal is from the centre when it has left the cube.
            let across = at.gradient.abs().element_sum().max(1.0) * edge;
            (0.5 - at.signed_distance / across).clamp(0.0, 1.0)
        };
        let volume = share * elementary::powi(edge, 3);
        let own = DMat3::from_diagonal(DVec3::splat(volume * edge * edge / 12.0));
        Integral::of_part(volume, center - self.middle, own)
    }
}
