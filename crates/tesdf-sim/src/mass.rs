//! Mass, centre of mass and inertia of meshes and simple shapes.
mod by_distance;
mod integral;

use std::f64::consts::PI;

use glam::{DMat3, DVec3};
use nalgebra::{Matrix3, SymmetricEigen};
use tesdf::TeSdf;
use tesdf::base::InsideRule;
use tesdf::base::elementary;
use tesdf::collide::Shape;

use by_distance::by_distance;
use integral::{Integral, square};

/// Mass, centre of mass and inertia of a rigid body, in the frame of its mesh or shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Mass, kg; positive.
    pub mass: f64,
    /// Centre of mass, m, in the body's frame.
    pub center: DVec3,
    /// Inertia about the centre of mass, kg m², along the axes of the body's frame; symmetric and
    /// positive definite.
    pub inertia: DMat3,
}

/// The symmetric matrix of moments and products of inertia in the order xx, yy, zz, xy, xz, yz.
pub fn inertia_matrix([xx, yy, zz, xy, xz, yz]: [f64; 6]) -> DMat3 {
    DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz))
}

/// Why a body has no mass properties.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MassError {
    /// The density or mass is not a positive finite number.
    #[error("{what} {found}; expected a finite number greater than 0")]
    NotPositive {
        /// `density` or `mass`.
        what: &'static str,
        /// The value that was given.
        found: f64,
    },
    /// The shape is a half space.
    #[error("a plane has no finite mass; make the body fixed")]
    Plane,
    /// The mesh encloses no positive volume.
    #[error("the mesh encloses {volume:e} m³; a free body needs a closed mesh whose faces point outward")]
    NoVolume {
        /// The signed volume, m³.
        volume: f64,
    },
    /// No body has these moments of inertia.
    #[error(
        "moments of inertia {moments:?} kg m² about the principal axes; expected finite numbers greater than 0, none \
         greater than the sum of the others"
    )]
    Inertia {
        /// About the principal axes, kg m².
        moments: [f64; 3],
    },
    /// The centre of mass is not finite.
    #[error("centre of mass {found}; expected finite numbers")]
    Center {
        /// The value that was given.
        found: DVec3,
    },
}

/// Moments of inertia may break the triangle inequality by this share of the greatest one: rounding.
const TRIANGLE: f64 = 1e-9;

impl MassProperties {
    /// Mass properties of a shape of uniform `density`, kg/m³. `scale` is the length of one unit of
    /// the shape, m.
    ///
    /// The volume of a mesh is weighted by the winding number: a volume that two shells share
    /// counts twice, and a volume inside an inverted surface counts as negative. This is exact.
    ///
    /// Where another rule says what is inside, two methods approximate:
    /// - A sheet is the sum of prisms of its thickness over its faces. What its round border adds
    ///   and what prisms share at folds is left out, in all some thickness × length of borders and
    ///   folds of its area.
    /// - Otherwise, cubes of 1/128 of the longest side of the bounds are asked for their distance;
    ///   the mass is some 0.2 % off. The volume is that of the solid, each place counted once.
    ///
    /// # Errors
    /// A density that is not positive, a plane, or a mesh without volume.
    pub fn of_shape(shape: &Shape, scale: f64, density: f64) -> Result<Self, MassError> {
        let unit = match shape {
            Shape::Mesh(asset) if asset.faces_enclose_the_solid() => Self::of_triangles(triangles(asset))?,
            Shape::Mesh(asset) => match asset.inside().rule {
                InsideRule::Sheet { thickness } => Self::of_sheet(triangles(asset), thickness)?,
                _ => by_distance(asset, shape)?,
            },
            Shape::Plane => return Err(MassError::Plane),
            Shape::Box { half_extents: h } => {
                let mass = 8.0 * h.x * h.y * h.z;
                let square = *h * *h;
                Self::on_axes(mass, mass / 3.0 * (DVec3::splat(square.element_sum()) - square))
            }
            Shape::Sphere { radius: r } => {
                let mass = 4.0 / 3.0 * PI * elementary::powi(*r, 3);
                Self::on_axes(mass, DVec3::splat(0.4 * mass * r * r))
            }
            Shape::Cylinder { half_height: l, radius: r } => {
                let mass = 2.0 * PI * r * r * l;
                let across = mass * (r * r / 4.0 + l * l / 3.0);
                Self::on_axes(mass, DVec3::new(across, across, mass * r * r / 2.0))
            }
            Shape::Capsule { half_height: l, radius: r } => {
                let (cylinder, sphere) = (2.0 * PI * r * r * l, 4.0 / 3.0 * PI * elementary::powi(*r, 3));
                let along = cylinder * r * r / 2.0 + sphere * 0.4 * r * r;
                // A half sphere's centre lies 3/8 r from its base.
                let across =
                    cylinder * (r * r / 4.0 + l * l / 3.0) + sphere * (0.4 * r * r + l * l + 0.75 * l * r);
                Self::on_axes(cylinder + sphere, DVec3::new(across, across, along))
            }
        };
        check("density", density)?;
        Ok(Self {
            mass: unit.mass * density * elementary::powi(scale, 3),
            center: unit.center * scale,
            inertia: unit.inertia * (density * elementary::powi(scale, 5)),
        })
    }

