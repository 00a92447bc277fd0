//! The side of a point by brute force, for every rule of what is inside.
use std::f64::consts::PI;

use glam::DVec3;

use crate::TeSdf;
use crate::base::InsideRule;
use crate::base::elementary;
use crate::geometry::perturbed_orientation;
use crate::mesh::{TriangleMesh, WindingNumber};
use crate::query::Answer;

/// What tells the side of a point by all faces of a mesh. It shares nothing with the encoder but
/// exact predicates.
pub(super) struct TrueSign {
    mesh: TriangleMesh,
    rule: InsideRule,
    /// Of a closed mesh.
    winding: Option<WindingNumber>,
}

/// Nearer than this to the number at which the side changes, a sum of solid angles does not tell
/// the side.
const UNSURE: f64 = 1e-6;

impl TrueSign {
    pub fn new(mesh: TriangleMesh, rule: InsideRule) -> Self {
        let is_closed = crate::mesh::Topology::new(mesh.faces()).is_closed();
        let counts = is_closed && !matches!(rule, InsideRule::Sheet { .. });
        let winding = counts.then(|| WindingNumber::new(&mesh));
        Self { mesh, rule, winding }
    }

    /// Whether a point is inside: always `false` for a sheet, whose faces have no inside. `None`
    /// where rounding decides.
    pub fn is_inside(&self, p: DVec3) -> Option<bool> {
        match (&self.winding, self.rule) {
            (Some(winding), rule) => Some(rule.holds(winding.at_perturbed(p))),
            (None, InsideRule::Sheet { .. }) => Some(false),
            (None, _) => {
                let beyond = generalized(&self.mesh, p).abs() - 0.5;
                (beyond.abs() > UNSURE).then_some(beyond > 0.0)
            }
        }
    }

    /// Whether the winding number differs from that without a tree.
    pub fn disagrees(&self, p: DVec3) -> bool {
        let number = |winding: &WindingNumber| winding.at_perturbed(p);
        self.winding.as_ref().is_some_and(|w| number(w) != WindingNumber::brute_force(&self.mesh, p))
    }
}

/// The generalised winding number: the sum of the solid angles of all faces, divided by 4 pi.
fn generalized(mesh: &TriangleMesh, p: DVec3) -> f64 {
    let scale = 1.0 / mesh.diagonal();
    let angle = |f: usize| {
        // A face without area has no solid angle, which rounding would not tell beside it.
        let side = f64::from(perturbed_orientation(mesh.triangle(f), p));
        let [a, b, c] = mesh.triangle(f).map(|v| (v - p) * scale);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let cosine = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * side * elementary::atan2(a.dot(b.cross(c)).abs(), cosine)
    };
    (0..mesh.faces().len()).map(angle).sum::<f64>() / (4.0 * PI)
}

/// A distance with its sign; with that of the answer where the side is not known.
pub(super) fn signed(distance: f64, inside: Option<bool>, answer: &Answer) -> f64 {
    let inside = inside.unwrap_or(answer.signed_distance < 0.0);
    if inside { -distance } else { distance }
}

/// The answer with the distance to the faces: that of a sheet without its thickness.
pub(super) fn unshifted(asset: &TeSdf, answer: Answer) -> Answer {
    let half = asset.inside().rule.half_thickness();
    Answer { signed_distance: answer.signed_distance + half, ..answer }
}
