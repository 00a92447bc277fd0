//! Signed distance, closest point, gradient, closest face; occupancy and rays.
//!
//! A query maps the point to the local frame and finds its cell by descending the forest in fixed
//! point. The answer is the least distance to the faces of the cell's list. Points without a list
//! (outside the domain or in a far cell) are answered by the tree over all faces, also exactly.
//!
//! | | exact | `f32` storage | chosen at run time |
//! |---|---|---|---|
//! | point | [`query`] | [`query_f32`] | [`query_with`] |
//! | only its signed distance | [`signed_distance`] | [`signed_distance_f32`] | |
//! | in the domain | [`query_in_domain`] | [`query_in_domain_f32`] | [`query_in_domain_with`] |
//! | many points | [`query_batch`] | [`query_batch_f32`] | [`query_batch_with`] |
//! | many points, into arrays | | | [`query_batch_into`], [`signed_distances_into`] |
//! | point, without lists | [`query_by_tree`] | [`query_by_tree_f32`] | [`query_by_tree_with`] |
//!
//! [`is_inside`] and [`ray_cast`] are exact.
//!
//! [`is_inside`]: TeSdf::is_inside
//! [`query`]: TeSdf::query
//! [`query_batch`]: TeSdf::query_batch
//! [`query_batch_f32`]: TeSdf::query_batch_f32
//! [`query_batch_into`]: TeSdf::query_batch_into
//! [`query_batch_with`]: TeSdf::query_batch_with
//! [`query_by_tree`]: TeSdf::query_by_tree
//! [`query_by_tree_f32`]: TeSdf::query_by_tree_f32
//! [`query_by_tree_with`]: TeSdf::query_by_tree_with
//! [`query_f32`]: TeSdf::query_f32
//! [`query_in_domain`]: TeSdf::query_in_domain
//! [`query_in_domain_f32`]: TeSdf::query_in_domain_f32
//! [`query_in_domain_with`]: TeSdf::query_in_domain_with
//! [`query_with`]: TeSdf::query_with
//! [`ray_cast`]: TeSdf::ray_cast
//! [`signed_distance`]: TeSdf::signed_distance
//! [`signed_distance_f32`]: TeSdf::signed_distance_f32
//! [`signed_distances_into`]: TeSdf::signed_distances_into
mod arrays;
mod batch;
mod by_tree;
mod cell_bounds;
mod far_points;
mod inner_ball;
mod kernel;
mod lanes;
mod locate;
mod nearest;
mod polygon;
mod ray;
mod sign;
#[cfg(feature = "collide")]
mod surroundings;

/// Constants that the kernels of `tesdf-gpu` share with this crate, and what its laboratory reads. Not
/// part of the API.
#[doc(hidden)]
pub mod internal {
    use glam::DVec3;

    use super::Place;
    use crate::TeSdf;

    pub use super::kernel::PART;
    pub use super::polygon::ROUNDING as POLYGON_ROUNDING;
    /// Below this distance, the gradient is the normal of the nearest face.
    pub const ON_SURFACE: f64 = super::ON_SURFACE_F32;

    /// The cell of a point, by its [id](crate::asset::CellView::id), and whether the cell has a list. `None`
    /// outside the domain.
    pub fn cell_at(asset: &TeSdf, point: DVec3) -> Option<(u32, bool)> {
        let (place, word) = asset.locate_with_word(asset.frame.to_local(point));
        match place {
            Place::NotOfDomain => None,
            Place::Listed { .. } => Some((word as u32, true)),
            Place::Far(_) => Some((word as u32, false)),
        }
    }
}

use std::cell::RefCell;

use glam::DVec3;

pub use arrays::{Arrays, SignArrays};
pub use batch::{AnswerColumns, BatchError, Extent};
pub(crate) use inner_ball::corner_reach;
pub(crate) use locate::{Faces, Place};
pub use nearest::Reads;
pub(crate) use polygon::MAX_POINTS;
pub use ray::RayHit;
#[cfg(feature = "collide")]
pub(crate) use surroundings::Surroundings;

