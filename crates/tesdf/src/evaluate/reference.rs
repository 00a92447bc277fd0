use glam::DVec3;

use crate::geometry::{Aabb, AabbTree};
use crate::mesh::{MeshError, TriangleMesh, WindingNumber};
use crate::verify::brute_force::BruteForce;

/// The exact signed distance of a mesh, from a tree over all faces, the triangle routine of brute
/// force, and winding numbers.
pub(super) struct Reference {
    /// Lengths are scaled by a power of two, so that squares stay within the range of `f64`.
    faces: BruteForce,
    tree: AabbTree,
    scale: f64,
    winding: WindingNumber,
}

/// Largest number of faces in a leaf.
const LEAF: usize = 4;
/// Relative rounding error allowed in bounds that come from the distance at a nearby point.
const ROUNDING: f64 = 1e-9;

impl Reference {
    pub fn new(mesh: &TriangleMesh) -> Result<Self, MeshError> {
        let scale = (-mesh.diagonal().log2().floor()).clamp(-1000.0, 1000.0).exp2();
        let vertices = mesh.vertices().iter().map(|&v| v * scale).collect();
        let scaled = TriangleMesh::new(vertices, mesh.faces().to_vec())?;
        let boxes: Vec<Aabb> =
            (0..mesh.faces().len()).map(|f| Aabb::of(&scaled.triangle(f)).grown(ROUNDING)).collect();
        Ok(Self {
            faces: BruteForce::new(&scaled, scaled.diagonal()),
            tree: AabbTree::build(&boxes, LEAF),
            scale,
            winding: WindingNumber::new(mesh),
        })
    }

    /// Begins a sequence of points. It is faster where each point is near the point before.
    pub fn walk(&self) -> Walk<'_> {
        Walk { reference: self, last: None }
    }

    /// The distance at `p`, which should be at most `limit`; `None` when no face is that near.
    /// Lengths are scaled.
    fn distance(&self, p: DVec3, limit: f64) -> Option<f64> {
        let squared = |face: u32| self.faces.offset(face as usize, p).length_squared();
        let (squared, _) = self.tree.nearest_within(p, limit * limit, squared)?;
        Some(squared.sqrt())
    }
}

pub(super) struct Walk<'a> {
    reference: &'a Reference,
    /// The previous point and its signed distance, scaled.
    last: Option<(DVec3, f64)>,
}

impl Walk<'_> {
    /// The signed distance at `p`, in the mesh's unit.
    pub fn signed_distance(&mut self, p: DVec3) -> f64 {
        let Reference { scale, winding, .. } = self.reference;
        let scaled = p * *scale;
        let limit = match self.last {
            // The distance changes by at most the length of the segment between the points.
            Some((q, d)) => (d.abs() + q.distance(scaled)) * (1.0 + ROUNDING),
            None => f64::INFINITY,
        };
        let distance = self
            .reference
            .distance(scaled, limit)
            .or_else(|| self.reference.distance(scaled, f64::INFINITY))
            .unwrap_or(f64::NAN);
        // A segment that is shorter than the distance at one of its ends does not meet the surface.
        let inside = match self.last {
            Some((q, d)) if q.distance(scaled) * (1.0 + ROUNDING) < distance.max(d.abs()) => d < 0.0,
            _ => winding.at_perturbed(p) >= 1,
        };
        let signed = if inside { -distance } else { distance };
        self.last = Some((scaled, signed));
        signed / scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{MeshFormat, read_bytes};

    #[test]
    fn the_tree_walk_equals_brute_force() {
        let obj = include_bytes!("../../../../data/procedural/l_bracket.obj");
        let mesh = read_bytes(obj, MeshFormat::Obj).unwrap().mesh;
        let (reference, all) = (Reference::new(&mesh).unwrap(), BruteForce::new(&mesh, mesh.diagonal()));
        let bounds = mesh.bounds();
        let mut signs = [0; 2];
        for row in 0..40 {
            let mut walk = reference.walk();
            let start = bounds.min - 0.1 * bounds.extent();
            let (y, z) = (f64::from(row % 7) / 6.0, f64::from(row) / 39.0);
            for x in 0..60 {
                // Every third row takes long steps.
                let x = if row % 3 == 0 { f64::from(x * 37 % 60) } else { f64::from(x) };
                let p = start + DVec3::new(x / 59.0, y, z) * 1.2 * bounds.extent();
                let d = walk.signed_distance(p);
                assert!((d.abs() - all.distance(p)).abs() <= 1e-14 * mesh.diagonal(), "{p}");
                if d != 0.0 {
                    let inside = WindingNumber::brute_force(&mesh, p) >= 1;
                    assert_eq!(d < 0.0, inside, "{p}");
                    signs[usize::from(inside)] += 1;
                }
            }
        }
        assert!(signs.iter().all(|&n| n > 200), "{signs:?}");
    }
}
