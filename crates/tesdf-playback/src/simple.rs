//! Meshes of simple shapes.
use std::f64::consts::{FRAC_PI_2, TAU};

use tesdf::glam::{DVec2, DVec3, Vec3};

use crate::mesh::Mesh;

/// Meridians of a sphere or capsule.
const MERIDIANS: u32 = 48;
/// Circles of latitude between the equator and a pole.
const LATITUDES: u32 = 12;
/// Least number of squares of a floor per diagonal of the scene.
const SQUARES: f64 = 8.0;
/// Radius of a floor, in diagonals of the scene.
const FLOOR: f64 = 1.2;

/// A box centred on the origin.
pub fn cuboid(half: DVec3) -> Mesh {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let mut normal = DVec3::ZERO;
            normal[axis] = sign;
            let (mut u, mut v) = (DVec3::ZERO, DVec3::ZERO);
            // u × v = normal.
            u[(axis + 1) % 3] = 1.0;
            v[(axis + 2) % 3] = sign;
            let corner = |a: f64, b: f64| (half * (normal + a * u + b * v)).as_vec3();
            let corners = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
            let quad = corners.map(|p| mesh.vertex(p, normal.as_vec3()));
            mesh.quad(quad);
        }
    }
    mesh
}

/// A sphere, or with a half height above 0 a capsule along z, centred on the origin.
pub fn capsule(half_height: f64, radius: f64) -> Mesh {
    let mut mesh = Mesh::default();
    // Circles of latitude from the south to the north. A capsule has the equator twice.
    let quarter = |k: u32| f64::from(k) / f64::from(LATITUDES) * FRAC_PI_2;
    let south = (0..=LATITUDES).map(|k| (quarter(k) - FRAC_PI_2, -half_height));
    let north = (u32::from(half_height == 0.0)..=LATITUDES).map(|k| (quarter(k), half_height));
    let circles: Vec<(f64, f64)> = south.chain(north).collect();
    for &(latitude, shift) in &circles {
        for k in 0..MERIDIANS {
            let angle = f64::from(k) / f64::from(MERIDIANS) * TAU;
            let normal =
                DVec3::new(latitude.cos() * angle.cos(), latitude.cos() * angle.sin(), latitude.sin());
            mesh.vertex((radius * normal + shift * DVec3::Z).as_vec3(), normal.as_vec3());
        }
    }
    for circle in 0..circles.len() as u32 - 1 {
        for k in 0..MERIDIANS {
            let [a, b] = [k, (k + 1) % MERIDIANS].map(|k| circle * MERIDIANS + k);
            // At the poles one of the two faces has no area.
            if circle > 0 {
                mesh.indices.extend([a, b, b + MERIDIANS]);
            }
            if circle + 2 < circles.len() as u32 {
                mesh.indices.extend([a, b + MERIDIANS, a + MERIDIANS]);
            }
        }
    }
    mesh
}

/// A cylinder along z, centred on the origin.
pub fn cylinder(half_height: f64, radius: f64) -> Mesh {
    let mut mesh = Mesh::default();
    let directions = (0..MERIDIANS).map(|k| DVec2::from_angle(f64::from(k) / f64::from(MERIDIANS) * TAU));
    for direction in directions {
        for z in [-half_height, half_height] {
            let p = (radius * direction).extend(z).as_vec3();
            mesh.vertex(p, direction.extend(0.0).as_vec3());
            mesh.vertex(p, (z.signum() * DVec3::Z).as_vec3());
        }
    }
    let [low, high] = [-1.0, 1.0]
        .map(|sign| mesh.vertex((sign * half_height * DVec3::Z).as_vec3(), (sign * DVec3::Z).as_vec3()));
    for k in 0..MERIDIANS {
        let [a, b] = [k, (k + 1) % MERIDIANS].map(|k| 4 * k);
        mesh.quad([a, b, b + 2, a + 2]);
        mesh.indices.extend([low, b + 1, a + 1]);
        mesh.indices.extend([high, a + 3, b + 3]);
    }
    mesh
}

