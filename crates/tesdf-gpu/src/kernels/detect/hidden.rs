//! Overlaps that no contact shows. `tesdf::collide::hidden_overlaps` defines the rules.
//!
//! In the mode `node`, a thread measures the depth of its face in the field of the other body. It
//! goes on with quarters of the face as long as they can be deep enough. In every mode, the center
//! of a ball inside the body is measured. The result is the greatest depth of each ordered pair.
//!
//! Mirrors `collide/detect/hidden.rs` of `tesdf`.
use cubecl::prelude::*;
use tesdf::collide::{HiddenOverlap, internal};

use crate::kernels::bodies::polygon::quarter_at;
use crate::kernels::counters::{self, Counters};
use crate::kernels::detect::ordered_pair::{OrderedPair, OrderedPairs, Part, PartExpand};
use crate::kernels::geometry::vector::{LEAST_DIVISOR, centroid, pick, to_bits, v3};
use crate::kernels::pairs::meshlets::{Blocks, ROUNDING, meshlet_work};
use crate::kernels::query::tetrahedra::bounds_of;
use crate::kernels::scene::shape::{Ball, Bounds, Field, FieldExpand, SIZES, Shapes};

const SURE: f32 = HiddenOverlap::SURE as f32;
const FINE: f32 = HiddenOverlap::FINE as f32;
/// Number of looks per face in the search for depths below [`SURE`]. The processor counts those of
/// a body together ([`HiddenOverlap::FINE_LOOKS`]), the faces that can be deepest first.
const FINE_LOOKS: u32 = 4;
const DEEPER: f32 = internal::DEEPER as f32;
const SETTLED: f32 = internal::SETTLED as f32;
const THICK: f32 = internal::THICK as f32;
/// Pieces of a face after which the search stops. The processor stops after
/// [`HiddenOverlap::MAX_LOOKS`] pieces of a body. Here four times that number would exceed the loop
/// iterations that Mesa's llvmpipe allows a thread.
const MAX_LOOKS: u32 = 1 << 8;
/// Largest number of quarterings: a path of 32 bits holds no more.
const LEVELS: u32 = 12;

#[cube]
impl Field<'_> {
    /// Largest error of distances at points near the shape, in the frame of the field.
    fn rounding(self) -> f32 {
        select(self.is_mesh(), ROUNDING, ROUNDING * self.vector(SIZES).greatest())
    }

    /// Whether a box has a point that is deeper than `depth` in the bounds of the field.
    fn reaches(self, piece: Bounds, depth: f32) -> bool {
        let own = self.bounds();
        let by = v3(depth, depth, depth);
        piece.low.is_at_most(own.high - by) && (own.low + by).is_at_most(piece.high)
    }
}

#[cube]
impl Part {
    /// The greatest distance of a point of a triangle from its nearest corner.
    fn corner_reach(self) -> f32 {
        let (ab, bc, ca) = (self.b - self.a, self.c - self.b, self.a - self.c);
        let (u, v, w) = (ab.length(), bc.length(), ca.length());
        let a = u.max(v).max(w);
        let c = u.min(v).min(w);
        let b = u.max(v).min(u.max(w)).min(v.max(w));
        let acute = a * b * c / (2.0f32 * ab.cross(ca).length()).max(LEAST_DIVISOR);
        // Obtuse triangle: this point is on the longest side, equally far from its end and from
        // another corner.
        let by_b = a * b * b / (a * a + b * b - c * c).max(LEAST_DIVISOR);
        let by_c = a * c * c / (a * a + c * c - b * b).max(LEAST_DIVISOR);
        select(a * a < b * b + c * c, acute, by_b.max(by_c)).min(0.577_350_3f32 * a)
    }

    /// A ball around a triangle. Its center is the midpoint of the longest side, or the centroid.
    fn ball(self) -> Ball {
        let (u, v, w) = ((self.b - self.a).length(), (self.c - self.b).length(), (self.a - self.c).length());
        let is_ab = u >= v && u >= w;
        let on_side = (pick(is_ab || w > v, self.a, self.b) + pick(is_ab, self.b, self.c)) * 0.5f32;
        let centroid = centroid(self.a, self.b, self.c);
        let to_side = self.radius_around(on_side);
        let to_centroid = self.radius_around(centroid);
        Ball { center: pick(to_side <= to_centroid, on_side, centroid), radius: to_side.min(to_centroid) }
    }
}

