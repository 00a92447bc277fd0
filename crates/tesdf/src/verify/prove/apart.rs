//! Decides whether a face and a tetrahedron are apart.
use glam::DVec3;
use robust::{Coord3D, orient3d};

/// The sides of a tetrahedron, each with the opposite corner.
const SIDES: [([usize; 3], usize); 4] = [([1, 2, 3], 0), ([0, 2, 3], 1), ([0, 1, 3], 2), ([0, 1, 2], 3)];

/// Whether some direction shows a gap of more than `gap`. `error` bounds the rounding error of
/// heights near the cell.
///
/// Two convex polyhedra without a common point are separated by a plane that is parallel to a side
/// of one of them, or to an edge of each. Only these directions are tried. A gap in any direction
/// is a proof, so the rounding of a direction does no harm.
pub fn are_apart(cell: &[DVec3; 4], face: &[DVec3; 3], gap: f64, error: f64) -> bool {
    let [a, b, c] = *face;
    let edges = [b - a, c - b, a - c];
    let normal = edges[0].cross(edges[1]);
    let [p, q, r, s] = *cell;
    let of_cell = [q - p, r - p, s - p, r - q, s - q, s - r];
    let sides = SIDES.map(|([i, j, k], _)| (cell[j] - cell[i]).cross(cell[k] - cell[i]));
    let in_plane = edges.map(|e| e.cross(normal));
    let crossed = edges.iter().flat_map(|&e| of_cell.iter().map(move |&f| e.cross(f)));
    let mut directions = sides.into_iter().chain([normal]).chain(in_plane).chain(crossed);
    directions.any(|direction| {
        let Some(unit) = direction.try_normalize() else { return false };
        let span = |points: &[DVec3]| {
            points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
                let height = unit.dot(*p);
                (low.min(height), high.max(height))
            })
        };
        let ((low, high), (least, most)) = (span(cell), span(face));
        (low - most).max(least - high) > gap + 2.0 * error
    })
}

/// Whether a face does not meet the interior of a tetrahedron that is not flat. They may share
/// corners. The result is exact.
///
/// It tries the planes through three of the seven corners, with the tetrahedron on one side and the
/// face on the other, borders included. These are enough. The planes `n·x = d` that separate the
/// corners in this way are a convex cone of `(n, d)`. It contains no line, because the tetrahedron
/// is not flat. So if there is such a plane, there is one on an extreme ray of the cone. There
/// three corners that are not collinear have `n·x = d`.
pub fn is_beside(cell: &[DVec3; 4], face: &[DVec3; 3]) -> bool {
    let of_sides = SIDES.iter().map(|(side, _)| side.map(|k| cell[k]));
    let edges_of_cell = (0..4).flat_map(|j| (0..j).map(move |i| [cell[i], cell[j]]));
    let mixed = edges_of_cell.flat_map(|[p, q]| face.map(|a| [p, q, a]));
    let edges_of_face = (0..3).map(|k| [face[k], face[(k + 1) % 3]]);
    let mixed = mixed.chain(edges_of_face.flat_map(|[a, b]| cell.map(|p| [a, b, p])));
    of_sides.chain([*face]).chain(mixed).any(|[a, b, c]| {
        let side = |p: &DVec3| orientation(a, b, c, *p);
        let (mut of_cell, mut of_face) = (cell.map(|p| side(&p)), face.map(|p| side(&p)));
        if of_cell.iter().any(|&s| s < 0) {
            of_cell = of_cell.map(|s| -s);
            of_face = of_face.map(|s| -s);
        }
        // A cell with corners on both sides of the plane would have interior points on both sides.
        of_cell.iter().any(|&s| s > 0) && of_cell.iter().all(|&s| s >= 0) && of_face.iter().all(|&s| s <= 0)
    })
}

/// A point of a face that lies in a tetrahedron up to rounding; `None` when none is found.
pub fn common_point(cell: &[DVec3; 4], face: &[DVec3; 3]) -> Option<DVec3> {
    let mut polygon = face.to_vec();
    for ([i, j, k], opposite) in SIDES {
        let normal = (cell[j] - cell[i]).cross(cell[k] - cell[i]);
        let height = |p: DVec3| normal.dot(p - cell[i]);
        let inner = height(cell[opposite]).signum();
        let mut kept = Vec::new();
        for (n, &p) in polygon.iter().enumerate() {
            let q = polygon[(n + 1) % polygon.len()];
            let (at_p, at_q) = (inner * height(p), inner * height(q));
            if at_p >= 0.0 {
                kept.push(p);
            }
            if at_p * at_q < 0.0 {
                kept.push(p + at_p / (at_p - at_q) * (q - p));
            }
        }
        polygon = kept;
    }
    let count = polygon.len() as f64;
    (!polygon.is_empty()).then(|| polygon.iter().sum::<DVec3>() / count)
}

