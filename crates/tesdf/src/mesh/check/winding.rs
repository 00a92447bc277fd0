use std::collections::HashSet;

use crate::parallel::*;
use glam::DVec3;

use super::{
    edges::centroid,
    faces::FaceFlaws,
    regions::{self, Samples},
};
use crate::{
    base::InsideRule,
    geometry::{Aabb, Triangle, perturbed_orientation},
    mesh::{Defect, DefectKind, Severity, Topology, TriangleMesh, WindingNumber, topology::Edge},
};

/// Bound of the rounding error of intersection points, relative to the largest coordinate: about a
/// hundred roundings.
const ROUNDING: f64 = 2e-14;

/// Largest number of tested regions in all faces together; the tests take a second or two. When
/// there are more, evenly chosen regions of each face are tested.
const REGIONS: usize = 1 << 17;

/// The ways in which the faces of a closed mesh meet.
pub(super) struct Meetings<'a> {
    pub flaws: &'a FaceFlaws,
    /// Pairs of faces that intersect.
    pub intersections: &'a [[u32; 2]],
    /// Pairs of faces that touch along a collinear face, and may intersect elsewhere.
    pub touching: &'a HashSet<(u32, u32)>,
}

/// The winding numbers in front of a face and behind it, at a place.
#[derive(Clone, Copy)]
pub(super) struct Sides {
    pub place: DVec3,
    pub front: i32,
    pub behind: i32,
}

impl Sides {
    fn least(&self) -> i32 {
        self.front.min(self.behind)
    }

    fn greatest(&self) -> i32 {
        self.front.max(self.behind)
    }

    fn class(&self, rule: InsideRule) -> FaceClass {
        match (rule.holds(self.front), rule.holds(self.behind)) {
            (false, true) => FaceClass::Outward,
            (true, false) => FaceClass::Inward,
            _ => FaceClass::Buried,
        }
    }

    fn has_odd(&self) -> bool {
        self.front % 2 != 0 || self.behind % 2 != 0
    }
}

/// The winding numbers on both sides of all faces of a closed mesh.
pub(crate) struct Survey {
    /// Faces that meet no other face, by patches on whose sides the numbers are constant.
    patches: Vec<SidesOfPatch>,
    /// Each face that meets others, with the sides of its regions. The first of several faces with
    /// the same corners represents them all.
    regions: Vec<(u32, Vec<Sides>)>,
    /// For each face, the first face with the same corners, and whether it is reversed.
    first: Vec<(u32, bool)>,
    /// Whether every region of every face is known, except regions that are narrower than rounding.
    is_complete: bool,
}

struct SidesOfPatch {
    patch: Patch,
    sides: Sides,
}

impl Survey {
    fn new(mesh: &TriangleMesh, topology: &Topology, meetings: &Meetings) -> Self {
        let winding = WindingNumber::new(mesh);
        let mut without_area = vec![false; mesh.faces().len()];
        meetings.flaws.without_area().iter().for_each(|&f| without_area[f as usize] = true);
        let others = Others::new(meetings, &without_area);
        let excluded = |f: u32| without_area[f as usize] || !others.of(f).is_empty();
        let patches = patches(mesh, topology, &winding, excluded)
            .into_iter()
            .map(|patch| {
                let sides = sides(mesh, &winding, patch.face, centroid(mesh, patch.face), 1);
                SidesOfPatch { patch, sides }
            })
            .collect();
        let (regions, is_complete) = regions(mesh, &winding, &others);
        Self { patches, regions, first: firsts(meetings.flaws, mesh.faces().len()), is_complete }
    }

    /// Whether every region of every face is known.
    pub fn is_complete(&self) -> bool {
        self.is_complete
    }

