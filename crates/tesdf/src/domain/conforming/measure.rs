//! Checks of the whole: the volume, and that the outer boundary does not meet itself.
use std::collections::HashMap;

use glam::DVec3;

use super::{ConformingError, triangles::Triangle, weld::Welded};
use crate::mesh::{Defect, DefectKind, MeshError, Severity, SolidMesh, TriangleMesh, check};

/// Largest difference of the volumes inside, relative to the volume.
const VOLUME_TOLERANCE: f64 = 1e-9;

/// Rounding of a compensated sum, relative to the sum of absolute values: some units in the last
/// place of each term.
const ROUNDING: f64 = 1e-15;

/// A sum with the bits that rounding drops (Neumaier), and the sum of the absolute values.
#[derive(Default)]
struct Sum {
    sum: f64,
    lost: f64,
    absolute: f64,
}

impl Sum {
    fn add(&mut self, x: f64) {
        let sum = self.sum + x;
        self.lost += if self.sum.abs() >= x.abs() { (self.sum - sum) + x } else { (x - sum) + self.sum };
        self.sum = sum;
        self.absolute += x.abs();
    }

    fn value(&self) -> f64 {
        self.sum + self.lost
    }
}

/// Whether the tetrahedra have the volume that the surface encloses, when each counts as often as
/// its winding number says.
pub(super) fn volumes_agree(
    solid: &SolidMesh,
    welded: &Welded,
    windings: &[i32],
) -> Result<(), ConformingError> {
    let volume = |[a, b, c, d]: [DVec3; 4]| (b - a).cross(c - a).dot(d - a) / 6.0;
    let mut inside = Sum::default();
    for (t, &winding) in windings.iter().enumerate().filter(|&(_, &w)| w != 0) {
        inside.add(f64::from(winding) * volume(welded.corners(t)));
    }
    let mesh = solid.mesh();
    let center = mesh.bounds().center();
    let mut surface = Sum::default();
    for face in 0..mesh.faces().len() {
        let [a, b, c] = mesh.triangle(face);
        surface.add(volume([center, a, b, c]));
    }
    let within = VOLUME_TOLERANCE * surface.value().abs() + ROUNDING * (surface.absolute + inside.absolute);
    let (inside, surface) = (inside.value(), surface.value());
    // The comparison is not `>`, because an overflow to NaN must not pass.
    if (inside - surface).abs() <= within { Ok(()) } else { Err(ConformingError::Volume { inside, surface }) }
}

/// The outer boundary as a mesh. Its faces are the triangles, in the same order.
fn boundary(outer: &[&Triangle], vertices: &[DVec3]) -> Result<TriangleMesh, MeshError> {
    let mut ids = HashMap::new();
    let mut positions = Vec::new();
    let mut id = |v: u32| {
        *ids.entry(v).or_insert_with(|| {
            positions.push(vertices[v as usize]);
            positions.len() as u32 - 1
        })
    };
    let faces = outer.iter().filter_map(|t| t.outward()).map(|corners| corners.map(&mut id)).collect();
    TriangleMesh::new(positions, faces)
}

/// Whether the outer boundary does not meet itself, and goes around no place twice.
pub(super) fn is_embedded(
    solid: &SolidMesh,
    welded: &Welded,
    triangles: &[Triangle],
) -> Result<(), ConformingError> {
    let outer: Vec<&Triangle> = triangles.iter().filter(|t| t.outward().is_some()).collect();
    if solid.is_simple()
        && outer.len() == solid.mesh().faces().len()
        && outer.iter().all(|t| t.face.is_some())
    {
        // The outer boundary is the surface, which the check of the solid has checked already.
        return Ok(());
    }
    let refused = |found: String, position| Err(ConformingError::Overlap { found, position });
    let boundary = match boundary(&outer, &welded.vertices) {
        Ok(boundary) => boundary,
        Err(error) => return refused(error.to_string(), welded.vertices[0]),
    };
    let report = check(&boundary);
    let bad = |d: &&Defect| {
        d.severity == Severity::Error
            || matches!(d.kind, DefectKind::SelfIntersection | DefectKind::WindingAboveOne)
    };
    match report.defects.iter().find(bad) {
        // The ids of the faces of the boundary mean nothing to a user. Those of tetrahedra do.
        Some(defect) => {
            let of = |&f: &u32| outer[f as usize].sides.iter().flatten().next().copied();
            let tetrahedra: Vec<String> =
                defect.faces.iter().filter_map(of).take(2).map(|t| t.to_string()).collect();
            let found = match defect.kind {
                DefectKind::SelfIntersection => "it meets itself".to_owned(),
                DefectKind::WindingAboveOne => "it goes around a place twice".to_owned(),
                _ => defect.message.clone(),
            };
            refused(
                format!("{found}, at sides of tetrahedra {}", tetrahedra.join(" and ")),
                defect.place.into(),
            )
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{domain::TetMesh, domain::conforming::weld::weld};

    /// The labels guarantee the volume, so only the sum itself can be tested. It counts each
    /// tetrahedron by its winding number.
    #[test]
    fn volumes_are_weighted_by_winding_numbers() {
        let vertices = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let solid = SolidMesh::new(TriangleMesh::new(vertices.clone(), faces).unwrap()).unwrap();
        let welded = weld(&solid, &TetMesh::new(vertices, vec![[0, 1, 2, 3]]).unwrap()).unwrap();
        assert!(volumes_agree(&solid, &welded, &[1]).is_ok());
        for (winding, inside) in [(0, 0.0), (2, 2.0 / 6.0)] {
            let error = volumes_agree(&solid, &welded, &[winding]).unwrap_err();
            assert_eq!(error, ConformingError::Volume { inside, surface: 1.0 / 6.0 });
        }
    }

    #[test]
    fn sums_compensate_rounding_errors() {
        let mut sum = Sum::default();
        [1e16, 1.0, -1e16].into_iter().for_each(|x| sum.add(x));
        assert_eq!((sum.value(), sum.absolute), (1.0, 2e16 + 1.0));
    }
}