/// A floor in the plane z = 0: its light and its dark squares of edge `square`, around the origin.
/// `phase` is the position of the origin in the pattern, in which squares begin at multiples of
/// their edge.
pub fn floor(phase: DVec2, square: f64, diagonal: f64) -> [Mesh; 2] {
    let mut meshes = [Mesh::default(), Mesh::default()];
    let reach = (FLOOR * diagonal / square).ceil() as i64;
    let first = (phase / square).floor();
    for x in -reach..=reach {
        for y in -reach..=reach {
            let cell = first + DVec2::new(x as f64, y as f64);
            let low = cell * square - phase;
            if (low + 0.5 * square).length() > FLOOR * diagonal {
                continue;
            }
            let odd = (cell.x + cell.y).rem_euclid(2.0) > 0.5;
            let mesh = &mut meshes[usize::from(odd)];
            let corner = |a: f64, b: f64| (low + square * DVec2::new(a, b)).extend(0.0).as_vec3();
            let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
            let quad = corners.map(|p| mesh.vertex(p, Vec3::Z));
            mesh.quad(quad);
        }
    }
    meshes
}

/// Edge of the squares of a floor below a scene with this diagonal.
pub fn square(diagonal: f64) -> f64 {
    round_step(diagonal, SQUARES)
}

/// The largest step of 1, 2 or 5 times a power of ten that divides `range`, a positive length, into
/// at least `count` parts.
pub fn round_step(range: f64, count: f64) -> f64 {
    let rough = range / count;
    let power = 10_f64.powf(rough.log10().floor());
    let factor = [5.0, 2.0, 1.0].into_iter().find(|f| f * power <= rough * (1.0 + 1e-9)).unwrap_or(1.0);
    factor * power
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volume of a mesh, which is negative if its faces are the wrong way round, and its area.
    fn measure(mesh: &Mesh) -> (f64, f64) {
        let at = |i: u32| Vec3::from_array(mesh.positions[i as usize]).as_dvec3();
        let mut sums = (0.0, 0.0);
        for face in mesh.indices.chunks(3) {
            let [a, b, c] = [at(face[0]), at(face[1]), at(face[2])];
            let full = (b - a).cross(c - a);
            assert!(full.length() > 0.0, "a face without area");
            for &i in face {
                let normal = Vec3::from_array(mesh.normals[i as usize]);
                assert!(normal.is_normalized() && normal.as_dvec3().dot(full) > 0.9 * full.length());
            }
            sums.0 += a.dot(full) / 6.0;
            sums.1 += 0.5 * full.length();
        }
        sums
    }

    #[test]
    fn meshes_of_simple_shapes_have_their_volume_and_area() {
        let near = |found: f64, expected: f64, bound: f64| {
            assert!((found / expected - 1.0).abs() < bound, "{found}, expected {expected}");
        };
        let (volume, area) = measure(&cuboid(DVec3::new(1.0, 2.0, 3.0)));
        near(volume, 48.0, 1e-6);
        near(area, 88.0, 1e-6);
        let pi = 0.5 * TAU;
        let (volume, area) = measure(&capsule(0.0, 2.0));
        near(volume, 32.0 / 3.0 * pi, 0.01);
        near(area, 16.0 * pi, 0.01);
        let (volume, area) = measure(&capsule(3.0, 2.0));
        near(volume, 32.0 / 3.0 * pi + 24.0 * pi, 0.01);
        near(area, 16.0 * pi + 24.0 * pi, 0.01);
        let (volume, area) = measure(&cylinder(3.0, 2.0));
        near(volume, 24.0 * pi, 0.01);
        near(area, 24.0 * pi + 8.0 * pi, 0.01);
        let [light, dark] = floor(DVec2::new(0.3, 12.7), 0.1, 1.0).map(|mesh| measure(&mesh).1);
        near(light + dark, pi * FLOOR * FLOOR, 0.05);
        near(light, dark, 0.05);
    }
}
