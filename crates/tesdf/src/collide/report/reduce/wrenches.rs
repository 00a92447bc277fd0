use std::cmp::Ordering;

use glam::DVec3;

use crate::collide::report::contact::Contact;
use crate::collide::report::hull::Wrench;
use crate::collide::scene::ids::InstanceId;

/// An axis along which the points extend less than this fraction of `L` gets no extremes. So a flat
/// patch has two axes, whatever the rounding of its points (1e-7 in `f32`).
pub const FLAT: f64 = 1e-3;

/// The wrenches of all contacts of a pair.
pub struct Wrenches {
    /// The middle of the box around the contact points.
    pub center: DVec3,
    /// The greatest distance of a contact point from the centre.
    pub length: f64,
    /// The coordinates of all wrenches, a column each.
    pub columns: [Vec<f64>; 6],
    /// The signed distances of the contacts.
    pub distances: Vec<f64>,
    /// The deepest contact, then the extremes of the points.
    pub seeds: Vec<usize>,
}

impl Wrenches {
    /// Of `count` contacts.
    #[inline(always)]
    pub fn new<'a>(count: usize, contacts: impl Iterator<Item = &'a Contact>) -> Self {
        let mut columns: [Vec<f64>; 6] = std::array::from_fn(|_| vec![0.0; count]);
        let mut distances = vec![0.0; count];
        {
            let [fx, fy, fz, x, y, z] = columns.each_mut().map(|column| &mut column[..count]);
            for (i, contact) in contacts.take(count).enumerate() {
                // The point takes the place of the torque until the centre and the length are
                // known.
                ([fx[i], fy[i], fz[i]], [x[i], y[i], z[i]]) =
                    (force(contact).to_array(), contact.point_a.to_array());
                distances[i] = contact.distance;
            }
        }
        let center = {
            let [.., x, y, z] = &columns;
            DVec3::from([x, y, z].map(|column| middle(range(column))))
        };
        let [fx, fy, fz, x, y, z] = columns.each_mut();
        for (column, middle) in [&mut *x, y, z].into_iter().zip(center.to_array()) {
            column.iter_mut().for_each(|x| *x -= middle);
        }
        let (length, extremes) = extremes([x, y, z]);
        let mut seeds = vec![first_min(&distances)];
        for i in extremes {
            if !seeds.contains(&i) {
                seeds.push(i);
            }
        }
        for i in 0..count {
            let force = DVec3::new(fx[i], fy[i], fz[i]);
            [x[i], y[i], z[i]] = torque(DVec3::new(x[i], y[i], z[i]), force, length).to_array();
        }
        Self { center, length, columns, distances, seeds }
    }

    /// The wrench of a contact.
    pub fn get(&self, i: usize) -> Wrench {
        self.columns.each_ref().map(|column| column[i])
    }

    /// Number of contacts.
    pub fn len(&self) -> usize {
        self.distances.len()
    }

    /// Puts the contacts into another order. The seeds change with them.
    #[inline(always)]
    pub fn reorder(&mut self, order: &[u32]) {
        let mut other = Vec::with_capacity(order.len());
        for column in self.columns.iter_mut().chain([&mut self.distances]) {
            other.clear();
            other.extend(order.iter().map(|&i| column[i as usize]));
            std::mem::swap(column, &mut other);
        }
        for seed in &mut self.seeds {
            *seed = order.iter().position(|&i| i as usize == *seed).unwrap_or(*seed);
        }
    }

    /// Bytes of all columns.
    pub fn bytes(&self) -> usize {
        self.columns.iter().chain([&self.distances]).map(|column| size_of_val(column.as_slice())).sum()
    }
}

/// The wrench of a unit force on the instance with the lower id.
pub fn wrench_of(contact: &Contact, center: DVec3, length: f64) -> Wrench {
    let force = force(contact);
    let torque = torque(contact.point_a - center, force, length);
    [force.x, force.y, force.z, torque.x, torque.y, torque.z]
}

fn force(contact: &Contact) -> DVec3 {
    let Contact { normal, instance_a: InstanceId(a), instance_b: InstanceId(b), .. } = *contact;
    if a < b { normal } else { -normal }
}

fn torque(arm: DVec3, force: DVec3, length: f64) -> DVec3 {
    // A single point needs no scale, because its torques are 0.
    arm.cross(force) / if length > 0.0 { length } else { 1.0 }
}

/// The middle between two numbers.
pub fn middle((low, high): (f64, f64)) -> f64 {
    0.5 * (low + high)
}

/// Number of points that are looked at together.
const LANES: usize = 4;

/// Numbers from `i` on. The last number stands for those behind the end.
#[inline(always)]
pub fn lanes<const LANES: usize>(numbers: &[f64], i: usize) -> [f64; LANES] {
    match numbers.get(i..i + LANES) {
        Some(lanes) => std::array::from_fn(|l| lanes[l]),
        None => std::array::from_fn(|l| numbers[(i + l).min(numbers.len() - 1)]),
    }
}

