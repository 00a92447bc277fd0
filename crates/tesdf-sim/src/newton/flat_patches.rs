//! Flat patches of contacts are thinned to the corners that span them.
//!
//! Contacts of a pair with one normal `n`, at points `p_k` of one plane, whose gaps `g_k` are affine in
//! the points: for `p = Σ w_k p_k` with `w_k ≥ 0`, `Σ w_k = 1`, the gap and its rate at `p` are the same
//! means of those at the `p_k`, so `p` stays open where they do. A force at `p` that lies in the cone of
//! friction has the wrench of the forces `w_k f` at the `p_k`, which lie in theirs. So the corners of the
//! convex hull allow the same motions and the same wrenches as all contacts.
//!
//! What is not exactly so is bounded by the constants below, as shares of the extent `L` of the patch: a
//! contact without a row sinks by at most `AFFINE L` more than the corners, and forces act within
//! `LEVEL L` of their height.
use glam::{DVec2, DVec3};
use tesdf::geometry::internal::convex_hull;

/// A contact as it matters here.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// A unit vector.
    pub normal: DVec3,
    /// In the middle between the bodies.
    pub point: DVec3,
    /// Distance of the bodies.
    pub gap: f64,
}

/// Patches of up to this number of contacts stay as they are.
const FEW: usize = 16;
/// Largest number of patches of a pair. Contacts of further ones stay.
const MOST: usize = 64;
/// Normals of a patch differ by at most this, rad.
const SAME_NORMAL: f64 = 1e-9;
/// Points of a patch are within this share of its extent of a plane.
const LEVEL: f64 = 1e-4;
/// Gaps are affine up to this share of the extent of the patch.
const AFFINE: f64 = 1e-8;
/// A corner that stands out by less than this share of the extent is none.
const ROUNDING: f64 = 1e-12;

/// Whether each of `count` contacts is kept: false for contacts of flat patches that others span. `pair`
/// tells of a contact which bodies it has, and `place` where it is; the contacts of two bodies have
/// normals from the same one to the other.
pub fn spanning<P: Copy + Ord>(
    count: usize,
    pair: impl Fn(usize) -> P,
    place: impl Fn(usize) -> Place,
) -> Vec<bool> {
    let mut kept = vec![true; count];
    if count <= FEW {
        return kept;
    }
    let mut by_pair: Vec<usize> = (0..count).collect();
    by_pair.sort_by_key(|&k| (pair(k), k));
    for of_pair in by_pair.chunk_by(|&i, &j| pair(i) == pair(j)).filter(|of_pair| of_pair.len() > FEW) {
        let places: Vec<Place> = of_pair.iter().map(|&k| place(k)).collect();
        of_pair.iter().zip(kept_of_pair(&places)).for_each(|(&k, is_kept)| kept[k] = is_kept);
    }
    kept
}

fn kept_of_pair(places: &[Place]) -> Vec<bool> {
    let mut kept = vec![true; places.len()];
    let first = places[0].point;
    let extent = places.iter().map(|place| place.point.distance(first)).fold(0.0, f64::max);
    let mut patches: Vec<Vec<usize>> = Vec::new();
    for (k, place) in places.iter().enumerate() {
        let is_of = |patch: &Vec<usize>| {
            let Place { normal, point, .. } = places[patch[0]];
            normal.distance(place.normal) <= SAME_NORMAL
                && normal.dot(point - place.point).abs() <= LEVEL * extent
        };
        match patches.iter().position(is_of) {
            Some(patch) => patches[patch].push(k),
            None if patches.len() < MOST => patches.push(vec![k]),
            None => {}
        }
    }
    for patch in patches.iter().filter(|patch| patch.len() > FEW) {
        if let Some(corners) = corners(places, patch) {
            patch.iter().for_each(|&k| kept[k] = false);
            corners.into_iter().for_each(|k| kept[k] = true);
        }
    }
    kept
}