    /// For each face, which of its sides are inside. Faces without area are
    /// [`Unknown`](FaceClass::Unknown).
    pub fn classes(&self, rule: InsideRule) -> Vec<FaceClass> {
        let mut classes = vec![FaceClass::Unknown; self.first.len()];
        for SidesOfPatch { patch, sides } in &self.patches {
            let class = sides.class(rule);
            patch.faces.iter().for_each(|&f| classes[f as usize] = class);
        }
        for (face, sides) in &self.regions {
            let mut of_regions = sides.iter().map(|s| s.class(rule));
            if let Some(first) = of_regions.next() {
                classes[*face as usize] = of_regions.fold(first, FaceClass::join);
            }
        }
        for face in 0..classes.len() {
            let (first, reversed) = self.first[face];
            if first as usize != face {
                let class = classes[first as usize];
                classes[face] = if reversed { class.reversed() } else { class };
            }
        }
        classes
    }
}

/// Which sides of a face are inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FaceClass {
    /// The side behind the face, everywhere.
    Outward,
    /// The side in front of the face, everywhere.
    Inward,
    /// Both or none, everywhere.
    Buried,
    /// The side behind the face somewhere; elsewhere both or none.
    PartlyOutward,
    /// The side in front of the face somewhere; elsewhere both or none.
    PartlyInward,
    /// The side behind the face somewhere, the side in front of it elsewhere.
    Mixed,
    /// Not known.
    Unknown,
}

impl FaceClass {
    fn join(self, other: Self) -> Self {
        use FaceClass::{Buried, Inward, Mixed, Outward, PartlyInward, PartlyOutward};
        match (self, other) {
            _ if self == other => self,
            (Outward | PartlyOutward | Buried, Outward | PartlyOutward | Buried) => PartlyOutward,
            (Inward | PartlyInward | Buried, Inward | PartlyInward | Buried) => PartlyInward,
            _ => Mixed,
        }
    }

    fn reversed(self) -> Self {
        match self {
            Self::Outward => Self::Inward,
            Self::Inward => Self::Outward,
            Self::PartlyOutward => Self::PartlyInward,
            Self::PartlyInward => Self::PartlyOutward,
            same => same,
        }
    }
}

/// For each face, the first face with the same corners, and whether it is reversed against it.
fn firsts(flaws: &FaceFlaws, faces: usize) -> Vec<(u32, bool)> {
    let mut first: Vec<(u32, bool)> = (0..faces as u32).map(|f| (f, false)).collect();
    let pairs = flaws.duplicates.iter().map(|p| (p, false));
    for (&[later, earlier], reversed) in pairs.chain(flaws.reversed_duplicates.iter().map(|p| (p, true))) {
        first[later as usize] = (earlier, reversed);
    }
    // A first face may itself repeat an earlier one.
    for face in 0..faces {
        let (of, reversed) = first[face];
        let (earliest, again) = first[of as usize];
        first[face] = (earliest, reversed != again);
    }
    first
}

