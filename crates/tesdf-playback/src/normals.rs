//! Shading normals that make round surfaces look smooth and keep sharp edges.
use tesdf::TeSdf;
use tesdf::glam::{DVec3, Vec3};

/// Cosine of the crease angle, 20°: faces that meet at a larger angle have a sharp edge. A circle
/// of 24 facets is smooth, the chamfer of a nut is not.
const CREASE: f64 = 0.94;

/// For each face, by its id in the source mesh: its corners in the mesh's unit, and a unit normal
/// at each corner.
pub struct SmoothNormals(Vec<([DVec3; 3], [Vec3; 3])>);

impl SmoothNormals {
    /// Computes the normals of all corners. The normal at a corner is the sum of the normals of the
    /// faces around its vertex that are within the crease angle, weighted by their angle at the
    /// vertex.
    pub fn new(asset: &TeSdf) -> Self {
        let faces: Vec<_> = (0..asset.face_count())
            .map(|position| {
                let corners @ [a, b, c] = asset.face_corners(position);
                (corners, (b - a).cross(c - a).normalize_or_zero())
            })
            .collect();
        let mut around: Vec<(u32, u32)> = (0..faces.len())
            .flat_map(|position| asset.face_vertices(position).map(|vertex| (vertex, position as u32)))
            .collect();
        around.sort_unstable();
        let mut smooth = vec![([DVec3::ZERO; 3], [Vec3::ZERO; 3]); faces.len()];
        for (position, (corners, normal)) in faces.iter().enumerate() {
            let normals = asset.face_vertices(position).map(|vertex| {
                let first = around.partition_point(|&(v, _)| v < vertex);
                let held = around[first..].iter().take_while(|&&(v, _)| v == vertex);
                let sum: DVec3 = held
                    .map(|&(_, other)| other as usize)
                    .filter(|&other| faces[other].1.dot(*normal) > CREASE)
                    .map(|other| {
                        let at = asset.face_vertices(other).iter().position(|&v| v == vertex).unwrap_or(0);
                        let [p, q, r] = [0, 1, 2].map(|k| faces[other].0[(at + k) % 3]);
                        let angle = (q - p).angle_between(r - p);
                        faces[other].1 * if angle.is_finite() { angle } else { 0.0 }
                    })
                    .sum();
                sum.try_normalize().unwrap_or(*normal).as_vec3()
            });
            if let Some(place) = smooth.get_mut(asset.face_id(position) as usize) {
                *place = (*corners, normals);
            }
        }
        Self(smooth)
    }

    /// The corners of a face, by its id in the source mesh, in the mesh's unit, and the unit
    /// normals there. `None` for a face that does not exist or has no area.
    pub fn corners(&self, face: u32) -> Option<([DVec3; 3], [Vec3; 3])> {
        self.0.get(face as usize).copied().filter(|(_, normals)| normals.iter().all(|n| n.is_normalized()))
    }

    /// The normal at point `p` of a face, in the mesh's unit. `None` for a face that does not exist
    /// or has no area.
    pub fn at(&self, face: u32, p: DVec3) -> Option<DVec3> {
        let ([a, b, c], normals) = self.0.get(face as usize)?;
        let full = (b - a).cross(c - a);
        let share = |q: DVec3, r: DVec3| (q - p).cross(r - p).dot(full);
        let weights = [share(*b, *c), share(*c, *a), share(*a, *b)];
        normals.iter().zip(weights).map(|(n, w)| n.as_dvec3() * w.max(0.0)).sum::<DVec3>().try_normalize()
    }
}