/// The contacts at the corners of a patch; `None` where its gaps are not affine.
fn corners(places: &[Place], patch: &[usize]) -> Option<Vec<usize>> {
    let Place { normal, point: origin, .. } = places[patch[0]];
    let [u, v]: [DVec3; 2] = normal.any_orthonormal_pair().into();
    let in_plane = |k: usize| DVec2::new(u.dot(places[k].point - origin), v.dot(places[k].point - origin));
    let hull = convex_hull(patch.iter().map(|&k| (in_plane(k), k)).collect(), ROUNDING);
    let farthest = |of: &dyn Fn(DVec2) -> f64| {
        hull.iter().copied().max_by(|(a, i), (b, j)| of(*a).total_cmp(&of(*b)).then(j.cmp(i)))
    };
    // Three points far from each other carry the affine function.
    let (a, first) = hull[0];
    let (b, second) = farthest(&|p| p.distance(a))?;
    let extent = a.distance(b);
    if extent <= 0.0 {
        return None;
    }
    let along = (b - a) / extent;
    let (c, third) = farthest(&|p| along.perp_dot(p - a).abs())?;
    let aside = along.perp_dot(c - a);
    let [gap_a, gap_b, gap_c] = [first, second, third].map(|k| places[k].gap);
    let slope = (gap_b - gap_a) / extent;
    // A patch without width is a line.
    let across = match aside.abs() > ROUNDING * extent {
        true => (gap_c - gap_a - slope * along.dot(c - a)) / aside,
        false => 0.0,
    };
    let affine = |p: DVec2| gap_a + slope * along.dot(p - a) + across * along.perp_dot(p - a);
    if patch.iter().any(|&k| (places[k].gap - affine(in_plane(k))).abs() > AFFINE * extent) {
        return None;
    }
    Some(hull.into_iter().map(|(_, k)| k).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// A grid of contacts in a plane, n × n, whose gaps are `gap` of their place.
    fn grid(n: usize, gap: impl Fn(DVec2) -> f64) -> Vec<Place> {
        let normal = DVec3::new(0.3, -0.2, 0.9).normalize();
        let (u, v) = normal.any_orthonormal_pair();
        let at = |k: usize| {
            let p = DVec2::new((k % n) as f64, (k / n) as f64) / (n - 1) as f64;
            Place { normal, point: DVec3::new(3.0, 5.0, 7.0) + p.x * u + p.y * v, gap: gap(p) }
        };
        (0..n * n).map(at).collect()
    }

    fn kept(places: &[Place]) -> Vec<usize> {
        spanning(places.len(), |_| 0, |k| places[k])
            .into_iter()
            .enumerate()
            .filter_map(|(k, kept)| kept.then_some(k))
            .collect()
    }

    #[test]
    fn a_flat_patch_is_thinned_to_its_corners() {
        assert_eq!(kept(&grid(9, |_| 0.0)), [0, 8, 72, 80]);
        assert_eq!(kept(&grid(9, |p| 1e-3 * (p.x - 2.0 * p.y))), [0, 8, 72, 80]);
        // Of two pairs whose contacts alternate, each keeps its own.
        let one = grid(9, |_| 0.0);
        let both = spanning(162, |k| k % 2, |k| one[k / 2]);
        assert_eq!(both.iter().filter(|kept| **kept).count(), 8);
        // Coincident contacts are one corner, and a line has two.
        let mut twice = grid(9, |_| 0.0);
        twice.extend(grid(9, |_| 0.0));
        assert_eq!(kept(&twice).len(), 4);
        let line: Vec<Place> = grid(20, |p| p.x).into_iter().take(20).collect();
        assert_eq!(kept(&line), [0, 19]);
        let point = vec![line[0]; 30];
        assert_eq!(kept(&point).len(), 30);
    }

    #[test]
    fn what_is_not_flat_stays() {
        assert_eq!(kept(&grid(9, |p| 1e-6 * p.x * p.y)).len(), 81);
        assert_eq!(kept(&grid(4, |_| 0.0)).len(), 16);
        // Two steps, one above the other, are two patches.
        let mut steps = grid(6, |_| 0.0);
        let above = steps.iter().map(|place| Place { point: place.point + 0.1 * place.normal, ..*place });
        steps.extend(above.collect::<Vec<_>>());
        assert_eq!(kept(&steps).len(), 8);
        // Another normal.
        steps.iter_mut().skip(36).for_each(|place| place.normal = -place.normal);
        assert_eq!(kept(&steps).len(), 8);
    }

    /// Each contact is a mean of the corners, with weights of 0 or more: found by brute force over
    /// triangles of corners.
    #[test]
    fn the_corners_span_all_contacts() {
        let mut random = fastrand::Rng::with_seed(4);
        for case in 0..40 {
            let normal = DVec3::from_array([0; 3].map(|_| random.f64() - 0.5)).normalize();
            let (u, v) = normal.any_orthonormal_pair();
            let mut place = |k: usize| {
                let (r, angle) = match case % 2 {
                    0 => (random.f64(), TAU * random.f64()),
                    // On a circle all are corners.
                    _ => (if k < 24 { 1.0 } else { 0.9 * random.f64() }, TAU * k as f64 / 24.0),
                };
                let p = r * DVec2::from_angle(angle);
                Place { normal, point: p.x * u + p.y * v, gap: 0.1 * p.x - 0.02 * p.y }
            };
            let places: Vec<Place> = (0..60).map(&mut place).collect();
            let kept = kept(&places);
            assert!(kept.len() < 60 && (case % 2 == 0 || kept.len() == 24), "{case}: {kept:?}");
            for place in &places {
                let flat = |p: DVec3| DVec2::new(u.dot(p), v.dot(p));
                let p = flat(place.point);
                let corner = |k: usize| flat(places[kept[k]].point);
                let n = kept.len();
                let is_in = |i: usize, j: usize| {
                    // A triangle of the fan around corner 0 has it.
                    let [a, b, c] = [corner(0), corner(i), corner(j)];
                    let area = (b - a).perp_dot(c - a);
                    let weights = [(b - p).perp_dot(c - p), (c - p).perp_dot(a - p), (a - p).perp_dot(b - p)];
                    area.abs() > 1e-12 && weights.iter().all(|w| w / area >= -1e-9)
                };
                let spanned = (1..n).any(|i| (1..n).any(|j| i != j && is_in(i, j)));
                assert!(spanned, "{case}: {p}");
            }
        }
    }
}
