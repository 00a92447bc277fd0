//! Signed distances by brute force over all faces, for every rule of what is inside.
use std::f64::consts::PI;

use tesdf::base::InsideRule;
use tesdf::geometry::Triangle;
use tesdf::geometry::internal::perturbed_orientation;
use tesdf::glam::DVec3;
use tesdf::mesh::{Topology, TriangleMesh, WindingNumber};

/// All faces of a mesh, with a rule.
pub struct BruteInside {
    mesh: TriangleMesh,
    rule: InsideRule,
    is_closed: bool,
    scale: f64,
    triangles: Vec<Triangle>,
}

impl BruteInside {
    /// `surface`: the faces to which distances refer.
    pub fn new(mesh: &TriangleMesh, rule: InsideRule, surface: impl Iterator<Item = u32>) -> Self {
        let scale = 1.0 / mesh.diagonal();
        let triangle = |f: u32| Triangle::new(mesh.triangle(f as usize).map(|p| p * scale));
        Self {
            triangles: surface.map(triangle).collect(),
            mesh: mesh.clone(),
            rule,
            is_closed: Topology::new(mesh.faces()).is_closed(),
            scale,
        }
    }

    pub fn of_all(mesh: &TriangleMesh, rule: InsideRule) -> Self {
        Self::new(mesh, rule, 0..mesh.faces().len() as u32)
    }

    /// Distance to the nearest face.
    pub fn distance(&self, p: DVec3) -> f64 {
        let of = |t: &Triangle| t.closest(p * self.scale).distance;
        self.triangles.iter().map(of).fold(f64::INFINITY, f64::min) / self.scale
    }

    /// Sum of the solid angles of all faces / 4 pi.
    pub fn generalized(&self, p: DVec3) -> f64 {
        let angle = |f: usize| {
            // A face without area has no solid angle, which rounding would not tell beside it.
            let side = perturbed_orientation(self.mesh.triangle(f), p);
            let [a, b, c] = self.mesh.triangle(f).map(|v| (v - p) * self.scale);
            let (la, lb, lc) = (a.length(), b.length(), c.length());
            let cosine = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            2.0 * f64::from(side) * a.dot(b.cross(c)).abs().atan2(cosine)
        };
        (0..self.mesh.faces().len()).map(angle).sum::<f64>() / (4.0 * PI)
    }

    /// Whether a point is inside of the faces; `None` within 1e-7 of the jump of an open mesh.
    pub fn is_inside(&self, p: DVec3) -> Option<bool> {
        match self.rule {
            InsideRule::Sheet { .. } => Some(false),
            InsideRule::Generalized if !self.is_closed => {
                let beyond = self.generalized(p).abs() - 0.5;
                (beyond.abs() > 1e-7).then_some(beyond > 0.0)
            }
            rule => Some(rule.holds(WindingNumber::brute_force(&self.mesh, p))),
        }
    }

    /// The error of an answer: of the distance where the side is not certain or the surface is nearer
    /// than `near`.
    pub fn error(&self, p: DVec3, answer: f64, near: f64) -> f64 {
        let distance = self.distance(p);
        let half = self.rule.half_thickness();
        match self.is_inside(p) {
            Some(inside) if distance > near => {
                (answer - if inside { -distance } else { distance - half }).abs()
            }
            _ => ((answer + half).abs() - distance).abs(),
        }
    }
}
