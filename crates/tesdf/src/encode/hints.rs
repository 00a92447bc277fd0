//! How the closest feature tells the sign, where there is no doubt.

use std::cell::Cell;

use glam::DVec3;

use super::surface::Surface;
use crate::asset::layout::{SignHint, SignHints};
use crate::geometry::{Aabb, AabbTree, Triangle};

/// Whether the mesh meets itself or folds in ways that need the winding number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Simplicity {
    /// No self-intersections, all edges and vertices manifold, no duplicate or flat faces.
    Simple,
    /// Any other mesh.
    Involved,
}

/// Sheets that are nearer to each other than this (local frame) are left to the winding number,
/// because `f32` storage could take one sheet for the other. It is twenty times the error of `f32`.
const THIN: f64 = 2e-6;
/// A face whose height is a smaller share of its length than this has no reliable normal in `f32`.
const SLIVER: f64 = 1e-5;
/// Cosine of the largest angle between the normals of two faces at which the plane of either face
/// tells the sign.
///
/// The direction from the feature to the point lies between the normals, so its angle to either
/// normal is at most the angle between them, 60 degrees. The sine that is left is far above any
/// rounding.
const FLAT: f64 = 0.5;
/// Two faces at one vertex that come this near to each other on the unit sphere around the vertex
/// count as folded.
const NARROW: f64 = 0.3;
/// Cosine beyond which two faces fold back onto each other: blades of less than 37 degrees.
///
/// For a blade of 9 degrees, `f32` storage took one side for the other up to 4e-6 × diagonal away.
/// From 20 degrees on this never happened beyond 1e-6.
const FOLDED: f64 = -0.8;

/// The hints of all faces. See "The sign rule" in `docs/math.md`.
pub fn sign_hints(surface: &Surface, tree: &AabbTree, simplicity: Simplicity) -> Vec<SignHints> {
    use crate::parallel::*;
    if simplicity == Simplicity::Involved {
        return vec![SignHints::default(); surface.faces.len()];
    }
    let fans = large_fans(surface);
    let delicate: Vec<bool> =
        (0..surface.faces.len()).into_par_iter().map(|f| is_delicate(surface, tree, &fans, f)).collect();
    let corners: Vec<Corner> =
        (0..surface.vertex_count() as u32).into_par_iter().map(|v| corner(surface, v, &delicate)).collect();
    (0..surface.faces.len() as u32)
        .into_par_iter()
        .map(|face| {
            let mut hints = SignHints::default();
            if delicate[face as usize] {
                return hints;
            }
            hints.set(0, SignHint::Plane);
            for k in 0..3 {
                hints.set(1 + k, edge_hint(surface, face, k, &delicate));
                hints.set(4 + k, vertex_hint(surface, face, k, &corners));
            }
            hints
        })
        .collect()
}

/// What is known of a face from those of its corners that have more than [`MAX_RING`] faces,
/// without a comparison of pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LargeFan {
    /// It has no such corner.
    None,
    /// No two faces around this vertex fold back onto each other.
    Open(u32),
    /// Faces around such a corner may fold back onto each other.
    MayFold,
}

/// Cosine of the angle of all normals to their middle up to which no two of them are as far apart
/// as [`FOLDED`]: 71.3 degrees, half of 142.7.
const OPEN: f64 = 0.32;

fn large_fans(surface: &Surface) -> Vec<LargeFan> {
    let mut fans = vec![LargeFan::None; surface.faces.len()];
    for vertex in 0..surface.vertex_count() as u32 {
        let around = surface.vertex_faces(vertex);
        if around.len() <= MAX_RING {
            continue;
        }
        let normal = |&f: &u32| surface.triangles[f as usize].normal;
        let middle = around.iter().map(normal).sum::<DVec3>().normalize_or_zero();
        let fan = match around.iter().all(|f| normal(f).dot(middle) > OPEN) {
            true => LargeFan::Open(vertex),
            false => LargeFan::MayFold,
        };
        for &face in around {
            let known = &mut fans[face as usize];
            if fan == LargeFan::MayFold || *known == LargeFan::None {
                *known = fan;
            }
        }
    }
    fans
}

/// Whether a face is a sliver, or so near to another sheet that rounding could confuse the two.
fn is_delicate(surface: &Surface, tree: &AabbTree, fans: &[LargeFan], face: usize) -> bool {
    let fan = fans[face];
    let triangle = &surface.triangles[face];
    let [a, b, c] = triangle.corners;
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    let height = (b - a).cross(c - a).length() / longest;
    if height < SLIVER * longest || height < THIN || fan == LargeFan::MayFold {
        return true;
    }
    let corners = surface.faces[face];
    let reach = Aabb::of(&triangle.corners).grown(THIN);
    let delicate = Cell::new(false);
    tree.visit(
        |bounds| !delicate.get() && bounds.overlaps(reach),
        |leaf| {
            for &other in leaf {
                // Most of the boxes around the faces of a large fan overlap.
                let same_fan = fan != LargeFan::None && fans[other as usize] == fan;
                if same_fan || other as usize == face {
                    continue;
                }
                let o = &surface.triangles[other as usize];
                let shared = surface.faces[other as usize].iter().filter(|v| corners.contains(v)).count();
                let cosine = triangle.normal.dot(o.normal);
                let found = match shared {
                    0 => Aabb::of(&o.corners).overlaps(reach) && within(triangle, o, THIN),
                    1 => cosine < FOLDED && narrow_fold(surface, face, other as usize),
                    _ => cosine < FOLDED,
                };
                delicate.set(delicate.get() || found);
            }
        },
    );
    delicate.get()
}

