//! Overlaps that no contact shows: `tesdf::collide::hidden_overlaps` has the rules.
//!
//! In the mode `node` a thread looks at its face in the field of the other body, and at quarters of it as long as they can be deep. In every mode
//! the middle of a ball inside of the body is looked at. What is kept is the greatest depth of each direction.
use cubecl::prelude::*;
use tesdf::collide::HiddenOverlap;

use super::assets::{Assets, BOX, EXACT_LISTS, HIGH, INNER_BALL, KIND, LOW, MESH, SIZES, entry, vector};
use super::broad::ROUNDING;
use super::clip::faces_of;
use super::field::{is_listed, simple_value, value_of};
use super::list::list;
use super::locate::{offset, place};
use super::nearest::{FAR, Nearest, nearest_in_list, nearest_in_tree};
use super::outside::quarter;
use super::products::{self, PAIR_WORDS, tell_if_broken_off};
use super::surface::{Direction, Part, at_weights, direction, part, to_field};
use super::vector::{V3, cross, length, minus, pick, plus, scaled, v3};

const SURE: f32 = HiddenOverlap::SURE as f32;
const FINE: f32 = HiddenOverlap::FINE as f32;
const FINE_LOOKS: u32 = HiddenOverlap::FINE_LOOKS;
/// Looks at a face after which its search gives up. Four times as many are more than Mesa's llvmpipe lets a thread take.
const MOST_LOOKS: u32 = 1 << 8;
/// Quarters of quarters, at most: what a path of 32 bits holds.
const LEVELS: u32 = 12;

/// A ball.
#[derive(CubeType, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Ball {
    center: V3,
    radius: f32,
}

/// The ball inside of a shape; of radius 0 when there is none, and negative when its vertices have moved, so that the middle need not be inside.
#[cube]
fn inner_ball(assets: &Assets, shape: u32) -> Ball {
    let row = assets.rows[entry(assets, shape, INNER_BALL) as usize];
    Ball {
        center: v3(row.extract(0usize), row.extract(1usize), row.extract(2usize)),
        radius: row.extract(3usize),
    }
}

/// Signed distance to the surface, also where lists are not exact.
#[cube]
fn exact_distance(assets: &Assets, shape: u32, p: V3) -> f32 {
    let mut distance = 0.0f32;
    if entry(assets, shape, KIND) == MESH {
        let word = place(assets, shape, p).word;
        let mut squared = FAR.runtime();
        let mut face = 0u32;
        if is_listed(word) && entry(assets, shape, EXACT_LISTS) == 1u32 {
            let found = nearest_in_list(assets, shape, list(assets, shape, offset(word)), 0u32, 1u32, p);
            squared = found.squared;
            face = found.face;
        } else {
            let found = nearest_in_tree(assets, shape, p, FAR);
            squared = found.squared;
            face = found.face;
        }
        distance = value_of(assets, shape, word, p, Nearest { squared, face }).distance;
    } else {
        distance = simple_value(assets, shape, p).distance;
    }
    distance
}

/// What distances may be off by, in the frame of a field, at points of it.
#[cube]
fn rounding(assets: &Assets, shape: u32) -> f32 {
    let sizes = vector(assets, shape, SIZES);
    select(entry(assets, shape, KIND) == MESH, ROUNDING, 4e-6f32 * sizes.x.max(sizes.y).max(sizes.z))
}

/// Whether a box from `low` to `high` has a point that is deeper than `depth` in the bounds of a field.
#[cube]
fn reaches(assets: &Assets, shape: u32, low: V3, high: V3, depth: f32) -> bool {
    let kind = entry(assets, shape, KIND);
    let sizes = vector(assets, shape, SIZES);
    let half = pick(kind == BOX, sizes, v3(sizes.y, sizes.y, sizes.x + sizes.y));
    let is_mesh = kind == MESH;
    let least = pick(is_mesh, vector(assets, shape, LOW), scaled(-1.0f32, half));
    let greatest = pick(is_mesh, vector(assets, shape, HIGH), half);
    low.x <= greatest.x - depth
        && low.y <= greatest.y - depth
        && low.z <= greatest.z - depth
        && high.x >= least.x + depth
        && high.y >= least.y + depth
        && high.z >= least.z + depth
}

/// The greatest distance of a point of a part from its nearest corner.
#[cube]
fn corner_reach(p: Part) -> f32 {
    let (ab, bc, ca) = (minus(p.b, p.a), minus(p.c, p.b), minus(p.a, p.c));
    let (u, v, w) = (length(ab), length(bc), length(ca));
    let a = u.max(v).max(w);
    let c = u.min(v).min(w);
    let b = u.max(v).min(u.max(w)).min(v.max(w));
    let acute = a * b * c / (2.0f32 * length(cross(ab, ca))).max(1e-30f32);
    // On the longest side, as far from its end as from another corner.
    let by_b = a * b * b / (a * a + b * b - c * c).max(1e-30f32);
    let by_c = a * c * c / (a * a + c * c - b * b).max(1e-30f32);
    select(a * a < b * b + c * c, acute, by_b.max(by_c)).min(0.577_350_3f32 * a)
}