/// The least and greatest winding number of a closed mesh, and the places where it is negative or
/// above 1.
pub(super) fn winding_defects(
    mesh: &TriangleMesh,
    topology: &Topology,
    meetings: &Meetings,
    rule: InsideRule,
) -> ([i32; 2], Vec<Defect>, Survey) {
    let survey = Survey::new(mesh, topology, meetings);
    let mut range = [0, 0];
    let mut any_odd = false;
    let mut defects = Vec::new();
    let mut above_one: Vec<(u32, i32)> = Vec::new();
    let mut record = |face: u32, least: &Sides, greatest: &Sides, extent: &str| {
        let (low, high) = (least.least(), greatest.greatest());
        range = [range[0].min(low), range[1].max(high)];
        if low < 0 {
            let side = if least.front == low { "in front of" } else { "behind" };
            let message = format!(
                "the winding number is {low} {side} face {face}{extent}: the surface is folded or inside out there, and \
                 the place counts as {}",
                if rule.holds(low) { "inside" } else { "outside" }
            );
            let defect = Defect::new(DefectKind::NegativeWinding, Severity::Warning, least.place, message);
            defects.push(defect.faces([face]));
        }
        if high > 1 {
            above_one.push((face, high));
        }
    };
    for SidesOfPatch { patch, sides } in &survey.patches {
        let extent = match patch.faces.len() {
            1 => String::new(),
            n => format!(" and the {} connected to it", n - 1),
        };
        any_odd |= sides.has_odd();
        record(patch.face, sides, sides, &extent);
    }
    for (face, sides) in &survey.regions {
        any_odd |= sides.iter().any(Sides::has_odd);
        let least = sides.iter().min_by_key(|s| s.least());
        let greatest = sides.iter().max_by_key(|s| s.greatest());
        if let (Some(least), Some(greatest)) = (least, greatest) {
            record(*face, least, greatest, "");
        }
    }

    if let Some(&(face, value)) = above_one.iter().max_by_key(|&&(f, w)| (w, std::cmp::Reverse(f))) {
        let inside = match rule {
            InsideRule::Winding => "is where it is 1 or more",
            InsideRule::Odd => "is where it is odd",
            _ => "is where it is not 0",
        };
        let message = format!(
            "the winding number is {value} next to face {face}: solids overlap, or a cavity is inside out; \
             inside {inside}. Distances inside refer to inner walls, too, unless the surface is `boundary`"
        );
        let faces: Vec<u32> = above_one.iter().map(|&(f, _)| f).collect();
        let defect =
            Defect::new(DefectKind::WindingAboveOne, Severity::Warning, centroid(mesh, face), message);
        defects.push(defect.faces(faces));
    }
    let has_inside = match rule {
        InsideRule::Winding => range[1] >= 1,
        InsideRule::Odd => any_odd,
        _ => range != [0, 0],
    };
    if !has_inside {
        let (expected, why) = match rule {
            InsideRule::Winding if range[0] < 0 => ("of 1 or more", "the surface is inside out"),
            InsideRule::Winding => ("of 1 or more", "it encloses nothing"),
            InsideRule::Odd => ("that is odd", "every place is enclosed an even number of times"),
            _ => ("other than 0", "it encloses nothing"),
        };
        let message = format!("no place has a winding number {expected}: the mesh has no inside, {why}");
        defects.push(Defect::new(DefectKind::NoInside, Severity::Error, mesh.bounds().center(), message));
    }
    (range, defects, survey)
}

/// The winding numbers on both sides of a face at a place of it. From front to back they rise by
/// `jump`.
///
/// The winding number of the place itself is one of them. Rounding decides on which side of the
/// face the place lies, and the result is exact for that side, unless another face passes between
/// the place and the face.
fn sides(mesh: &TriangleMesh, winding: &WindingNumber, face: u32, place: DVec3, jump: i32) -> Sides {
    let there = winding.at_perturbed(place);
    match perturbed_orientation(mesh.triangle(face as usize), place) > 0 {
        true => Sides { place, front: there - jump, behind: there },
        false => Sides { place, front: there, behind: there + jump },
    }
}

/// Faces that are connected over manifold edges and meet no other face. The winding number is
/// constant on each side.
struct Patch {
    /// The tallest face represents the patch: relative to its size, rounding moves its centroid
    /// least. Another face comes within the rounding error of this centroid only when that holds
    /// for every face of the patch.
    face: u32,
    /// All faces.
    faces: Vec<u32>,
}

fn patches(
    mesh: &TriangleMesh,
    topology: &Topology,
    winding: &WindingNumber,
    excluded: impl Fn(u32) -> bool,
) -> Vec<Patch> {
    let uses = |edge: &Edge| topology.uses(edge).iter().all(|u| !excluded(u.face));
    let (patch, count) = topology.components(|edge| edge.is_manifold() && uses(edge));
    let mut faces: Vec<Vec<u32>> = vec![Vec::new(); count];
    for (face, &patch) in
        (0..).zip(&patch).filter(|&(face, &p)| !excluded(face) && p != Topology::NO_COMPONENT)
    {
        faces[patch as usize].push(face);
    }
    let reach = rounding(mesh);
    let tallest = |faces: &mut dyn Iterator<Item = u32>| {
        let heights = faces.map(|face| (height(mesh.triangle(face as usize)), face));
        heights.max_by(|(a, f), (b, g)| a.total_cmp(b).then(g.cmp(f))).map(|(_, face)| face)
    };
    let of = |faces: Vec<u32>| {
        let first = tallest(&mut faces.iter().copied())?;
        let alone = |face: u32| is_alone(mesh, winding, face, reach);
        let face = match alone(first) {
            true => first,
            false => tallest(&mut faces.iter().copied().filter(|&face| alone(face))).unwrap_or(first),
        };
        Some(Patch { face, faces })
    };
    faces.into_iter().filter_map(of).collect()
}