use crate::TeSdf;
use crate::base::Side;
use crate::base::elementary;
use crate::geometry::{Closest, Feature};
use far_points::is_near;
pub(crate) use sign::Facing;
use sign::hinted_side;

/// The arithmetic of a query, for code that chooses it at run time with [`TeSdf::query_with`] and
/// similar methods. Other code calls [`TeSdf::query`] (`F64`) or [`TeSdf::query_f32`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// Faces rounded to `f32` in a local frame, several at a time. Distances are within 1e-6 ×
    /// diagonal, and the sign is right beyond that distance. Gradients are within 1e-3 rad from
    /// 1e-4 × diagonal on. Where faces have a height below 1e-6 × diagonal, gradients have an
    /// additional error of that length divided by the distance.
    F32,
    /// Faces as they are in the mesh. Distances are within 1e-12 × diagonal plus 4 ulp of the
    /// largest coordinate, and signs come from exact predicates. Gradients are within 1e-3 rad from
    /// 1e-9 × diagonal on.
    F64,
}

crate::named!(Precision {
    F64: "f64", "Faces as they are in the mesh";
    F32: "f32", "Faces rounded to 32 bits";
});

/// The answer to a query, in the mesh's unit and frame.
///
/// A point with a NaN or infinite coordinate has no answer: the numbers are NaN, and the face is
/// [`NO_FACE`](Self::NO_FACE). Every other point has an answer, however far out it is. A distance
/// above [`f64::MAX`] is reported as [`f64::MAX`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Distance to the nearest face, negative inside.
    pub signed_distance: f64,
    /// Unit gradient of the signed distance. It points outward.
    pub gradient: DVec3,
    /// The nearest point of the surface.
    pub closest_point: DVec3,
    /// The nearest face, by its id in the source mesh, 0-based. Among faces of the cell's list at
    /// equal distance, the lowest.
    pub face: u32,
}

impl Answer {
    /// The face of a point without an answer.
    pub const NO_FACE: u32 = u32::MAX;

    const NONE: Self = Self {
        signed_distance: f64::NAN,
        gradient: DVec3::NAN,
        closest_point: DVec3::NAN,
        face: Self::NO_FACE,
    };
}

/// An answer in the local frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalAnswer {
    /// Distance to the nearest face, negative inside.
    pub signed_distance: f64,
    /// Unit gradient.
    pub gradient: DVec3,
    /// The nearest point of the surface.
    pub closest_point: DVec3,
    /// The nearest face, by its index among the asset's faces.
    pub position: u32,
    /// The feature of this face on which the nearest point lies.
    pub feature: Feature,
}

/// Below this distance (local frame), the gradient is the normal of the closest feature.
///
/// The diagonal is 0.5 to 1 in this frame, so this is at most 1e-9 × diagonal. From there on the
/// gradient belongs to the point.
pub(crate) const ON_SURFACE_F64: f64 = 5e-10;
/// The same for `f32` storage: about ten times its rounding.
const ON_SURFACE_F32: f64 = 1e-6;
/// Faces that share an edge are at most this far from a point of the edge.
const TOUCHING: f64 = 1e-12;

impl TeSdf {
    /// Answers any point exactly ([`Precision::F64`]). `point` and the answer are in the mesh's
    /// unit and frame.
    ///
    /// This cannot fail: the answer at a point that is not finite is NaN with [`Answer::NO_FACE`].
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::glam::DVec3;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # use tesdf::{Encoder, SolidMesh, mesh::MeshFormat, mesh::read_bytes};
    /// # let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    /// # let solid = SolidMesh::new(read_bytes(obj.as_bytes(), MeshFormat::Obj)?.mesh)?;
    /// # let asset = Encoder::new().encode(&solid)?;
    /// let answer = asset.query(DVec3::new(0.1, 0.3, 0.3));
    /// assert!((answer.signed_distance + 0.1).abs() < 1e-12); // 0.1 inside of the side x = 0
    /// assert!(answer.closest_point.distance(DVec3::new(0.0, 0.3, 0.3)) < 1e-12);
    /// assert!(answer.gradient.distance(DVec3::NEG_X) < 1e-12);
    /// assert_eq!(answer.face, 3);
    /// # Ok(())
    /// # }
    /// ```
    pub fn query(&self, point: DVec3) -> Answer {
        self.query_with(point, Precision::F64)
    }