/// The middle of a triangle's longest side or its centroid, whichever is nearer to the farthest corner, and that distance.
#[cube]
fn middle(p: Part) -> Ball {
    let (u, v, w) = (length(minus(p.b, p.a)), length(minus(p.c, p.b)), length(minus(p.a, p.c)));
    let is_ab = u >= v && u >= w;
    let on_side = scaled(0.5f32, plus(pick(is_ab || w > v, p.a, p.b), pick(is_ab, p.b, p.c)));
    let centroid = scaled(0.333_333_34f32, plus(plus(p.a, p.b), p.c));
    let to_side = farthest(p, on_side);
    let to_centroid = farthest(p, centroid);
    Ball { center: pick(to_side <= to_centroid, on_side, centroid), radius: to_side.min(to_centroid) }
}

#[cube]
fn farthest(p: Part, q: V3) -> f32 {
    length(minus(p.a, q)).max(length(minus(p.b, q))).max(length(minus(p.c, q)))
}

/// How deep a face is in the field, at least; 0 when nothing as deep as it takes was found.
#[cube]
fn depth_of(assets: &Assets, d: Direction, p: Part, thickness: f32) -> f32 {
    let mut deepest = 0.0f32;
    let mut path = 0u32;
    let mut level = 0u32;
    let mut looks = 0u32;
    let mut open = corner_reach(p) > SURE * thickness;
    while open {
        let q = quarter(path, level);
        let here = Part {
            a: at_weights(p, q.a_s, q.a_t),
            b: at_weights(p, q.b_s, q.b_t),
            c: at_weights(p, q.c_s, q.c_t),
            count: p.count,
            owned: 0u32,
        };
        let low = v3(
            here.a.x.min(here.b.x).min(here.c.x) - d.radius,
            here.a.y.min(here.b.y).min(here.c.y) - d.radius,
            here.a.z.min(here.b.z).min(here.c.z) - d.radius,
        );
        let high = v3(
            here.a.x.max(here.b.x).max(here.c.x) + d.radius,
            here.a.y.max(here.b.y).max(here.c.y) + d.radius,
            here.a.z.max(here.b.z).max(here.c.z) + d.radius,
        );
        let mut down = false;
        if looks < MOST_LOOKS && reaches(assets, d.shape_b, low, high, FINE * thickness) {
            let ball = middle(here);
            let depth = d.radius - exact_distance(assets, d.shape_b, ball.center);
            deepest = deepest.max(depth);
            looks += 1u32;
            let share = select(looks <= FINE_LOOKS, FINE, SURE);
            let wanted = (share * thickness).max(1.25f32 * deepest);
            // What a piece this small holds is as deep as its middle, but for a quarter.
            down = depth + ball.radius > wanted && ball.radius > 0.25f32 * wanted && level < LEVELS;
        }
        if down {
            path *= 4u32;
            level += 1u32;
        } else {
            // On to the next quarter, of the last level that has one.
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

/// A group for each meshlet, a thread for each face.
#[cube(launch, create_dummy_kernel)]
pub fn hidden(
    assets: &Assets,
    directions: &[u32],
    maps: &[Vector<f32, Const<4>>],
    meshlets: &[u32],
    counters: &[Atomic<u32>],
    depths: &[Atomic<u32>],
    most_meshlets: u32,
    by_faces: u32,
) {
    let item = CUBE_POS as u32;
    let count = counters[products::MESHLETS as usize].load().min(most_meshlets);
    if item < count {
        let at = meshlets[(item * comptime!(PAIR_WORDS as u32)) as usize];
        let meshlet = meshlets[(item * comptime!(PAIR_WORDS as u32) + 1u32) as usize];
        let d: Direction = direction(directions, maps, at);
        let own = inner_ball(assets, d.shape_a);
        let other = inner_ball(assets, d.shape_b);
        let thickness = (own.radius.abs() * d.scale).min(other.radius.abs());
        if FINE * thickness > 2.0f32 * rounding(assets, d.shape_b) {
            let mut depth = 0.0f32;
            if meshlet == 0u32 && UNIT_POS == 0u32 && own.radius > 0.0f32 {
                let inside = exact_distance(assets, d.shape_b, to_field(d, own.center));
                depth = (own.radius * d.scale).min(-inside);
            }
            if by_faces == 1u32 && UNIT_POS < faces_of(assets, d.shape_a, meshlet, 1u32) {
                let face = faces_of(assets, d.shape_a, meshlet, 0u32) + UNIT_POS;
                depth = depth.max(depth_of(assets, d, part(assets, d, face), thickness));
            }
            if depth > FINE * thickness {
                depths[at as usize].fetch_max(u32::reinterpret(depth));
                counters[products::HIDDEN as usize].fetch_add(1u32);
            }
        }
        tell_if_broken_off(counters, select(count > 0u32, 2u32, 0u32));
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
        /// What both promise of a face: all of it is within the reach of its corners, and in the ball around its middle.
        #[test]
        fn all_of_a_face_is_within_reach(corners in degenerate::face()) {
            let corners = corners.map(|p| p.as_vec3());
            let [a, b, c] = corners.map(|p| v3(p.x, p.y, p.z));
            let part = Part { a, b, c, count: 3, owned: 0 };
            let (reach, ball) = (corner_reach(part), middle(part));
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
