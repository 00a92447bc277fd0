//! The normals of the faces of a mesh around a place.
use glam::DVec3;

use super::cone::{Normals, SAME};
use crate::TeSdf;
use crate::asset::corner_cones::CONVEX;
use crate::geometry::Triangle;

/// A place with more faces is left as it is.
pub const MOST_FACES: usize = 64;

/// The surroundings of a vertex must be clear up to this multiple of the limit of a place.
pub const CLEAR: f64 = 4.0;

/// On a side, the vertices must be farther than this multiple of the limit.
pub const BESIDE: f64 = 1e3;

/// The different normals of the faces within `limit` of a place, from a face on, in the unit of the
/// mesh.
pub fn around(asset: &TeSdf, at: DVec3, limit: f64, face: u32) -> Option<Normals> {
    if !(asset.faces_enclose_the_solid() && asset.faces_look_outward()) {
        return None;
    }
    let first = triangle(asset, face);
    if is_on_inside(&first, at, limit) {
        return Some([first.normal].into_iter().collect());
    }
    match known_around(asset, at, limit, (face, &first)) {
        Some(known) => known,
        None => searched_around(asset, at, limit, (face, &first)),
    }
}

fn triangle(asset: &TeSdf, face: u32) -> Triangle {
    let normal = asset.local_triangle(face as usize).normal;
    Triangle::from_parts(asset.face_corners(face as usize), normal, false)
}

/// As [`around`], at a vertex or a side of a face with clear surroundings; `None` elsewhere.
fn known_around(
    asset: &TeSdf,
    at: DVec3,
    limit: f64,
    (face, first): (u32, &Triangle),
) -> Option<Option<Normals>> {
    let cones = asset.corner_cones();
    let vertices = asset.face_vertices(face as usize);
    let clear = vertices.map(|vertex| f64::from(cones[vertex as usize]));
    let near = first.corners.map(|corner| corner.distance(at));
    if let Some(k) = (0..3).find(|&k| near[k] <= limit) {
        // Nothing else is within the limit of a place that is within it of the vertex.
        if clear[k].abs() <= CLEAR * limit {
            return None;
        }
        let fan = asset.faces_at(vertices[k]);
        let normals = || different(fan.iter().map(|&face| asset.local_triangle(face as usize).normal));
        return Some(if clear[k] > 0.0 { normals() } else { flat(normals()?) });
    }
    // Far from vertices without needles, a side has two faces.
    if (0..3).any(|k| clear[k] == 0.0 || near[k] <= BESIDE * limit) {
        return None;
    }
    let height = |k: usize| {
        let (start, side) = (first.corners[k], first.corners[(k + 1) % 3] - first.corners[k]);
        first.normal.cross(side).dot(at - start) / side.length()
    };
    let mut sides = (0..3).filter(|&k| height(k) <= limit);
    let (Some(side), None) = (sides.next(), sides.next()) else { return None };
    let mut others = asset.faces_beside(face as usize, side);
    let (Some(other), None) = (others.next(), others.next()) else { return None };
    let both = [*first, triangle(asset, other as u32)];
    Some(convex(&both))
}

/// As [`around`], by a search over the faces that have common vertices.
fn searched_around(asset: &TeSdf, at: DVec3, limit: f64, (face, first): (u32, &Triangle)) -> Option<Normals> {
    let (mut found, mut next, mut seen) = (vec![*first], vec![face], vec![face]);
    while let Some(face) = next.pop() {
        for vertex in asset.face_vertices(face as usize) {
            for &other in asset.faces_at(vertex) {
                if seen.contains(&other) {
                    continue;
                }
                seen.push(other);
                let triangle = triangle(asset, other);
                if triangle.closest(at).distance <= limit {
                    found.push(triangle);
                    next.push(other);
                }
            }
        }
        if found.len() > MOST_FACES {
            return None;
        }
    }
    convex(&found)
}

/// The different normals of faces that have a place in common; `None` where they are not convex.
fn convex(faces: &[Triangle]) -> Option<Normals> {
    let normals = different(faces.iter().map(|triangle| triangle.normal))?;
    let is_convex = |&Triangle { corners: [first, ..], normal, .. }: &Triangle| {
        let corners = faces.iter().flat_map(|other| other.corners);
        corners.map(|p| p - first).all(|way| way.dot(normal) <= CONVEX * way.length())
    };
    (normals.len() < 2 || faces.iter().all(is_convex)).then_some(normals)
}

/// The different ones of some normals; `None` of more than [`MOST`](super::cone::MOST).
fn different(all: impl Iterator<Item = DVec3>) -> Option<Normals> {
    let mut normals = Normals::new();
    for normal in all.filter(|n| *n != DVec3::ZERO) {
        if normals.iter().all(|n| n.distance(normal) > SAME) {
            normals.try_push(normal).ok()?;
        }
    }
    Some(normals)
}

/// The normal of faces in one plane.
fn flat(normals: Normals) -> Option<Normals> {
    (normals.len() < 2).then_some(normals)
}

/// Whether a place is farther than `limit` from all sides of a face.
fn is_on_inside(&Triangle { corners, normal, .. }: &Triangle, at: DVec3, limit: f64) -> bool {
    (0..3).all(|k| {
        let side = corners[(k + 1) % 3] - corners[k];
        normal.cross(side).dot(at - corners[k]) > limit * side.length()
    })
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::encode::{Encoder, Preset};
    use crate::mesh::{SolidMesh, TriangleMesh};

    /// A torus of 12 × 8 quads, which is convex outside and a saddle inside.
    fn torus() -> TeSdf {
        let (n, m) = (12u32, 8u32);
        let vertex = |k: u32| {
            let (around, across) =
                (TAU * f64::from(k / m) / f64::from(n), TAU * f64::from(k % m) / f64::from(m));
            let radius = 1.0 + 0.4 * across.cos();
            DVec3::new(radius * around.cos(), radius * around.sin(), 0.4 * across.sin())
        };
        let quad = |k: u32| {
            let at = |i: u32, j: u32| (k / m + i) % n * m + (k % m + j) % m;
            [[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]]
        };
        let mesh = TriangleMesh::new((0..n * m).map(vertex).collect(), (0..n * m).flat_map(quad).collect());
        let solid = SolidMesh::new(mesh.expect("valid ids")).expect("a closed surface");
        Encoder::new().preset(Preset::Fast).encode(&solid).expect("a torus")
    }

    #[test]
    fn known_surroundings_are_those_of_the_search() {
        let asset = torus();
        let limit = 1e-6;
        let (mut known, mut cones) = (0, 0);
        for face in 0..asset.face_count() as u32 {
            let first = triangle(&asset, face);
            let [a, b, c] = first.corners;
            for at in [
                a,
                b + 0.7 * limit * first.normal,
                0.3 * a + 0.7 * b,
                0.5 * (b + c) - 0.5 * limit * first.normal,
                a + 1e-4 * (c - a),
                (a + b + c) / 3.0,
            ] {
                let searched = searched_around(&asset, at, limit, (face, &first));
                cones += usize::from(searched.as_ref().is_some_and(|normals| normals.len() > 1));
                let Some(found) = known_around(&asset, at, limit, (face, &first)) else { continue };
                known += 1;
                let [found, searched] = [found, searched].map(Option::unwrap_or_default);
                let is_among = |n: &DVec3| searched.iter().any(|other| other.distance(*n) <= SAME);
                let is_same = found.len() == searched.len() && found.iter().all(is_among);
                assert!(is_same, "face {face}, {at}: {found:?} instead of {searched:?}");
            }
        }
        assert!(known > 700 && cones > 100, "{known} places known, {cones} cones");
    }
}