    /// As [`query`](Self::query), in `f32`: several faces at a time, within 1e-6 of the mesh's
    /// diagonal ([`Precision::F32`]).
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::glam::DVec3;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # use tesdf::{Encoder, SolidMesh, mesh::MeshFormat, mesh::read_bytes};
    /// # let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    /// # let solid = SolidMesh::new(read_bytes(obj.as_bytes(), MeshFormat::Obj)?.mesh)?;
    /// # let asset = Encoder::new().encode(&solid)?;
    /// let answer = asset.query_f32(DVec3::new(0.1, 0.3, 0.3));
    /// assert!((answer.signed_distance + 0.1).abs() < 1e-6);
    /// # Ok(())
    /// # }
    /// ```
    pub fn query_f32(&self, point: DVec3) -> Answer {
        self.query_with(point, Precision::F32)
    }

    /// As [`query`](Self::query) or [`query_f32`](Self::query_f32), chosen at run time.
    pub fn query_with(&self, point: DVec3, precision: Precision) -> Answer {
        let local = self.frame.to_local(point);
        self.answer_alone(point, local, self.locate(local), precision)
    }

    /// As [`query`](Self::query), but `None` outside the domain. The domain covers the band around
    /// the solid up to about one cell, except where no list was worth its bytes.
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::glam::DVec3;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # use tesdf::{Encoder, SolidMesh, mesh::MeshFormat, mesh::read_bytes};
    /// # let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    /// # let solid = SolidMesh::new(read_bytes(obj.as_bytes(), MeshFormat::Obj)?.mesh)?;
    /// # let asset = Encoder::new().encode(&solid)?;
    /// assert!(asset.query_in_domain(DVec3::new(0.1, 0.3, 0.3)).is_some());
    /// assert!(asset.query_in_domain(DVec3::new(9.0, 0.3, 0.3)).is_none());
    /// # Ok(())
    /// # }
    /// ```
    pub fn query_in_domain(&self, point: DVec3) -> Option<Answer> {
        self.query_in_domain_with(point, Precision::F64)
    }

    /// As [`query_in_domain`](Self::query_in_domain), in `f32`.
    pub fn query_in_domain_f32(&self, point: DVec3) -> Option<Answer> {
        self.query_in_domain_with(point, Precision::F32)
    }

    /// As [`query_in_domain`](Self::query_in_domain) or
    /// [`query_in_domain_f32`](Self::query_in_domain_f32), chosen at run time.
    pub fn query_in_domain_with(&self, point: DVec3, precision: Precision) -> Option<Answer> {
        let local = self.frame.to_local(point);
        match self.locate(local) {
            Place::NotOfDomain => None,
            place => Some(self.answer_alone(point, local, place, precision)),
        }
    }

    /// Only the signed distance, exact: negative inside, in the mesh's unit; NaN for a point that
    /// is not finite.
    ///
    /// # Example
    ///
    /// ```
    /// use tesdf::glam::DVec3;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # use tesdf::{Encoder, SolidMesh, mesh::MeshFormat, mesh::read_bytes};
    /// # let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n";
    /// # let solid = SolidMesh::new(read_bytes(obj.as_bytes(), MeshFormat::Obj)?.mesh)?;
    /// # let asset = Encoder::new().encode(&solid)?;
    /// assert!((asset.signed_distance(DVec3::new(-2.0, 0.3, 0.3)) - 2.0).abs() < 1e-12);
    /// assert!((asset.signed_distance_f32(DVec3::new(-2.0, 0.3, 0.3)) - 2.0).abs() < 1e-6);
    /// # Ok(())
    /// # }
    /// ```
    pub fn signed_distance(&self, point: DVec3) -> f64 {
        self.query(point).signed_distance
    }

