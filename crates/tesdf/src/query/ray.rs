use glam::DVec3;

use crate::TeSdf;
use crate::asset::layout::TreeChild;
use crate::geometry::{NearRay, orientation};

/// The first point at which a ray meets the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// Distance along the ray, in lengths of its direction.
    pub t: f64,
    /// The point, in the mesh's unit.
    pub point: DVec3,
    /// The face, by its id in the source mesh, 0-based. Among several faces at the same `t`, the
    /// lowest.
    pub face: u32,
    /// Outward unit normal of the face.
    pub normal: DVec3,
}

impl TeSdf {
    /// The first face that `origin + t · direction` meets for `t` in `[0, limit]`, from either
    /// side. In the mesh's unit. Rays through edges and corners hit: the side on which a ray passes
    /// an edge is decided exactly.
    ///
    /// `None` when the ray meets nothing, is not finite or has no direction, or when `t` would be
    /// above [`f64::MAX`].
    ///
    /// A ray that begins far out is first moved to where it comes near the body. That position is
    /// rounded to 1e-16 of the distance. So from about 1e16 diagonals on, only rays along an axis
    /// reliably hit what they aim at.
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::TeSdf;
    /// use tesdf::glam::DVec3;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let folder = tempfile::tempdir()?;
    /// # let path = folder.path().join("part.obj");
    /// # std::fs::write(&path, "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n")?;
    /// let asset = TeSdf::encode_file(&path)?;
    /// let origin = DVec3::new(-2.0, 0.2, 0.2);
    /// let hit = asset.ray_cast(origin, DVec3::X, f64::INFINITY).ok_or("nothing")?;
    /// assert!((hit.t - 2.0).abs() < 1e-12 && hit.normal.distance(DVec3::NEG_X) < 1e-12);
    /// # Ok(())
    /// # }
    /// ```
    pub fn ray_cast(&self, origin: DVec3, direction: DVec3, limit: f64) -> Option<RayHit> {
        let valid = origin.is_finite() && direction.is_finite() && direction != DVec3::ZERO && limit >= 0.0;
        if !valid {
            return None;
        }
        // Half of the body's diagonal is at most half a unit of the local frame.
        let ray = NearRay::new(origin, direction, self.bounds().center(), self.frame.inverse_scale())?;
        let hit = self.near_ray_cast(ray.origin, ray.direction, ray.rest_of(limit))?;
        Some(RayHit { t: ray.total(hit.t)?, ..hit })
    }

    /// As [`ray_cast`](Self::ray_cast), for an origin near the body and a direction of length 1 to
    /// 4.
    fn near_ray_cast(&self, origin: DVec3, direction: DVec3, limit: f64) -> Option<RayHit> {
        let from = self.frame.to_local(origin);
        // The local frame scales distances and keeps the direction.
        let (along, limit) = (direction, limit * self.frame.scale);
        let relative = from - self.cube.middle();
        let mut best: Option<(f64, u32, u32)> = None;
        let mut stack = vec![(0.0, TreeChild::Node(0))];
        while let Some((enter, child)) = stack.pop() {
            let reach = best.map_or(limit, |b| b.0);
            if enter > reach {
                continue;
            }
            match child {
                TreeChild::Node(n) => {
                    let (boxes, words) = (&self.tree_boxes[n as usize], self.tree_children[n as usize]);
                    let met = [0, 1].map(|side| {
                        let enter = enters_box(relative, along, reach, &boxes[6 * side..6 * side + 6])?;
                        Some((enter, TreeChild::decode(words[side])))
                    });
                    // The nearer child is visited first: a hit in it often ends the search of the
                    // other child.
                    match met {
                        [Some(a), Some(b)] if a.0 <= b.0 => stack.extend([b, a]),
                        _ => stack.extend(met.into_iter().flatten()),
                    }
                }
                TreeChild::Leaf(start, count) => {
                    for position in start..start + count {
                        let corners = self.local_triangle(position as usize).corners;
                        let Some(t) = meets_face(from, along, corners).filter(|&t| t <= limit) else {
                            continue;
                        };
                        let id = self.face_ids[position as usize];
                        if best.is_none_or(|(b, i, _)| t < b || (t == b && id < i)) {
                            best = Some((t, id, position));
                        }
                    }
                }
            }
        }
        best.map(|(t, face, position)| {
            let t = t * self.frame.inverse_scale();
            let normal = self.local_triangle(position as usize).normal;
            RayHit { t, point: origin + t * direction, face, normal }
        })
    }
}

/// Lower bound of the parameter where the ray enters the box; `None` when it misses. A slab test,
/// widened by more than its rounding.
fn enters_box(from: DVec3, along: DVec3, limit: f64, b: &[f32]) -> Option<f64> {
    let (mut enter, mut leave) = (0.0f64, limit);
    for a in 0..3 {
        let (low, high) = (f64::from(b[a]) - from[a], f64::from(b[a + 3]) - from[a]);
        if along[a] == 0.0 {
            if low > 0.0 || high < 0.0 {
                return None;
            }
            continue;
        }
        let (s, t) = (low / along[a], high / along[a]);
        enter = enter.max(s.min(t));
        leave = leave.min(s.max(t));
    }
    let enter = enter * (1.0 - 1e-12);
    (enter <= leave * (1.0 + 1e-12)).then_some(enter)
}

fn meets_face(from: DVec3, along: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
    let normal = (b - a).cross(c - a);
    let slope = normal.dot(along);
    let t = normal.dot(a - from) / slope;
    if slope == 0.0 || t.is_nan() || t < 0.0 {
        return None;
    }
    // Signs of the volumes that the ray's line spans with the edges. They are exact for the rounded
    // second point.
    let to = from + along;
    let sides = [orientation(from, to, a, b), orientation(from, to, b, c), orientation(from, to, c, a)];
    let one_side = sides.iter().all(|&s| s >= 0) || sides.iter().all(|&s| s <= 0);
    one_side.then_some(t)
}
