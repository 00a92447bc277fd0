//! Minima that have a closed form: of a point in the field of a simple shape, and of a part that is
//! large, or flat, over a plane. They are those of the search, bit for bit. And parts that have
//! none.
use glam::DVec3;

use crate::collide::bodies::surface::{Part, PartFacing};
use crate::collide::mode::Mode;
use crate::collide::narrow::extremes::{OPPOSES, is_level};
use crate::collide::narrow::{Minimum, Search};
use crate::collide::scene::simple::Simple;
use crate::geometry::Aabb;

/// Lengths that differ by less than this part of the largest number may be equal.
const CLEAR: f64 = 1e-12;

/// Finds the minima of a part that are within the reach of `search`, as [`Search::minima`] does.
/// Returns whether there is a closed form; if not, nothing is found.
pub fn minima(
    simple: Simple,
    search: &Search,
    mode: Mode,
    part: &Part,
    found: &mut impl FnMut(Minimum),
) -> bool {
    let reach = search.reach + part.radius;
    if !matches!(simple, Simple::Plane) && is_beyond(simple, part, reach) {
        return true;
    }
    match (part.points(), simple) {
        (&[point], _) => {
            let minimum = at(simple, part, point, true);
            if minimum.value.distance <= reach {
                found(minimum);
            }
            true
        }
        (_, Simple::Plane) if search.is_of_faces() && matches!(mode, Mode::Exact(_)) => {
            over_plane(search, part, reach, found)
        }
        _ => false,
    }
}

/// Whether the box around a simple shape shows that no point of the part is within reach: the boxes
/// of both are apart, or the shape lies in front of the plane of the part. So most faces of two
/// boxes that touch need no search.
fn is_beyond(simple: Simple, part: &Part, reach: f64) -> bool {
    let (own, bounds) = (Aabb::of(part.points()), simple.bounds());
    let size = own.max.max(-own.min).max(bounds.max).max_element();
    let clear = reach.max(0.0) + CLEAR * size;
    if own.gap(bounds).length_squared() > clear * clear {
        return true;
    }
    let lowest = -part.normal.abs().dot(bounds.max);
    lowest - part.normal.dot(part.points()[0]) > clear
}

/// The minima over the plane z = 0 of a large segment or triangle, or of a small triangle whose corners
/// are equally high up to the tolerance: the lowest point, and where the part looks at the plane its
/// other corners. Returns `false` for parts that the search has to move into reach, or whose normal may
/// be that of the other side.
fn over_plane(search: &Search, part: &Part, reach: f64, found: &mut impl FnMut(Minimum)) -> bool {
    let points = part.points();
    let is_triangle = points.len() == 3;
    let is_large = search.is_large(part);
    // The extremes of a triangle are where the plane opposes it.
    let has_extremes = !is_triangle || part.normal.z < OPPOSES;
    let is_known = part.normal != DVec3::ZERO && part.facing == PartFacing::Everywhere;
    if !(if is_triangle { is_known && (is_large || has_extremes) } else { is_large }) {
        return false;
    }
    let lower = |p: DVec3, q: DVec3| if q.z < p.z { q } else { p };
    let lowest = points[1..].iter().fold(points[0], |p, q| lower(p, *q));
    if lowest.z > reach {
        return true;
    }
    let is_flat = || {
        let edges = (0..points.len()).map(|k| points[(k + 1) % points.len()] - points[k]);
        let longest = edges.map(|edge| edge.length_squared()).fold(0.0, f64::max);
        let slope = DVec3::Z.reject_from_normalized(part.normal).length();
        points.iter().all(|p| p.z <= lowest.z + search.tolerance)
            && is_level(slope, longest.sqrt(), search.tolerance)
    };
    let is_corner = |p: &DVec3| if is_large { p.z <= reach } else { true };
    if is_triangle && has_extremes && !if is_large { points.iter().all(is_corner) } else { is_flat() } {
        return false;
    }
    found(at(Simple::Plane, part, lowest, true));
    let extremes = points.iter().filter(|p| has_extremes && **p != lowest && is_corner(p));
    extremes.for_each(|p| found(at(Simple::Plane, part, *p, false)));
    true
}