    /// As [`signed_distance`](Self::signed_distance), in `f32`: within 1e-6 of the mesh's diagonal.
    pub fn signed_distance_f32(&self, point: DVec3) -> f64 {
        self.query_f32(point).signed_distance
    }

    /// Whether `point` is inside by the rule of the asset ([`inside`](Self::inside)), by exact
    /// predicates. Points on the surface may count as either; points that are not finite are
    /// outside.
    ///
    /// For a sheet, and where the generalised winding number of an open mesh is 1/2, this is exact
    /// up to rounding.
    pub fn is_inside(&self, point: DVec3) -> bool {
        if self.half_thickness > 0.0 {
            return self.signed_distance(point) < 0.0;
        }
        let local = self.frame.to_local(point);
        local.is_finite() && self.side_at(local, self.locate(local)) == Side::Inside
    }

    /// The side of a finite point of a place, by winding number where the place does not tell it.
    fn side_at(&self, local: DVec3, place: Place) -> Side {
        self.side_of_place(place).unwrap_or_else(|| self.exact_side(local))
    }

    /// Number of faces and nodes that a query at `point` reads, in `f32`.
    pub fn reads(&self, point: DVec3) -> Reads {
        let local = self.frame.to_local(point);
        let mut reads = Reads::default();
        if let Place::Listed { offset, .. } = self.locate(local) {
            let mut faces = Faces::default();
            self.read_list(offset, &mut faces);
            reads.list_entries = faces.ids().len();
        } else {
            self.nearest_in_tree_f32((local - self.cube.middle()).as_vec3(), &mut reads);
        }
        reads
    }

    #[inline]
    fn answer_alone(&self, point: DVec3, local: DVec3, place: Place, precision: Precision) -> Answer {
        thread_local! {
            static FACES: RefCell<Faces> = RefCell::default();
        }
        if !is_near(local) {
            return self.answer_far(point);
        }
        FACES.with_borrow_mut(|faces| {
            if let Place::Listed { offset, .. } = place {
                self.read_list(offset, faces);
                // All of them at once: otherwise those of the second chunk would wait for the
                // first.
                self.fetch_faces(faces);
            }
            self.to_answer(self.find(local, place, faces, precision))
        })
    }

    /// Passes the faces of the list at `offset` to `f`. The list is read once for many points.
    pub(crate) fn with_list<R>(&self, offset: u32, f: impl FnOnce(&Faces) -> R) -> R {
        thread_local! {
            static FACES: RefCell<Vec<Faces>> = const { RefCell::new(Vec::new()) };
        }
        // The buffer is taken out of the pool, because `f` may read another list.
        let mut faces = FACES.with_borrow_mut(Vec::pop).unwrap_or_default();
        self.read_list(offset, &mut faces);
        let result = f(&faces);
        FACES.with_borrow_mut(|free| free.push(faces));
        result
    }

    /// The answer at a finite point of the local frame whose place is known.
    pub(crate) fn found_at(&self, local: DVec3, place: Place, precision: Precision) -> LocalAnswer {
        match place {
            Place::Listed { offset, .. } => {
                self.with_list(offset, |faces| self.find(local, place, faces, precision))
            }
            _ => self.find(local, place, &Faces::default(), precision),
        }
    }

    /// As [`found_at`](Self::found_at) in `f32`, but with the exact distance also where lists are
    /// not proved exact.
    pub(crate) fn found_exactly(&self, local: DVec3) -> LocalAnswer {
        let place = self.locate(local);
        match place {
            Place::Listed { .. } if !self.has_exact_lists() => {
                self.found_at(local, Place::Far(self.side_at(local, place)), Precision::F32)
            }
            _ => self.found_at(local, place, Precision::F32),
        }
    }

    /// The answer at a point of the local frame that is finite and not far. `faces` are those of
    /// the place's list, if it has one.
    #[inline(always)]
    pub(crate) fn find(
        &self,
        local: DVec3,
        place: Place,
        faces: &Faces,
        precision: Precision,
    ) -> LocalAnswer {
        match precision {
            Precision::F32 => self.answer_f32(local, place, faces),
            Precision::F64 => {
                self.store_normals_unless_moved();
                self.answer_f64(local, place, faces)
            }
        }
    }