    /// Mass properties of the solid of density 1 that outward-facing triangles enclose.
    ///
    /// The integrals over the tetrahedra between each triangle and the mean of all corners are
    /// closed formulas, so only rounding makes them inexact.
    ///
    /// # Errors
    /// [`MassError::NoVolume`].
    pub fn of_triangles(
        triangles: impl ExactSizeIterator<Item = [DVec3; 3]> + Clone,
    ) -> Result<Self, MassError> {
        let middle = middle(triangles.clone());
        let part = |triangle: [DVec3; 3]| {
            let [a, b, c] = triangle.map(|p| p - middle);
            let (six, sum) = (a.dot(b.cross(c)), a + b + c);
            let second = six / 120.0 * (square(a) + square(b) + square(c) + square(sum));
            Integral { volume: six / 6.0, first: six / 24.0 * sum, second }
        };
        triangles.map(part).sum::<Integral>().about(middle)
    }

    /// Mass properties of density 1 of prisms of a thickness over triangles, which lie in their
    /// middle.
    ///
    /// # Errors
    /// [`MassError::NoVolume`].
    fn of_sheet(
        triangles: impl ExactSizeIterator<Item = [DVec3; 3]> + Clone,
        thickness: f64,
    ) -> Result<Self, MassError> {
        let middle = middle(triangles.clone());
        let part = |triangle: [DVec3; 3]| {
            let [a, b, c] = triangle.map(|p| p - middle);
            let across = (b - a).cross(c - a);
            let volume = 0.5 * across.length() * thickness;
            let center = (a + b + c) / 3.0;
            let around: DMat3 = [a, b, c].map(|p| square(p - center)).into_iter().sum();
            let along = square(across.normalize_or_zero()) * thickness * thickness;
            Integral::of_part(volume, center, volume / 12.0 * (around + along))
        };
        triangles.map(part).sum::<Integral>().about(middle)
    }

    /// Mass properties from elsewhere: the mass, kg, the centre of mass in the body's frame, m, and
    /// the inertia about it along the axes of that frame, kg m².
    ///
    /// # Errors
    /// A number that no body has.
    pub fn new(mass: f64, center: DVec3, inertia: DMat3) -> Result<Self, MassError> {
        check("mass", mass)?;
        if !center.is_finite() {
            return Err(MassError::Center { found: center });
        }
        let found = inertia.to_cols_array();
        let moments = match found.iter().all(|x| x.is_finite()) {
            true => SymmetricEigen::new(Matrix3::from_column_slice(&found)).eigenvalues.into(),
            false => [f64::NAN; 3],
        };
        let [x, y, z] = moments;
        let most = x.max(y).max(z);
        if !(x.min(y).min(z) > 0.0 && 2.0 * most <= (x + y + z) * (1.0 + TRIANGLE)) {
            return Err(MassError::Inertia { moments });
        }
        Ok(Self { mass, center, inertia })
    }

    /// The same distribution of mass, scaled to the total `mass`, kg.
    ///
    /// # Errors
    /// A mass that is not positive.
    pub fn with_mass(self, mass: f64) -> Result<Self, MassError> {
        check("mass", mass)?;
        Ok(Self { mass, inertia: self.inertia * (mass / self.mass), ..self })
    }

    /// Radius of gyration, m, about the axis through the centre of mass along `axis`, a unit vector
    /// in the body's frame.
    pub fn radius_of_gyration(&self, axis: DVec3) -> f64 {
        (axis.dot(self.inertia * axis) / self.mass).sqrt()
    }

    fn on_axes(mass: f64, inertia: DVec3) -> Self {
        Self { mass, center: DVec3::ZERO, inertia: DMat3::from_diagonal(inertia) }
    }
}

fn triangles(asset: &TeSdf) -> impl ExactSizeIterator<Item = [DVec3; 3]> + Clone {
    (0..asset.face_count()).map(|f| asset.face_corners(f))
}

/// The mean of all corners. With the origin as the reference point, a body far from it would lose
/// digits to cancellation.
fn middle(triangles: impl ExactSizeIterator<Item = [DVec3; 3]>) -> DVec3 {
    let count = 3.0 * triangles.len().max(1) as f64;
    triangles.flatten().sum::<DVec3>() / count
}

