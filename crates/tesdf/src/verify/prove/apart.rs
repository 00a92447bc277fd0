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

/// Whether a face does not meet the interior of a tetrahedron. They may share corners. `true` is
/// exact; `false` proves nothing.
///
/// It tries planes through three corners, with the tetrahedron on one side and the face on the
/// other, borders included.
pub fn is_beside(cell: &[DVec3; 4], face: &[DVec3; 3]) -> bool {
    let of_sides = SIDES.iter().map(|(side, _)| side.map(|k| cell[k]));
    let shared = (0..3).flat_map(|at| (0..4).map(move |corner| (at, corner)));
    let shared = shared.filter(|&(at, corner)| face[at] == cell[corner]);
    let through_shared = shared.flat_map(|(at, corner)| {
        let others = (0..4).filter(move |&k| k != corner);
        others.flat_map(move |k| [1, 2].map(|next| [cell[corner], cell[k], face[(at + next) % 3]]))
    });
    of_sides.chain([*face]).chain(through_shared).any(|[a, b, c]| {
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
}
