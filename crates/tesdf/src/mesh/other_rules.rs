//! The rules of what is inside that take a refused mesh as it is.
use super::{CheckReport, DefectKind, Topology, TriangleMesh};
use crate::base::InsideRule;
use crate::geometry::GeneralizedWinding;

/// The rules under which a mesh can be encoded as it is, although it is refused under
/// [`InsideRule::Winding`], the most likely one first. `report` is what [`check`](super::check())
/// says of the mesh.
///
/// - [`Nonzero`](InsideRule::Nonzero) for a closed mesh, unless its winding number is 0 everywhere.
/// - [`Generalized`](InsideRule::Generalized) for an open mesh that has an inside by it. This is
///   tried: a flat sheet, or a single triangle, has none, and all distances would be positive.
///   Points in front of and behind faces are tried, because the number, as a harmonic function, is
///   greatest at the surface. They are a thousandth of the diagonal away, so an inside that is
///   thinner than that does not count.
/// - [`Sheet`](InsideRule::Sheet) for any mesh, with a thickness of 1 % of the diagonal, rounded
///   down to one digit. The true thickness is not known: take that of the part.
///
/// Without a rule when a coordinate is out of range.
pub fn other_rules(mesh: &TriangleMesh, report: &CheckReport) -> Vec<InsideRule> {
    if report.defects.iter().any(|defect| defect.kind == DefectKind::OutOfRange) {
        return Vec::new();
    }
    let first = match report.winding {
        Some([0, 0]) => None,
        Some(_) => Some(InsideRule::Nonzero),
        None if Topology::new(mesh.faces()).is_closed() => Some(InsideRule::Nonzero),
        None => encloses(mesh, report.diagonal).then_some(InsideRule::Generalized),
    };
    let sheet = InsideRule::Sheet { thickness: one_digit(THICKNESS * report.diagonal) };
    first.into_iter().chain([sheet]).collect()
}

/// The thickness of a sheet, relative to the diagonal.
const THICKNESS: f64 = 0.01;

/// The distance of the tried points from their faces, relative to the diagonal.
const DEPTH: f64 = 1e-3;

/// Largest number of faces at which points are tried, and of solid angles that are computed for it:
/// some two seconds of a processor.
const MAX_TRIED: [usize; 2] = [4096, 20_000_000];

/// Whether the generalised winding number is beyond 1/2 somewhere, for certain, at a depth that
/// matters.
fn encloses(mesh: &TriangleMesh, diagonal: f64) -> bool {
    let faces = mesh.faces().len();
    let winding = GeneralizedWinding::new(mesh.faces(), |v| mesh.vertices()[v as usize]);
    let by_work = MAX_TRIED[1] / winding.angles_per_point().max(1);
    // Evenly chosen, and a few at least.
    let tried = faces.min(MAX_TRIED[0]).min(by_work.max(16));
    (0..tried).map(|k| k * faces / tried).any(|face| {
        let [a, b, c] = mesh.triangle(face);
        let Some(normal) = (b - a).cross(c - a).try_normalize() else { return false };
        let center = (a + b + c) / 3.0;
        [-DEPTH, DEPTH].into_iter().any(|depth| {
            let found = winding.at(center + depth * diagonal * normal);
            found.value.abs() - found.error > 0.5
        })
    })
}

/// Rounds a positive number down to one digit.
fn one_digit(length: f64) -> f64 {
    let text = format!("{length:e}");
    let parts = text.split_once('e').and_then(|(digits, exponent)| Some((digits.get(..1)?, exponent)));
    parts.and_then(|(digit, exponent)| format!("{digit}e{exponent}").parse().ok()).unwrap_or(length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_rounded_down_to_one_digit() {
        for (length, expected) in [
            (0.0141, 0.01),
            (0.0199, 0.01),
            (9.99, 9.0),
            (3.0, 3.0),
            (1.0, 1.0),
            (1.6e-20, 1e-20),
            (0.0, 0.0),
        ] {
            assert_eq!(one_digit(length), expected);
        }
    }
}
