use glam::{DVec2, DVec3};

use super::group::force;
use crate::collide::report::contact::Contact;
use crate::collide::scene::ids::InstanceId;
use crate::geometry::convex_hull;

/// The convex hull of a patch's contacts, seen along its normal.
pub struct Outline<'a> {
    contacts: &'a [Contact],
    members: &'a [usize],
    /// Mean unit normal on the instance with the lower id.
    pub normal: DVec3,
    /// Least signed distance.
    pub distance: f64,
    /// Area of the hull.
    pub area: f64,
    /// Pressure centre.
    pub center: DVec3,
    /// Members on the hull, anticlockwise, without those between two others.
    hull: Vec<(DVec2, usize)>,
    /// The largest distance of a corner of the hull from its first one.
    extent: f64,
}

/// Distances that differ by less than this fraction of the largest extent are equal.
const LEVEL: f64 = 1e-6;

impl<'a> Outline<'a> {
    /// `members` are indices of contacts, at least one.
    pub fn new(contacts: &'a [Contact], members: &'a [usize], lower: InstanceId) -> Self {
        let sum: DVec3 = members.iter().map(|&i| force(&contacts[i], lower)).sum();
        let normal = sum.try_normalize().unwrap_or(DVec3::Z);
        let distance = members.iter().map(|&i| contacts[i].distance).fold(f64::INFINITY, f64::min);
        let (center, hull) = (contacts[members[0]].point_a, Vec::new());
        let mut outline = Self { contacts, members, normal, distance, area: 0.0, center, hull, extent: 0.0 };
        outline.hull = convex_hull(members.iter().map(|&i| (outline.flat(i), i)).collect(), LEVEL);
        let first = outline.hull[0].0;
        outline.extent = outline.hull.iter().map(|(p, _)| p.distance(first)).fold(0.0, f64::max);
        outline.measure();
        outline
    }

    /// The place of a contact, seen along the normal, relative to the first member.
    fn flat(&self, i: usize) -> DVec2 {
        let (u, v) = self.normal.any_orthonormal_pair();
        let p = self.contacts[i].point_a - self.contacts[self.members[0]].point_a;
        DVec2::new(p.dot(u), p.dot(v))
    }

    /// The pressures at the corners of the hull, up to a factor.
    fn pressures(&self) -> Vec<f64> {
        let distances = self.members.iter().map(|&i| self.contacts[i].distance);
        let greatest = distances.fold(f64::NEG_INFINITY, f64::max);
        let range = greatest - self.distance;
        let is_level = range <= LEVEL * self.extent;
        let pressure = |i: usize| if is_level { 1.0 } else { (greatest - self.contacts[i].distance) / range };
        self.hull.iter().map(|&(_, i)| pressure(i)).collect()
    }

    /// Computes area and pressure centre, from the triangles of a fan. The pressure is linear in
    /// each.
    fn measure(&mut self) {
        let pressures = self.pressures();
        let point = |k: usize| self.contacts[self.hull[k].1].point_a;
        let (mut area, mut force, mut moment) = (0.0, 0.0, DVec3::ZERO);
        let origin = point(0);
        let mut add = |weight: f64, at: &[usize]| {
            let n = at.len() as f64;
            let sum: f64 = at.iter().map(|&k| pressures[k]).sum();
            force += weight * sum / n;
            // ∫ λ_i λ_j over a simplex of n corners: 1 / (n (n + 1)), twice that for i = j.
            for &k in at {
                moment += weight * (sum + pressures[k]) / (n * (n + 1.0)) * (point(k) - origin);
            }
        };
        match self.hull.len() {
            1 => add(1.0, &[0]),
            2 => add(1.0, &[0, 1]),
            n => {
                for k in 2..n {
                    let [a, b, c] = [0, k - 1, k].map(|k| self.hull[k].0);
                    let part = 0.5 * (b - a).perp_dot(c - a);
                    area += part;
                    add(part, &[0, k - 1, k]);
                }
            }
        }
        let center = if force > 0.0 { origin + moment / force } else { origin };
        (self.area, self.center) = (area, center);
    }

    /// At most `count` members: the deepest, then those that make the polygon of the chosen ones
    /// largest.
    pub fn points(&self, count: usize) -> Vec<usize> {
        let level = self.distance + LEVEL * self.extent;
        // Of equally deep contacts, a corner of the hull, and the first one of these.
        let on_hull = self.hull.iter().map(|&(_, i)| i).filter(|&i| self.contacts[i].distance <= level).min();
        let deepest = on_hull.or_else(|| {
            let depth = |i: &usize| self.contacts[*i].distance;
            self.members.iter().copied().min_by(|i, j| depth(i).total_cmp(&depth(j)))
        });
        let mut chosen: Vec<usize> = deepest.into_iter().collect();
        let mut rest: Vec<(DVec2, usize)> =
            self.hull.iter().copied().filter(|(_, i)| deepest != Some(*i)).collect();
        let mut polygon: Vec<DVec2> = chosen.iter().map(|&i| self.flat(i)).collect();
        while chosen.len() < count && !rest.is_empty() {
            let gain = |p: DVec2| match polygon.len() {
                1 => p.distance(polygon[0]),
                n => (0..n)
                    .map(|k| {
                        let (a, b) = (polygon[k], polygon[(k + 1) % n]);
                        // Outside of an anticlockwise polygon; on both sides of a segment.
                        -(b - a).perp_dot(p - a)
                    })
                    .fold(f64::NEG_INFINITY, f64::max),
            };
            let first_best = |best: (usize, f64), (k, &(p, _)): (usize, &(DVec2, usize))| {
                let own = gain(p);
                if own > best.1 * (1.0 + LEVEL) { (k, own) } else { best }
            };
            let (k, best) = rest.iter().enumerate().fold((0, 0.0), first_best);
            // Rounding puts points of a line beside it.
            let extent = self.extent;
            if best <= LEVEL * if polygon.len() == 1 { extent } else { extent * extent } {
                break;
            }
            let (p, i) = rest.remove(k);
            chosen.push(i);
            polygon.push(p);
            polygon = convex_hull(polygon.into_iter().map(|p| (p, 0)).collect(), LEVEL)
                .into_iter()
                .map(|(p, _)| p)
                .collect();
        }
        chosen
    }
}