fn check(what: &'static str, found: f64) -> Result<(), MassError> {
    if found > 0.0 && found.is_finite() { Ok(()) } else { Err(MassError::NotPositive { what, found }) }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    /// The twelve outward-facing triangles of a box.
    fn box_triangles(half: DVec3) -> Vec<[DVec3; 3]> {
        let corner = |k: usize| {
            let sign = |bit: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
            half * DVec3::new(sign(0), sign(1), sign(2))
        };
        let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).map(|t| t.map(corner)).collect()
    }

    fn assert_close(found: &MassProperties, expected: &MassProperties, bound: f64) {
        assert!((found.mass / expected.mass - 1.0).abs() < bound, "{found:?} {expected:?}");
        let scale = expected.inertia.x_axis.length();
        let difference = found.inertia - expected.inertia;
        let worst = difference.to_cols_array().into_iter().map(f64::abs).fold(0.0, f64::max);
        assert!(worst < bound * scale, "{found:?} {expected:?}");
        let size = (scale / expected.mass).sqrt();
        assert!(found.center.distance(expected.center) < bound * size, "{found:?} {expected:?}");
    }

    #[test]
    fn a_box_mesh_has_the_mass_properties_of_the_box() {
        let half = DVec3::new(0.5, 1.0, 2.5);
        let formula = MassProperties::of_shape(&Shape::Box { half_extents: half }, 1.0, 1.0).unwrap();
        let triangles = box_triangles(half);
        assert_close(&MassProperties::of_triangles(triangles.iter().copied()).unwrap(), &formula, 1e-14);

        // The same box, rotated and a thousand times its size away from the origin.
        let turn = DQuat::from_scaled_axis(DVec3::new(0.3, -1.0, 0.7));
        let offset = DVec3::new(3000.0, -2000.0, 1000.0);
        let moved = triangles.iter().map(|t| t.map(|p| turn * p + offset));
        let r = DMat3::from_quat(turn);
        let expected =
            MassProperties { center: offset, inertia: r * formula.inertia * r.transpose(), ..formula };
        assert_close(&MassProperties::of_triangles(moved).unwrap(), &expected, 1e-11);
    }

    /// Integrates over slices: a solid of revolution of radius `r(z)` is a stack of discs.
    fn revolved(radius: impl Fn(f64) -> f64, half: f64) -> MassProperties {
        let n = 200_000;
        let dz = 2.0 * half / f64::from(n);
        let (mut mass, mut along, mut across) = (0.0, 0.0, 0.0);
        for k in 0..n {
            let z = -half + (f64::from(k) + 0.5) * dz;
            let r = radius(z);
            let m = PI * r * r * dz;
            mass += m;
            along += m * r * r / 2.0;
            across += m * (r * r / 4.0 + z * z);
        }
        MassProperties::on_axes(mass, DVec3::new(across, across, along))
    }

    #[test]
    fn masses_of_round_shapes_equal_sums_over_slices() {
        let (half_height, radius): (f64, f64) = (1.3, 0.7);
        let capsule = MassProperties::of_shape(&Shape::Capsule { half_height, radius }, 1.0, 1.0).unwrap();
        let profile = |z: f64| (radius.powi(2) - (z.abs() - half_height).max(0.0).powi(2)).sqrt();
        assert_close(&capsule, &revolved(profile, half_height + radius), 1e-8);
        let cylinder = MassProperties::of_shape(&Shape::Cylinder { half_height, radius }, 1.0, 1.0).unwrap();
        assert_close(&cylinder, &revolved(|_| radius, half_height), 1e-8);
        let sphere = MassProperties::of_shape(&Shape::Sphere { radius }, 1.0, 1.0).unwrap();
        assert_close(&sphere, &revolved(|z| (radius * radius - z * z).sqrt(), radius), 1e-8);
    }

    #[test]
    fn mass_properties_scale_with_density_size_and_mass() {
        let shape = Shape::Box { half_extents: DVec3::new(0.5, 1.0, 1.5) };
        let large = Shape::Box { half_extents: DVec3::new(1.0, 2.0, 3.0) };
        let scaled = MassProperties::of_shape(&shape, 2.0, 7.0).unwrap();
        assert_close(&scaled, &MassProperties::of_shape(&large, 1.0, 7.0).unwrap(), 1e-14);
        let heavy = scaled.with_mass(2.0 * scaled.mass).unwrap();
        assert_close(&heavy, &MassProperties::of_shape(&large, 1.0, 14.0).unwrap(), 1e-14);
        assert!((scaled.radius_of_gyration(DVec3::Z) - (20.0_f64 / 12.0).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn shapes_without_mass_are_refused() {
        assert_eq!(MassProperties::of_shape(&Shape::Plane, 1.0, 1.0), Err(MassError::Plane));
        let sphere = Shape::Sphere { radius: 1.0 };
        let zero = MassProperties::of_shape(&sphere, 1.0, 0.0);
        assert_eq!(zero, Err(MassError::NotPositive { what: "density", found: 0.0 }));
        let inside_out = box_triangles(DVec3::ONE).into_iter().map(|[a, b, c]| [a, c, b]).collect::<Vec<_>>();
        let refused = MassProperties::of_triangles(inside_out.into_iter());
        assert!(matches!(refused, Err(MassError::NoVolume { volume }) if (volume + 8.0).abs() < 1e-12));
    }
}