    /// Converts from the local frame to the mesh's frame.
    #[inline(always)]
    fn to_answer(&self, found: LocalAnswer) -> Answer {
        // Half of the thickness is 0 unless the asset is a sheet.
        let half = self.half_thickness;
        Answer {
            signed_distance: (found.signed_distance - half) * self.frame.inverse_scale(),
            gradient: found.gradient,
            closest_point: self.frame.to_world(found.closest_point + half * found.gradient),
            face: self.face_ids[found.position as usize],
        }
    }

    #[inline(always)]
    fn answer_f32(&self, local: DVec3, place: Place, faces: &Faces) -> LocalAnswer {
        let relative = local - self.cube.middle();
        let found = match place {
            Place::Listed { .. } => self.nearest_in_list_f32(faces, relative.as_vec3()),
            // Far from the cube, f32 is too coarse relative to the body.
            _ if relative.abs().max_element() > 2.0 * self.cube.side() => {
                return self.answer_f64(local, place, faces);
            }
            _ => self.nearest_in_tree_f32(relative.as_vec3(), &mut Reads::default()),
        };
        // No face is found in f32 when coordinates of the file overflow.
        let Some(record) = self.records.get(found.face as usize) else {
            return self.answer_f64(local, place, faces);
        };
        let triangle = record.triangle();
        if triangle.normal == DVec3::ZERO {
            // A segment in `f32` may be a narrow face in `f64`. Its gradient would have an error of
            // the face's width divided by the distance.
            return self.answer_f64(local, place, faces);
        }
        // The kernel has found the part of the face. In f64 the point on this part is as good as
        // the f32 corners allow.
        let closest = match found.part() {
            0 => triangle.closest_in_plane(relative),
            edge => triangle.closest_on_edge(edge as usize - 1, relative),
        };
        let side = self.side_of_place(place).unwrap_or_else(|| {
            let height = triangle.normal.dot(relative - triangle.corners[0]);
            hinted_side(record.hints(), closest.feature, height).unwrap_or_else(|| self.exact_side(local))
        });
        let on_surface = |d: f64| match place {
            _ if d >= ON_SURFACE_F32 => None,
            _ if self.facing(found.face, local) == Facing::Inward => Some(-triangle.normal),
            _ => Some(triangle.normal),
        };
        self.finish(relative, closest, side, found.face, self.cube.middle(), on_surface)
    }

    fn answer_f64(&self, local: DVec3, place: Place, faces: &Faces) -> LocalAnswer {
        self.answer_f64_and_seen(local, place, faces, &mut |_, _| ())
    }

    /// As [`found_at`](Self::found_at) in `f64`. `faces` are those of the place's list, if it has
    /// one. `near` receives all faces that are within `tie` of the least distance, and maybe
    /// others. `tie` is far below the rounding of `f32`.
    #[cfg(feature = "collide")]
    pub(crate) fn found_with_near(
        &self,
        local: DVec3,
        place: Place,
        faces: &Faces,
        tie: f64,
        near: &mut Vec<(u32, Closest)>,
    ) -> LocalAnswer {
        self.store_normals_unless_moved();
        near.clear();
        let found =
            self.answer_f64_and_seen(local, place, faces, &mut |face, closest| near.push((face, *closest)));
        if !matches!(place, Place::Listed { .. }) && !self.is_in_reach_of_f32(local) {
            // The search has dropped boxes by their distance in `f64`.
            near.clear();
            let limit = found.signed_distance.abs() + tie;
            self.near_polygon(&[local], DVec3::ZERO, limit, &mut |face| {
                near.push((face, self.local_triangle(face as usize).closest(local)));
                limit
            });
        }
        found
    }