fn at(simple: Simple, part: &Part, point: DVec3, is_lowest: bool) -> Minimum {
    let corner = part.points().iter().position(|p| *p == point).map(|k| k as u8);
    Minimum { point, value: simple.value(point), cell: None, converged: true, corner, is_lowest }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use glam::DQuat;

    use super::*;
    use crate::collide::bodies::field::{Field, FieldBody};
    use crate::collide::detect::ordered_pair::OrderedPair;
    use crate::collide::mode::ContactsPer;
    use crate::collide::options::CollideOptions;
    use crate::collide::scene::pose::Pose;
    use crate::collide::scene::shape::Shape;
    use crate::collide::scene::{Instance, Scene};
    use crate::testing::random;

    type Bits = ([u64; 8], Option<u8>, bool, bool);

    /// All numbers of a minimum, which an order of the minima of a part may depend on.
    fn bits(m: &Minimum) -> Bits {
        let [p, n] = [m.point, m.value.gradient].map(|v| v.to_array());
        let all = [p[0], p[1], p[2], n[0], n[1], n[2], m.value.distance, m.value.closest_point.z];
        // Zeros of both signs are equal.
        (all.map(|x| (x + 0.0).to_bits()), m.corner, m.is_lowest, m.converged)
    }

    #[test]
    fn closed_forms_are_the_minima_of_the_search() {
        let mut k = 1;
        let (mut closed, mut searched, mut contacts) = (0, 0, 0);
        for case in 0..3000 {
            let mut size = || 0.2 + random(&mut k);
            let shapes = [
                Shape::Box { half_extents: DVec3::new(size(), size(), size()) },
                Shape::Sphere { radius: size() },
                Shape::Capsule { half_height: size(), radius: size() },
            ];
            let (shape, field) =
                (&shapes[case % 3], [Shape::Plane, shapes[case / 3 % 3].clone()][case / 9 % 2].clone());
            let mut number = || random(&mut k);
            let axis = DVec3::new(number(), number(), number()) - 0.5;
            // Some lie flat, some nearly.
            let angle = [0.0, 0.25 * TAU, 1e-9 * number(), 0.1 * number(), TAU * number()][case % 5];
            let tilt = DQuat::from_axis_angle(if case % 2 == 0 { DVec3::X } else { axis.normalize() }, angle);
            let pose = Pose { rotation: tilt, translation: DVec3::new(number(), number(), 1.4 * number()) };
            let turned = DQuat::from_axis_angle(axis.normalize(), if case % 4 == 0 { 1.0 } else { 0.0 });
            let world = Pose { rotation: turned, translation: axis };
            let mut scene = Scene::new();
            let ids = [(shape.clone(), world.after(pose)), (field.clone(), world)].map(|(shape, pose)| {
                let shape = scene.add_shape(shape).expect("valid sizes");
                scene.add(Instance::new(shape, pose)).expect("a valid pose")
            });
            let mode = match case % 7 {
                0 => Mode::Node,
                1 => Mode::exact(),
                2 => Mode::exact().per(ContactsPer::Cell),
                3 => Mode::face().per(ContactsPer::Minimum),
                _ => Mode::exact().per(ContactsPer::Minimum),
            };
            let options = CollideOptions { mode, contact_distance: 0.2, ..CollideOptions::default() };
            let pair =
                OrderedPair::new(&scene, &options, ids[0], ids[1], 0.2).expect("instances of the scene");
            let simple = Simple::from(&field);
            for candidate in pair.candidates() {
                let (part, ..) = pair.part(candidate);
                let search = pair.search_of([&part]);
                let (mut found, mut expected) = (Vec::new(), Vec::new());
                if !minima(simple, &search, mode, &part, &mut |m| found.push(bits(&m))) {
                    assert!(found.is_empty());
                    searched += 1;
                    continue;
                }
                search.minima(&pair.field, &part, None, &mut |_| (), &mut |_, m| expected.push(bits(&m)));
                found.sort_unstable();
                expected.sort_unstable();
                assert_eq!(found, expected, "case {case}, part {candidate}");
                (closed, contacts) = (closed + 1, contacts + found.len());
            }
        }
        assert!(closed > 5000 && searched > 500 && contacts > 1500, "{closed} {searched} {contacts}");
    }

    /// Small and large triangles over a plane: level, nearly so, tilted, needles, turned over, and such
    /// whose other side may be outside.
    #[test]
    fn flat_parts_have_the_minima_of_the_search() {
        let mut k = 1;
        let field = FieldBody::in_own_frame(Field::Simple(Simple::Plane));
        let options = CollideOptions { mode: Mode::exact(), ..CollideOptions::default() };
        let searches = [100.0, 1.0].map(|diagonal| Search::new(&options, 0.2, &field, [diagonal; 2]));
        let (mut closed, mut searched, mut contacts) = (0, 0, 0);
        for case in 0..4000 {
            let search = &searches[case / 60 % 2];
            let mut number = || random(&mut k);
            let tilt = [0.0, 1e-17, 0.1, 0.5, 3.0][case % 5] * search.tolerance;
            let wide = [1.0, 0.1, 1e-3][case / 5 % 3];
            let height = 0.4 * number() - 0.1;
            let mut corner = || DVec3::new(number(), wide * number(), height + tilt * number());
            let mut corners = [corner(), corner(), corner()];
            let is_up = (corners[1] - corners[0]).cross(corners[2] - corners[0]).z > 0.0;
            if is_up != (case % 11 == 0) {
                corners.swap(1, 2);
            }
            let mut part = Part::new(&corners, 0.0);
            if case % 7 == 0 {
                part.facing = PartFacing::AtCenter;
            }
            let (mut found, mut expected) = (Vec::new(), Vec::new());
            if !minima(Simple::Plane, search, Mode::exact(), &part, &mut |m| found.push(bits(&m))) {
                assert!(found.is_empty());
                searched += 1;
                continue;
            }
            search.minima(&field, &part, None, &mut |_| (), &mut |_, m| expected.push(bits(&m)));
            found.sort_unstable();
            expected.sort_unstable();
            assert_eq!(found, expected, "case {case}");
            (closed, contacts) = (closed + 1, contacts + found.len());
        }
        assert!(closed > 2000 && searched > 500 && contacts > 3000, "{closed} {searched} {contacts}");
    }
}