/// The first greatest key and its index, lane by lane.
#[derive(Clone, Copy)]
struct FirstMax {
    keys: [f64; LANES],
    /// As numbers of the same size as the keys, which the compiler turns into vectors.
    indices: [f64; LANES],
}

impl FirstMax {
    const NONE: Self = Self { keys: [f64::NEG_INFINITY; LANES], indices: [0.0; LANES] };

    /// Keys of the indices from `i` on.
    #[inline(always)]
    fn see(&mut self, i: usize, keys: [f64; LANES]) {
        let own = self.keys.iter_mut().zip(&mut self.indices);
        for (l, ((own, index), key)) in own.zip(keys).enumerate() {
            let is_greater = key > *own;
            *own = if is_greater { key } else { *own };
            *index = if is_greater { (i + l) as f64 } else { *index };
        }
    }

    /// The greatest key and its first index.
    fn get(&self) -> (f64, usize) {
        let better = |best: usize, l: usize| match self.keys[l].total_cmp(&self.keys[best]) {
            Ordering::Greater => l,
            Ordering::Equal if self.indices[l] < self.indices[best] => l,
            _ => best,
        };
        let lane = (1..LANES).fold(0, better);
        (self.keys[lane], self.indices[lane] as usize)
    }
}

/// The first index of the greatest number; 0 if there is none.
#[inline(always)]
pub fn first_max(numbers: &[f64]) -> usize {
    first_max_of(numbers, |x| x)
}

/// The first index of the least number; 0 if there is none.
#[inline(always)]
pub fn first_min(numbers: &[f64]) -> usize {
    first_max_of(numbers, |x| -x)
}

#[inline(always)]
fn first_max_of(numbers: &[f64], key: impl Fn(f64) -> f64) -> usize {
    let mut best = FirstMax::NONE;
    for i in (0..numbers.len()).step_by(LANES) {
        best.see(i, lanes(numbers, i).map(&key));
    }
    best.get().1.min(numbers.len().saturating_sub(1))
}

/// The least and the greatest number.
#[inline(always)]
pub fn range(numbers: &[f64]) -> (f64, f64) {
    let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
    for i in (0..numbers.len()).step_by(LANES) {
        let numbers: [f64; LANES] = lanes(numbers, i);
        for l in 0..LANES {
            low[l] = if numbers[l] < low[l] { numbers[l] } else { low[l] };
            high[l] = if numbers[l] > high[l] { numbers[l] } else { high[l] };
        }
    }
    (low.into_iter().fold(f64::INFINITY, f64::min), high.into_iter().fold(f64::NEG_INFINITY, f64::max))
}

/// The greatest distance of a point from their centre, and the indices of the extremes. The
/// coordinates of the points are relative to their centre.
#[inline(always)]
fn extremes(points: [&[f64]; 3]) -> (f64, Vec<usize>) {
    let mut extremes = Vec::with_capacity(6);
    let mut axes: Vec<DVec3> = Vec::with_capacity(3);
    let count = points[0].len();
    let mut farthest = FirstMax::NONE;
    for i in (0..count).step_by(LANES) {
        farthest.see(i, squares(&points.map(|column| lanes(column, i))));
    }
    let length = farthest.get().0.max(0.0).sqrt();
    while axes.len() < 3 {
        let i = farthest.get().1.min(count - 1);
        let point = DVec3::from(points.map(|column| column[i]));
        let reach = axes.iter().fold(point, |p, &axis| p - p.dot(axis) * axis);
        if reach.length() <= FLAT * length {
            break;
        }
        let axis = reach.normalize();
        axes.push(axis);
        let [mut front, mut back] = [FirstMax::NONE; 2];
        farthest = FirstMax::NONE;
        for i in (0..count).step_by(LANES) {
            let mut rest = points.map(|column| lanes(column, i));
            let along = dots(&rest, axis);
            front.see(i, along);
            back.see(i, along.map(|x| -x));
            for axis in &axes {
                let along = dots(&rest, *axis);
                for (row, axis) in rest.iter_mut().zip(axis.to_array()) {
                    for l in 0..LANES {
                        row[l] -= along[l] * axis;
                    }
                }
            }
            farthest.see(i, squares(&rest));
        }
        extremes.extend([front.get().1, back.get().1].map(|i| i.min(count - 1)));
    }
    (length, extremes)
}

#[inline(always)]
fn dots(points: &[[f64; LANES]; 3], axis: DVec3) -> [f64; LANES] {
    std::array::from_fn(|l| points[0][l] * axis.x + points[1][l] * axis.y + points[2][l] * axis.z)
}

#[inline(always)]
fn squares(points: &[[f64; LANES]; 3]) -> [f64; LANES] {
    std::array::from_fn(|l| (0..3).map(|c| points[c][l] * points[c][l]).sum())
}
