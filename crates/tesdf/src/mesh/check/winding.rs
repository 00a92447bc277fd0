use glam::DVec3;

use super::{edges::centroid, faces::FaceFlaws};
use crate::{
    geometry::{WindingNumber, perturbed_orientation},
    mesh::{Defect, DefectKind, Severity, Topology, TriangleMesh, topology::Edge},
};

/// How far from a face that meets others its sides are sampled, relative to the diagonal.
const SAMPLE_DISTANCE: f64 = 1e-12;

/// A negative winding number no farther from the face than this, relative to the diagonal, is that of a fold as
/// rounding to 32-bit floats makes: a warning.
const FOLD_THICKNESS: f64 = 1e-6;

/// The least and greatest winding number of a closed mesh, and where it is negative or above 1.
pub(super) fn winding_defects(
    mesh: &TriangleMesh,
    topology: &Topology,
    flaws: &FaceFlaws,
    intersections: &[[u32; 2]],
) -> ([i32; 2], Vec<Defect>) {
    let mut meets_others = vec![false; mesh.faces().len()];
    let pairs = [intersections, &flaws.duplicates, &flaws.reversed_duplicates];
    pairs.into_iter().flatten().flatten().for_each(|&f| meets_others[f as usize] = true);
    let mut without_area = vec![false; mesh.faces().len()];
    flaws.without_area().iter().for_each(|&f| without_area[f as usize] = true);
    let excluded = |f: u32| meets_others[f as usize] || without_area[f as usize];

    let winding = WindingNumber::new(mesh);
    let diagonal = mesh.diagonal();
    let both_sides = |face: u32, distance: f64| {
        let [a, b, c] = mesh.triangle(face as usize);
        let (center, step) = (centroid(mesh, face), distance * (b - a).cross(c - a).normalize_or_zero());
        [center + step, center - step].map(|x| winding.at_perturbed(x))
    };
    let mut range = [0, 0];
    let mut defects = Vec::new();
    let mut above_one: Vec<(u32, i32)> = Vec::new();
    let mut record = |face: u32, sides: [i32; 2], extent: &str| {
        let [low, high] = [sides[0].min(sides[1]), sides[0].max(sides[1])];
        range = [range[0].min(low), range[1].max(high)];
        if low < 0 {
            let side = if sides[0] == low { "in front of" } else { "behind" };
            let is_fold = both_sides(face, FOLD_THICKNESS * diagonal).iter().all(|&w| w >= 0);
            let (severity, what) = match is_fold {
                true => (Severity::Warning, "a thin fold, inside is where it is 1 or more"),
                false => (Severity::Error, "the surface is inside out there"),
            };
            let message = format!("the winding number is {low} {side} face {face}{extent}: {what}");
            let defect = Defect::new(DefectKind::NegativeWinding, severity, centroid(mesh, face), message);
            defects.push(defect.faces([face]));
        }
        if high > 1 {
            above_one.push((face, high));
        }
    };

    let uses = |edge: &Edge| topology.uses(edge).iter().all(|u| !excluded(u.face));
    let (patch, patches) = topology.components(|edge| edge.is_manifold() && uses(edge));
    // The tallest face of each patch stands for it: rounding moves its centre least, relative to its size.
    let mut tallest: Vec<Option<(f64, u32)>> = vec![None; patches];
    let mut sizes = vec![0usize; patches];
    for f in (0..mesh.faces().len() as u32)
        .filter(|&f| !excluded(f) && patch[f as usize] != Topology::NO_COMPONENT)
    {
        let number = patch[f as usize] as usize;
        sizes[number] += 1;
        let height = height(mesh.triangle(f as usize));
        if tallest[number].is_none_or(|(h, _)| height > h) {
            tallest[number] = Some((height, f));
        }
    }
    for (number, face) in tallest.iter().enumerate().filter_map(|(i, t)| t.map(|(_, f)| (i, f))) {
        let center = centroid(mesh, face);
        let there = winding.at_perturbed(center);
        let behind = perturbed_orientation(mesh.triangle(face as usize), center) > 0;
        let sides = if behind { [there - 1, there] } else { [there, there + 1] };
        let extent = match sizes[number] {
            1 => String::new(),
            n => format!(" and the {} connected to it", n - 1),
        };
        record(face, sides, &extent);
    }
    for face in
        (0..mesh.faces().len() as u32).filter(|&f| meets_others[f as usize] && !without_area[f as usize])
    {
        record(face, both_sides(face, SAMPLE_DISTANCE * diagonal), "");
    }

    if let Some(&(face, value)) = above_one.iter().max_by_key(|&&(f, w)| (w, std::cmp::Reverse(f))) {
        let message = format!(
            "the winding number is {value} next to face {face}: solids overlap, or a cavity is inside out; \
             inside is where it is 1 or more"
        );
        let faces: Vec<u32> = above_one.iter().map(|&(f, _)| f).collect();
        let defect =
            Defect::new(DefectKind::WindingAboveOne, Severity::Warning, centroid(mesh, face), message);
        defects.push(defect.faces(faces));
    }
    if range[1] < 1 {
        let message = "no place has a winding number of 1 or more: the mesh has no inside".to_owned();
        defects.push(Defect::new(DefectKind::NoInside, Severity::Error, mesh.bounds().center(), message));
    }
    (range, defects)
}

/// Height of a triangle over its longest edge; NaN for a point.
pub(crate) fn height([a, b, c]: [DVec3; 3]) -> f64 {
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a)).sqrt();
    (b - a).cross(c - a).length() / longest
}