    /// `seen` receives the faces whose distance is computed.
    #[inline]
    fn answer_f64_and_seen(
        &self,
        local: DVec3,
        place: Place,
        faces: &Faces,
        seen: &mut impl FnMut(u32, &Closest),
    ) -> LocalAnswer {
        let (position, closest) = match place {
            Place::Listed { .. } => self.nearest_in_list_f64(faces, local, seen),
            _ => self.nearest_in_tree_f64(local, seen),
        };
        let side = self.side_of_place(place).unwrap_or_else(|| match closest.distance > 0.0 {
            true => self.side_in_cell(local, position, &closest),
            false => Side::Outside,
        });
        let on_surface = |d: f64| match place {
            _ if d >= ON_SURFACE_F64 => None,
            Place::Listed { .. } => Some(self.pseudonormal(faces, position, &closest)),
            // A cell without a list, because no list was worth its bytes, may touch the surface.
            _ => Some(self.normal_outward(position, closest.point)),
        };
        self.finish(local, closest, side, position, DVec3::ZERO, on_surface)
    }

    /// Adds the sign and the gradient. `origin` is the origin of the frame of `p` and `closest`.
    #[inline]
    fn finish(
        &self,
        p: DVec3,
        closest: Closest,
        side: Side,
        position: u32,
        origin: DVec3,
        on_surface: impl Fn(f64) -> Option<DVec3>,
    ) -> LocalAnswer {
        let sign = if side == Side::Inside { -1.0 } else { 1.0 };
        let gradient =
            on_surface(closest.distance).unwrap_or_else(|| (p - closest.point) * (sign / closest.distance));
        LocalAnswer {
            signed_distance: sign * closest.distance,
            gradient,
            closest_point: closest.point + origin,
            position,
            feature: closest.feature,
        }
    }

    /// The unit normal of a face. For a segment or a point, some direction perpendicular to it.
    pub(super) fn face_normal(&self, position: u32) -> DVec3 {
        let triangle = self.local_triangle(position as usize);
        if triangle.normal != DVec3::ZERO {
            return triangle.normal;
        }
        let [a, b, c] = triangle.corners;
        let longest = [c - b, a - c]
            .into_iter()
            .fold(b - a, |l, e| if e.length_squared() > l.length_squared() { e } else { l });
        longest.try_normalize().map_or(DVec3::Z, DVec3::any_orthonormal_vector)
    }

    /// The normal of a feature: the face normal, the sum over the faces of an edge, or the
    /// angle-weighted sum around a vertex (Bærentzen and Aanæs 2005). In a bisection domain, the
    /// list names all faces at a feature within the padding of the cell. In a conforming domain it
    /// need not, so the face tree is used.
    fn pseudonormal(&self, faces: &Faces, position: u32, closest: &Closest) -> DVec3 {
        let corners = self.faces[position as usize];
        let own = self.normal_outward(position, closest.point);
        let held: &[u32] = match closest.feature {
            Feature::Face => return own,
            Feature::Edge(k) => &[corners[k as usize], corners[(k as usize + 1) % 3]],
            Feature::Vertex(k) => &corners[k as usize..=k as usize],
        };
        let mut around = Vec::new();
        let holders = if self.conforming.is_some() {
            self.near_in_tree(closest.point, 0.0, &mut |face| {
                around.push(face);
                self.local_triangle(face as usize).closest(closest.point).distance.max(TOUCHING)
            });
            &around
        } else {
            faces.ids()
        };
        let mut sum = DVec3::ZERO;
        for &face in holders {
            let ids = self.faces[face as usize];
            if !held.iter().all(|v| ids.contains(v)) {
                continue;
            }
            let triangle = self.local_triangle(face as usize);
            let weight = match (held, ids.iter().position(|v| *v == held[0])) {
                ([_], Some(k)) => {
                    let at = |i: usize| triangle.corners[(k + i) % 3] - triangle.corners[k];
                    elementary::angle_between(at(1), at(2))
                }
                _ => 1.0,
            };
            if weight.is_finite() {
                sum += weight * self.facing(face, closest.point).sign() * triangle.normal;
            }
        }
        sum.try_normalize().unwrap_or(own)
    }
}