/// Exact sign of the determinant of `a - d`, `b - d`, `c - d`.
pub fn orientation(a: DVec3, b: DVec3, c: DVec3, d: DVec3) -> i32 {
    let coord = |p: DVec3| Coord3D { x: p.x, y: p.y, z: p.z };
    let value = orient3d(coord(a), coord(b), coord(c), coord(d));
    i32::from(value > 0.0) - i32::from(value < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Random;

    const CELL: [DVec3; 4] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];

    #[test]
    fn gaps_and_common_points_are_found() {
        let above = [0.1, 0.2, 0.3].map(|x| DVec3::new(x, 1.0 - x, 0.5 + x * x));
        let over = above.map(|p| p + DVec3::splat(0.2));
        assert!(are_apart(&CELL, &over, 0.1, 1e-15) && common_point(&CELL, &over).is_none());
        assert!(!are_apart(&CELL, &over, 2.0, 1e-15));
        // Faces through the middle, touching a corner, and touching a side.
        let through = [DVec3::splat(-1.0), DVec3::splat(1.0), DVec3::new(0.1, 0.3, 0.2)];
        let p = common_point(&CELL, &through).expect("they meet");
        assert!(p.cmpge(DVec3::ZERO).all() && p.element_sum() <= 1.0);
        let corner = [DVec3::Z, DVec3::new(1.0, 0.0, 2.0), DVec3::new(0.0, 1.0, 2.0)];
        for touching in [through, corner, [DVec3::X, DVec3::Y, DVec3::Z]] {
            assert!(!are_apart(&CELL, &touching, 0.0, 1e-15));
        }
    }

    #[test]
    fn faces_beside_a_cell_share_no_inner_point() {
        let outward = DVec3::new(0.3, -0.7, 0.2);
        for face in [
            [DVec3::X, DVec3::Y, DVec3::Z],
            // Faces at one edge, at one corner, and with the tip in the plane of a side.
            [DVec3::ZERO, DVec3::X, outward],
            [DVec3::Z, DVec3::new(-1.0, 0.2, 1.0), DVec3::new(0.1, -1.0, 1.2)],
            [DVec3::new(-1.0, 0.0, 0.0), DVec3::new(0.2, 0.2, 0.0), DVec3::new(0.0, 0.0, -1.0)],
        ] {
            assert!(is_beside(&CELL, &face), "{face:?}");
        }
        let inner = DVec3::splat(0.2);
        for face in [[DVec3::ZERO, DVec3::X, inner], [inner, outward, DVec3::Z], [DVec3::Z, inner, -outward]]
        {
            assert!(!is_beside(&CELL, &face), "{face:?}");
        }
    }

    type Integers = [i64; 3];

    fn minus(a: Integers, b: Integers) -> Integers {
        [0, 1, 2].map(|k| a[k] - b[k])
    }

    fn cross(a: Integers, b: Integers) -> Integers {
        [(1, 2), (2, 0), (0, 1)].map(|(i, j)| a[i] * b[j] - a[j] * b[i])
    }

    fn dot(a: Integers, b: Integers) -> i64 {
        (0..3).map(|k| a[k] * b[k]).sum()
    }

    /// Whether a plane separates them that is parallel to a side or to an edge of each, in
    /// integers: the directions of the sides of their Minkowski difference.
    fn is_beside_in_integers(cell: [Integers; 4], face: [Integers; 3]) -> bool {
        let [a, b, c] = face;
        let edges = [minus(b, a), minus(c, b), minus(a, c)];
        let of_cell: Vec<_> = (0..4).flat_map(|j| (0..j).map(move |i| minus(cell[j], cell[i]))).collect();
        let crossed = edges.iter().flat_map(|&e| of_cell.iter().map(move |&f| cross(e, f)));
        let sides = SIDES.map(|([i, j, k], _)| cross(minus(cell[j], cell[i]), minus(cell[k], cell[i])));
        let directions = crossed.chain(sides).chain([cross(edges[0], edges[1])]).filter(|d| *d != [0; 3]);
        let mut signed = directions.flat_map(|d| [d, minus([0; 3], d)]);
        signed.any(|d| {
            let high = face.iter().map(|&p| dot(d, p)).max();
            high <= cell.iter().map(|&p| dot(d, p)).min()
        })
    }

    /// Corners on a small lattice share points, edges and planes, and faces without area are among
    /// them.
    #[test]
    fn whether_a_face_is_beside_a_cell_is_decided_as_in_integers() {
        let mut counts = [0; 2];
        let mut index = 0;
        while counts[0] < 3000 || counts[1] < 3000 {
            let random = &mut Random::new(5, index);
            index += 1;
            let side = 2 + random.below(5);
            let mut point = || [0; 3].map(|_: i64| random.below(side) as i64);
            let (cell, face): ([Integers; 4], [Integers; 3]) =
                ([0; 4].map(|_| point()), [0; 3].map(|_| point()));
            let of = |p: Integers| DVec3::from_array(p.map(|x| x as f64 / 8.0));
            let (local, of_face) = (cell.map(of), face.map(of));
            let [a, b, c, d] = local;
            if orientation(a, b, c, d) == 0 {
                continue;
            }
            let expected = is_beside_in_integers(cell, face);
            assert_eq!(is_beside(&local, &of_face), expected, "{cell:?} {face:?}");
            counts[usize::from(expected)] += 1;
        }
    }
}