/// Whether two faces that share one vertex come within some 17 degrees of each other beside the
/// vertex.
fn narrow_fold(surface: &Surface, face: usize, other: usize) -> bool {
    let (f, o) = (surface.faces[face], surface.faces[other]);
    let Some(v) = f.iter().find(|v| o.contains(v)) else { return false };
    // The directions from the vertex to the face, as a triangle with its corners on the unit
    // sphere.
    let sector = |which: usize, corners: [u32; 3]| {
        let t = &surface.triangles[which];
        let k = corners.iter().position(|c| c == v).unwrap_or(0);
        let at = |i: usize| (t.corners[(k + i) % 3] - t.corners[k]).normalize_or_zero();
        Triangle::new([at(1), at(2), (at(1) + at(2)).normalize_or_zero()])
    };
    within(&sector(face, f), &sector(other, o), NARROW)
}

/// Whether two triangles come within `distance`. May say yes where they do not.
fn within(a: &Triangle, b: &Triangle, distance: f64) -> bool {
    let edges = |t: &Triangle| {
        [t.corners[1] - t.corners[0], t.corners[2] - t.corners[1], t.corners[0] - t.corners[2]]
    };
    let (ea, eb) = (edges(a), edges(b));
    let separated = |axis: DVec3| {
        let span = |t: &Triangle| {
            t.corners
                .iter()
                .map(|c| c.dot(axis))
                .fold((f64::INFINITY, f64::NEG_INFINITY), |s, x| (s.0.min(x), s.1.max(x)))
        };
        let (sa, sb) = (span(a), span(b));
        (sa.0 - sb.1).max(sb.0 - sa.1) > distance * axis.length()
    };
    !(separated(a.normal)
        || separated(b.normal)
        || ea.iter().any(|&e| eb.iter().any(|&g| separated(e.cross(g))))
        || ea.iter().any(|&e| separated(e.cross(a.normal)))
        || eb.iter().any(|&e| separated(e.cross(b.normal))))
}

fn edge_hint(surface: &Surface, face: u32, k: usize, delicate: &[bool]) -> SignHint {
    let [f, g] = surface.edge_faces(surface.edges[face as usize][k]) else { return SignHint::Winding };
    let other = if *f == face { *g } else { *f };
    // The normal of a sliver may be noise, and its other edges are as near as this one.
    if delicate[other as usize] {
        return SignHint::Winding;
    }
    let (t, o) = (&surface.triangles[face as usize], &surface.triangles[other as usize]);
    let cosine = t.normal.dot(o.normal);
    if cosine > FLAT {
        return SignHint::Plane;
    }
    if cosine < FOLDED {
        return SignHint::Winding;
    }
    // The edge is convex when the far corner of the other face lies behind this face.
    let a = t.corners[k];
    let apex = o
        .corners
        .iter()
        .map(|&c| t.normal.dot(c - a))
        .fold(0.0, |m: f64, h| if h.abs() > m.abs() { h } else { m });
    if apex < 0.0 { SignHint::Outside } else { SignHint::Inside }
}

/// Slack of "on or below" for the ring of a vertex, as a share of the length of the ring's edge.
const RING: f64 = 1e-12;

/// The shape of the surface around a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Corner {
    /// Some faces are delicate, or there are more than [`MAX_RING`].
    Unknown,
    /// Every face lies on or below the planes of the others.
    Convex,
    /// The same with inside and outside swapped.
    Concave,
    /// Any other shape.
    Other,
}

/// A vertex with more faces than this is left to the winding number, because finding its shape
/// compares pairs of faces.
const MAX_RING: usize = 1024;

fn corner(surface: &Surface, vertex: u32, delicate: &[bool]) -> Corner {
    let around = surface.vertex_faces(vertex);
    if around.len() > MAX_RING || around.iter().any(|&f| delicate[f as usize]) {
        return Corner::Unknown;
    }
    // The heights of all ring vertices over all planes around the vertex.
    let (mut below, mut above) = (true, true);
    for &f in around {
        let t = &surface.triangles[f as usize];
        let k = surface.faces[f as usize].iter().position(|&v| v == vertex).unwrap_or(0);
        let apex = t.corners[k];
        for &g in around {
            for c in surface.triangles[g as usize].corners {
                let height = t.normal.dot(c - apex);
                let slack = RING * (c - apex).length();
                below &= height <= slack;
                above &= height >= -slack;
            }
        }
        if !below && !above {
            break;
        }
    }
    match (below, above) {
        (true, false) => Corner::Convex,
        (false, true) => Corner::Concave,
        _ => Corner::Other,
    }
}

fn vertex_hint(surface: &Surface, face: u32, k: usize, corners: &[Corner]) -> SignHint {
    let vertex = surface.faces[face as usize][k];
    let shape = corners[vertex as usize];
    if shape == Corner::Unknown {
        return SignHint::Winding;
    }
    let normal = surface.triangles[face as usize].normal;
    let mut around = surface.vertex_faces(vertex).iter();
    if around.all(|&f| surface.triangles[f as usize].normal.dot(normal) > FLAT) {
        return SignHint::Plane;
    }
    match shape {
        Corner::Convex => SignHint::Outside,
        Corner::Concave => SignHint::Inside,
        _ => SignHint::Winding,
    }
}
