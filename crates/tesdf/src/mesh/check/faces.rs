use std::collections::HashMap;

use glam::DVec3;

use super::edges::centroid;
use crate::{
    geometry::normal_signs,
    mesh::{Defect, DefectKind, Severity, TriangleMesh, topology::has_repeated_corner},
};

/// A face whose height divided by its longest edge is below this value is a needle.
const NEEDLE: f64 = 1e-6;

/// Faces with a defect of their own.
#[derive(Clone, Debug, Default)]
pub(crate) struct FaceFlaws {
    /// Faces with two equal corners.
    pub repeated_corner: Vec<u32>,
    /// Faces with three different, exactly collinear corners.
    pub zero_area: Vec<u32>,
    /// Faces of very small height, with the ratio of height to longest edge.
    pub needles: Vec<(u32, f64)>,
    /// Faces with the corners and orientation of an earlier face: [face, earlier face].
    pub duplicates: Vec<[u32; 2]>,
    /// Faces with the corners of an earlier face in the opposite orientation: [face, earlier face].
    pub reversed_duplicates: Vec<[u32; 2]>,
}

/// Finds all [`FaceFlaws`] of a mesh.
pub(crate) fn face_flaws(mesh: &TriangleMesh) -> FaceFlaws {
    let mut flaws = FaceFlaws::default();
    let mut first_with: HashMap<[u32; 3], u32> = HashMap::with_capacity(mesh.faces().len());
    for (f, &corners) in mesh.faces().iter().enumerate() {
        let face = f as u32;
        if has_repeated_corner(corners) {
            flaws.repeated_corner.push(face);
            continue;
        }
        let mut sorted = corners;
        sorted.sort_unstable();
        let first = *first_with.entry(sorted).or_insert(face);
        if first != face {
            let same = is_even(corners) == is_even(mesh.faces()[first as usize]);
            let list = if same { &mut flaws.duplicates } else { &mut flaws.reversed_duplicates };
            list.push([face, first]);
        }
        let corners = mesh.triangle(f);
        let ratio = height_ratio(corners);
        if has_no_area(corners) {
            flaws.zero_area.push(face);
        } else if ratio.is_nan() || ratio < NEEDLE {
            flaws.needles.push((face, ratio));
        }
    }
    flaws
}

/// The height of a face divided by its longest edge.
fn height_ratio([a, b, c]: [DVec3; 3]) -> f64 {
    let longest = (b - a).length_squared().max((c - b).length_squared()).max((a - c).length_squared());
    (b - a).cross(c - a).length() / longest
}

/// Whether the corners of a face lie exactly on one line.
pub(crate) fn has_no_area(corners: [DVec3; 3]) -> bool {
    let [a, b, c] = corners;
    let ratio = height_ratio(corners);
    // Above the limit, rounding cannot hide a zero. Below it the exact test decides.
    (ratio.is_nan() || ratio < NEEDLE) && normal_signs(a, b, c) == [0; 3]
}

/// Whether the cyclic order of the corners is that of their ids in ascending order.
fn is_even([a, b, c]: [u32; 3]) -> bool {
    (a < b) ^ (b < c) ^ (a < c)
}

impl FaceFlaws {
    /// Faces without area, in ascending order.
    pub(crate) fn without_area(&self) -> Vec<u32> {
        let mut faces = [self.repeated_corner.as_slice(), &self.zero_area].concat();
        faces.sort_unstable();
        faces
    }

    pub(super) fn defects(&self, mesh: &TriangleMesh, lenient: Severity) -> Vec<Defect> {
        let mut defects = Vec::new();
        let mut add = |kind, severity, face: u32, faces: Vec<u32>, message| {
            let place = centroid(mesh, face);
            let vertices = mesh.faces()[face as usize];
            defects.push(Defect::new(kind, severity, place, message).faces(faces).vertices(vertices));
        };
        let corners = |face: u32| {
            let [a, b, c] = mesh.faces()[face as usize];
            format!("({a}, {b}, {c})")
        };
        for &f in &self.repeated_corner {
            let message = format!("face {f} has two equal corners {}", corners(f));
            add(DefectKind::RepeatedCorner, lenient, f, vec![f], message);
        }
        for &f in &self.zero_area {
            let message = format!("face {f} has no area: its corners {} are on one line", corners(f));
            add(DefectKind::ZeroArea, lenient, f, vec![f], message);
        }
        for &[f, first] in &self.duplicates {
            let message = format!("face {f} repeats face {first}: corners {}", corners(f));
            add(DefectKind::DuplicateFace, lenient, f, vec![f, first], message);
        }
        for &[f, first] in &self.reversed_duplicates {
            let message = format!("face {f} is face {first} reversed: corners {}", corners(f));
            add(DefectKind::ReversedDuplicateFace, lenient, f, vec![f, first], message);
        }
        for &(f, ratio) in &self.needles {
            let message = format!("face {f} is a needle: its height is {ratio:.1e} of its longest edge");
            add(DefectKind::NeedleFace, Severity::Warning, f, vec![f], message);
        }
        defects
    }
}

/// The corner of a collinear face that lies between the other two, and the other two.
pub(crate) fn middle_corner(corners: [u32; 3], positions: [DVec3; 3]) -> (u32, [u32; 2]) {
    let [a, b, c] = corners;
    let [pa, pb, pc] = positions;
    let (ab, bc, ca) = (pa.distance_squared(pb), pb.distance_squared(pc), pc.distance_squared(pa));
    if ab >= bc && ab >= ca {
        (c, [a, b])
    } else if bc >= ca {
        (a, [b, c])
    } else {
        (b, [c, a])
    }
}