/// Lower bound of the depth of a face in the field; 0 when no deep point was found.
#[cube]
fn depth_of(field: Field<'_>, pair: OrderedPair, part: Part, thickness: f32) -> f32 {
    let mut deepest = 0.0f32;
    let mut path = 0u32;
    let mut level = 0u32;
    let mut looks = 0u32;
    let mut open = part.corner_reach() > SURE * thickness;
    while open {
        let here = part.quarter(quarter_at(path, level));
        let core = bounds_of(here.a, here.b, here.c);
        let by = v3(pair.radius, pair.radius, pair.radius);
        let bounds = Bounds { low: core.low - by, high: core.high + by };
        let mut down = false;
        if looks < MAX_LOOKS && field.reaches(bounds, FINE * thickness) {
            let ball = here.ball();
            let depth = pair.radius - field.exact_distance(ball.center);
            deepest = deepest.max(depth);
            looks += 1u32;
            let share = select(looks <= FINE_LOOKS, FINE, SURE);
            let wanted = (share * thickness).max(DEEPER * deepest);
            down = depth + ball.radius > wanted && ball.radius > SETTLED * wanted && level < LEVELS;
        }
        if down {
            path *= 4u32;
            level += 1u32;
        } else {
            // Go to the next quarter on the last level that has one.
            while level > 0u32 && path % 4u32 == 3u32 {
                path /= 4u32;
                level -= 1u32;
            }
            open = level > 0u32;
            path += 1u32;
        }
    }
    deepest
}

/// Finds hidden overlaps. A group takes a meshlet, and a thread takes a face. `depths` has the bits
/// of an `f32` for each ordered pair.
#[cube(launch, create_dummy_kernel)]
pub fn hidden(
    shapes: &Shapes,
    pairs: &OrderedPairs,
    meshlets: &Blocks,
    counters: &Counters,
    depths: &[Atomic<u32>],
    by_faces: u32,
) {
    let item = CUBE_POS as u32;
    let count = counters.within(counters::MESHLETS, meshlets.room);
    if item < count {
        let work = meshlet_work(shapes, pairs, meshlets, item);
        let (pair, field) = (work.pair, work.field);
        let own = work.surface.inner_ball();
        let thickness = (own.radius.abs() * pair.scale).min(field.inner_ball().radius.abs());
        if FINE * thickness > THICK * field.rounding() {
            let mut depth = 0.0f32;
            if work.meshlet == 0u32 && UNIT_POS == 0u32 && own.radius > 0.0f32 {
                let distance = field.exact_distance(pair.to_field(own.center));
                depth = (own.radius * pair.scale).min(field.half_thickness() - distance);
            }
            if by_faces == 1u32 && UNIT_POS < work.faces() {
                let part = shapes.part(pair, work.face(UNIT_POS));
                depth = depth.max(depth_of(field, pair, part, thickness));
            }
            if depth > FINE * thickness {
                depths[pair.number as usize].fetch_max(to_bits(depth));
                counters.append(counters::HIDDEN);
            }
        }
        counters.tell_if_broken_off(count);
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::testing::degenerate;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]
        /// All points of a face are within the reach of its corners, and in its ball.
        #[test]
        fn all_of_a_face_is_within_reach(corners in degenerate::face()) {
            let corners = corners.map(|p| p.as_vec3());
            let [a, b, c] = corners.map(|p| v3(p.x, p.y, p.z));
            let part = Part { a, b, c, count: 3, owned: 0 };
            let (reach, ball) = (part.corner_reach(), part.ball());
            let center = DVec3::new(ball.center.x.into(), ball.center.y.into(), ball.center.z.into());
            let corners = corners.map(|p| p.as_dvec3());
            for (s, t) in (0..=16).flat_map(|i| (0..=16 - i).map(move |j| (f64::from(i) / 16.0, f64::from(j) / 16.0))) {
                let p = corners[0] + s * (corners[1] - corners[0]) + t * (corners[2] - corners[0]);
                let nearest = corners.map(|q| q.distance(p)).into_iter().fold(9.0, f64::min);
                prop_assert!(nearest <= f64::from(reach) * (1.0 + 1e-5) + 1e-6, "{nearest} > {reach}");
                prop_assert!(center.distance(p) <= f64::from(ball.radius) * (1.0 + 1e-5) + 1e-6);
            }
            let longest = [0, 1, 2].map(|k| corners[k].distance(corners[(k + 1) % 3])).into_iter().fold(0.0, f64::max);
            prop_assert!(f64::from(reach) <= 0.58 * longest + 1e-6 && f64::from(ball.radius) <= 0.87 * longest + 1e-6);
        }
    }
}
