//! Cutting of polygons.
use cubecl::prelude::*;
use tesdf::collide::internal::{Parts, Polygon};
use tesdf::geometry::Triangle;
use tesdf::glam::DVec3;

use super::{device, groups_of, read, upload};
use crate::kernels::GROUP;
use crate::kernels::bodies::polygon::{ROOM, no_polygon, whole};
use crate::kernels::geometry::vector::v3;

/// Cuts of a case. Each has three heights, and 1 or −1 for the part that is kept.
const CUTS: usize = 4;
const CUT: usize = 4;

/// Cuts a face, a segment or a point per thread. `areas` gets twice the area of the result,
/// `vertices` its vertices, two numbers each.
#[cube(launch)]
fn cut_cases(
    corners: &[u32],
    heights: &[f32],
    counts: &mut [u32],
    areas: &mut [f32],
    vertices: &mut [f32],
    cases: u32,
) {
    let case = ABSOLUTE_POS as u32;
    if case < cases {
        let mut polygon = no_polygon();
        polygon.start(whole(), corners[case as usize]);
        let mut k = 0u32;
        while k < comptime!(CUTS as u32) {
            let at = (comptime!(CUT as u32) * (comptime!(CUTS as u32) * case + k)) as usize;
            polygon.cut(v3(heights[at], heights[at + 1], heights[at + 2]), heights[at + 3]);
            k += 1u32;
        }
        counts[case as usize] = polygon.count;
        areas[case as usize] = polygon.area();
        let mut i = 0u32;
        while i < polygon.count {
            let at = (2u32 * (comptime!(ROOM as u32) * case + i)) as usize;
            vertices[at] = polygon.s[i as usize];
            vertices[at + 1] = polygon.t[i as usize];
            i += 1u32;
        }
    }
}

struct Case {
    corners: u32,
    cuts: [[f32; CUT]; CUTS],
}

/// Small whole numbers, so that corners often lie in the plane of a cut; in each fourth case
/// heights between −1 and 1, in each fifth case heights that are nearly 0.
fn random_case(case: usize, random: &mut fastrand::Rng) -> Case {
    let mut height = || match case {
        _ if case.is_multiple_of(4) => 2.0 * random.f32() - 1.0,
        _ if case.is_multiple_of(5) => 1e-20 * (random.f32() - 0.5),
        _ => f32::from(random.i8(-3..=3)),
    };
    let mut cuts = [(); CUTS].map(|()| [height(), height(), height(), 1.0]);
    cuts.iter_mut().for_each(|cut| cut[3] = if random.bool() { 1.0 } else { -1.0 });
    Case { corners: [1, 2, 3, 3, 3, 3][random.usize(..6)], cuts }
}

/// Height of a point, in weights of the face's corners.
fn height([a, b, c, _]: [f32; CUT], p: DVec3) -> f64 {
    let [a, b, c] = [a, b, c].map(f64::from);
    a + p.x * (b - a) + p.y * (c - a)
}

/// The same cuts by `tesdf`.
fn expected(case: &Case) -> Vec<DVec3> {
    let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
    let mut polygon = Polygon::new(&corners[..case.corners as usize]);
    for cut in case.cuts {
        let above = cut[3] > 0.0;
        polygon = match polygon.cut(|v| height(cut, v.point)) {
            Parts::Above if above => polygon,
            Parts::Below if !above => polygon,
            Parts::Across(kept, _) if above => kept,
            Parts::Across(_, kept) => kept,
            _ => return Vec::new(),
        };
    }
    polygon.points().collect()
}

/// Twice the area of a convex polygon.
fn twice_area(points: &[DVec3]) -> f64 {
    let spokes: Vec<DVec3> = points.iter().skip(1).map(|p| *p - points[0]).collect();
    spokes.windows(2).map(|pair| pair[0].cross(pair[1]).length()).sum()
}

/// Whether a point is close to a convex polygon. Rounding may add vertices anywhere on its edges.
fn is_near(p: DVec3, polygon: &[DVec3]) -> bool {
    let at = |k: usize| polygon[k.min(polygon.len() - 1)];
    (0..polygon.len()).any(|k| Triangle::new([at(0), at(k), at(k + 1)]).closest(p).distance < 1e-4)
}

/// Faces, segments and points that planes cross, touch at corners and edges, or hold.
#[test]
fn kernels_cut_polygons_as_the_processor_does() {
    let mut random = fastrand::Rng::with_seed(6);
    let cases: Vec<Case> = (0..20_000).map(|case| random_case(case, &mut random)).collect();
    let device = device();
    let corners: Vec<u32> = cases.iter().map(|case| case.corners).collect();
    let heights: Vec<f32> = cases.iter().flat_map(|case| case.cuts.into_iter().flatten()).collect();
    let (corners, heights) = (upload(&device, &corners), upload(&device, &heights));
    let counts = upload(&device, &vec![0u32; cases.len()]);
    let areas = upload(&device, &vec![0.0f32; cases.len()]);
    let vertices = upload(&device, &vec![0.0f32; 2 * ROOM * cases.len()]);
    cut_cases::launch(
        device.client(),
        groups_of(cases.len()),
        CubeDim::new_1d(GROUP),
        corners.words(),
        heights.words(),
        counts.words(),
        areas.words(),
        vertices.words(),
        cases.len() as u32,
    );
    let counts: Vec<u32> = read(&device, &counts, cases.len());
    let areas: Vec<f32> = read(&device, &areas, cases.len());
    let vertices: Vec<[f32; 2]> = read(&device, &vertices, ROOM * cases.len());
    let (mut cut, mut others) = (0, 0);
    for (k, case) in cases.iter().enumerate() {
        let expected = expected(case);
        let found: Vec<DVec3> = vertices[ROOM * k..][..counts[k] as usize]
            .iter()
            .map(|&[s, t]| DVec3::new(s.into(), t.into(), 0.0))
            .collect();
        let area = f64::from(areas[k]);
        assert!((area - twice_area(&found)).abs() < 1e-6, "case {k}: area {area} of {found:?}");
        assert!((area - twice_area(&expected)).abs() < 1e-5, "case {k}: {found:?}, {expected:?}");
        // Every vertex is on the kept side of every cut.
        for (p, c) in found.iter().flat_map(|p| case.cuts.map(|c| (*p, c))) {
            let size = f64::from(c[0].abs().max(c[1].abs()).max(c[2].abs()));
            assert!(f64::from(c[3]) * height(c, p) >= -1e-5 * size, "case {k}: {p} is cut off by {c:?}");
        }
        let same =
            found.iter().all(|&p| is_near(p, &expected)) && expected.iter().all(|&p| is_near(p, &found));
        // Rounding may keep or drop a part without area: a segment, or a corner.
        assert!(same || area < 1e-5 || case.corners < 3, "case {k}: {found:?}, {expected:?}");
        others += usize::from(!same);
        cut += usize::from(found.len() > 3);
    }
    assert!(cut > 1000, "{cut} polygons with more than three vertices");
    assert!(others < cases.len() / 50, "{others} results differ");
}