/// Whether no other face has a point within `reach` of the centroid of a face.
fn is_alone(mesh: &TriangleMesh, winding: &WindingNumber, face: u32, reach: f64) -> bool {
    let place = centroid(mesh, face);
    let (around, mut alone) = (Aabb::of(&[place]).grown(reach), true);
    let is_far = |f: u32| Triangle::new(mesh.triangle(f as usize)).closest(place).distance > reach;
    winding.tree().visit(
        |bounds| bounds.overlaps(around),
        |leaf| alone &= leaf.iter().all(|&f| f == face || is_far(f)),
    );
    alone
}

/// Bound of the rounding error of places on a face.
fn rounding(mesh: &TriangleMesh) -> f64 {
    let bounds = mesh.bounds();
    ROUNDING * bounds.min.abs().max(bounds.max.abs()).max_element()
}

/// Each face that meets others, with the winding numbers beside its regions, and whether these are
/// all regions. The first of several faces with the same corners represents them all.
fn regions(mesh: &TriangleMesh, winding: &WindingNumber, others: &Others) -> (Vec<(u32, Vec<Sides>)>, bool) {
    let rounding = rounding(mesh);
    let meets = |&f: &u32| !others.of(f).is_empty() && !others.repeats[f as usize];
    let faces: Vec<u32> = (0..mesh.faces().len() as u32).filter(meets).collect();
    let samples = |&face: &u32| (face, regions::samples(mesh, face, others.of(face), rounding));
    let samples: Vec<(u32, Samples)> = faces.par_iter().map(samples).collect();
    let count: usize = samples.iter().map(|(_, s)| s.samples.len()).sum();
    let every = count.div_ceil(REGIONS).max(1);
    let is_complete = every == 1 && samples.iter().all(|(_, s)| s.is_complete);
    let sides_of = |(face, Samples { samples, .. }): &(u32, Samples)| {
        let tested = samples.iter().step_by(every);
        (*face, tested.map(|s| sides(mesh, winding, *face, s.point, s.jump)).collect())
    };
    (samples.par_iter().map(sides_of).collect(), is_complete)
}

/// For each face with area, the other faces with area that it meets, ascending.
struct Others {
    starts: Vec<usize>,
    faces: Vec<u32>,
    /// Whether an earlier face has the same corners.
    repeats: Vec<bool>,
}

impl Others {
    fn new(meetings: &Meetings, without_area: &[bool]) -> Self {
        let FaceFlaws { duplicates, reversed_duplicates, .. } = meetings.flaws;
        let listed = [meetings.intersections, duplicates, reversed_duplicates].into_iter().flatten().copied();
        let pairs = listed.chain(meetings.touching.iter().map(|&(f, g)| [f, g]));
        let mut directed: Vec<[u32; 2]> = pairs
            .filter(|[f, g]| f != g && !without_area[*f as usize] && !without_area[*g as usize])
            .flat_map(|[f, g]| [[f, g], [g, f]])
            .collect();
        directed.sort_unstable();
        directed.dedup();
        let mut starts = vec![0; without_area.len() + 1];
        directed.iter().for_each(|[f, _]| starts[*f as usize + 1] += 1);
        (1..starts.len()).for_each(|f| starts[f] += starts[f - 1]);
        let mut repeats = vec![false; without_area.len()];
        duplicates.iter().chain(reversed_duplicates).for_each(|[f, _]| repeats[*f as usize] = true);
        Self { starts, faces: directed.into_iter().map(|[_, g]| g).collect(), repeats }
    }

    fn of(&self, face: u32) -> &[u32] {
        &self.faces[self.starts[face as usize]..self.starts[face as usize + 1]]
    }
}

/// Height of a triangle over its longest edge; NaN when the triangle is a point.
pub(crate) fn height([a, b, c]: [DVec3; 3]) -> f64 {
    let longest = a.distance_squared(b).max(b.distance_squared(c)).max(c.distance_squared(a)).sqrt();
    (b - a).cross(c - a).length() / longest
}
