use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::{Draft, RepairReport, ShellOrientation, around_edge::pairs};
use crate::{
    geometry::perturbed_orientation,
    mesh::{
        Topology, TriangleMesh, WindingNumber,
        check::{TJunctions, face_flaws, height, self_intersections},
        topology::{DisjointSets, EdgeUse},
    },
};

/// The faces after neighbours were made to agree.
pub(super) struct Agreed {
    /// For each face, whether it was reversed.
    pub reversed: Vec<bool>,
    /// The faces of one-sided surfaces.
    pub one_sided: OneSided,
}

/// Surfaces without an orientation, such as a Moebius strip.
#[derive(Default)]
pub(super) struct OneSided {
    /// For each face, whether it is part of one.
    pub faces: Vec<bool>,
    /// For each of the surfaces, an edge where two faces disagree.
    pub edges: Vec<[u32; 2]>,
}

/// Orients neighbouring faces consistently.
pub(super) fn agree(draft: &mut Draft) -> Agreed {
    let topology = Topology::new(&draft.faces);
    let (reversed, conflicts) = topology.consistent_orientation();
    let (surface, count) = topology.components(|edge| edge.face_count() == 2);
    let mut is_one_sided = vec![false; count];
    for &edge in &conflicts {
        let face = topology.uses(&topology.edges()[edge])[0].face;
        is_one_sided[surface[face as usize] as usize] = true;
    }
    let one_sided = OneSided {
        faces: surface.iter().map(|&s| is_one_sided[s as usize]).collect(),
        edges: conflicts.iter().map(|&edge| topology.edges()[edge].vertices).collect(),
    };
    for (face, _) in draft.faces.iter_mut().zip(&reversed).filter(|(_, r)| **r) {
        face.swap(1, 2);
    }
    Agreed { reversed, one_sided }
}

/// Orients each closed shell outward or inward, by the parity of the number of shells around it.
pub(super) fn orient(
    draft: &mut Draft,
    mut reversed: Vec<bool>,
    which: ShellOrientation,
    report: &mut RepairReport,
) {
    orient_shells(draft, &mut reversed, which, report);
    let origins = reversed.iter().zip(&draft.origin).filter(|(r, _)| **r).map(|(_, &o)| o);
    report.reversed_faces = origins.collect::<BTreeSet<_>>().into_iter().collect();
}

fn orient_shells(
    draft: &mut Draft,
    reversed: &mut [bool],
    which: ShellOrientation,
    report: &mut RepairReport,
) {
    let topology = Topology::new(&draft.faces);
    let (shell, count) = shells(draft, &topology, which);
    let closed = closed_shells(&topology, &shell, count);
    // The faces of the closed shells as a mesh of their own.
    let kept: Vec<u32> =
        (0..draft.faces.len() as u32).filter(|&f| closed[shell[f as usize] as usize]).collect();
    let faces = kept.iter().map(|&f| draft.faces[f as usize]).collect();
    let Ok(mesh) = TriangleMesh::new(draft.vertices.clone(), faces) else {
        return; // no shell is closed
    };
    let shell_of = |face: u32| shell[kept[face as usize] as usize];
    let (crossing, crossing_themselves) = crossing_shells(&mesh, shell_of);
    let origin = |face: u32| draft.origin[kept[face as usize] as usize];
    if which == ShellOrientation::Separate {
        report.crossing_shells = crossing.values().map(|&[f, g]| [origin(f), origin(g)]).collect();
    }

    let mut tallest: BTreeMap<u32, (f64, u32)> = BTreeMap::new();
    for f in 0..mesh.faces().len() as u32 {
        let height = height(mesh.triangle(f as usize));
        let best = tallest.entry(shell_of(f)).or_insert((height, f));
        if height > best.0 {
            *best = (height, f);
        }
    }
    if which == ShellOrientation::Separate {
        let meets_another: BTreeSet<u32> = crossing.keys().flatten().copied().collect();
        tallest.retain(|s, _| !meets_another.contains(s));
    }
    let winding = WindingNumber::new(&mesh);
    let mut inside_out = vec![false; count];
    for (&number, &(_, face)) in &tallest {
        let triangle = mesh.triangle(face as usize);
        let center = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
        let mut windings: BTreeMap<u32, i32> = BTreeMap::new();
        winding.for_each_crossing_to(center, |f, sign| *windings.entry(shell_of(f)).or_default() += sign);
        let own = windings.remove(&number).unwrap_or(0);
        // The parity of a shell that does not meet this one is the same all over this one.
        let around = |s: u32| !crossing.contains_key(&[s.min(number), s.max(number)]);
        let depth = windings.iter().filter(|&(&s, w)| w % 2 != 0 && around(s)).count();
        let behind = if perturbed_orientation(triangle, center) > 0 { own } else { own + 1 };
        // In an embedded shell, one side of each face has the winding number 0, so one place
        // decides. A shell that meets itself (such as flaps of a careless triangulation) is decided
        // by its volume, if it has any.
        let outward = if crossing_themselves.contains(&number) {
            let volume = volume(&mesh, |f| shell_of(f) == number);
            if volume == 0.0 {
                continue;
            }
            volume > 0.0
        } else {
            behind == 1
        };
        inside_out[number as usize] = outward != (depth % 2 == 0);
    }
    for (f, face) in draft.faces.iter_mut().enumerate() {
        if inside_out[shell[f] as usize] {
            face.swap(1, 2);
            reversed[f] = !reversed[f];
        }
    }
}

/// The shell of each face, and an upper bound of the shell numbers. A shell is a patch of faces
/// that are connected over edges with two faces. Patches are joined where they balance only
/// together at an edge with more faces: all of them, or with [`ShellOrientation::All`] those of
/// neighbours around the edge.
fn shells(draft: &Draft, topology: &Topology, which: ShellOrientation) -> (Vec<u32>, usize) {
    let (patch, count) = topology.components(|edge| edge.face_count() == 2);
    let mut sets = DisjointSets::new(count);
    for edge in topology.edges().iter().filter(|e| e.face_count() > 2) {
        let of = |u: &EdgeUse| patch[u.face as usize];
        let balance = balance(topology.uses(edge).iter().map(|u| (of(u), u.forward)));
        let unbalanced: Vec<u32> = balance.into_iter().filter(|(_, n)| *n != 0).map(|(p, _)| p).collect();
        let uses: Vec<EdgeUse> =
            topology.uses(edge).iter().filter(|u| unbalanced.contains(&of(u))).copied().collect();
        let paired = match which {
            ShellOrientation::Separate => None,
            ShellOrientation::All => pairs(draft, edge, &uses),
        };
        match paired.filter(|pairs| pairs.iter().all(|[u, v]| u.forward != v.forward)) {
            Some(pairs) => pairs.iter().for_each(|[u, v]| sets.join(of(u), of(v))),
            None => unbalanced.windows(2).for_each(|w| sets.join(w[0], w[1])),
        }
    }
    (patch.into_iter().map(|p| sets.find(p)).collect(), count)
}

fn closed_shells(topology: &Topology, shell: &[u32], count: usize) -> Vec<bool> {
    let mut closed = vec![true; count];
    for edge in topology.edges().iter().filter(|e| !e.is_manifold()) {
        for (s, n) in balance(topology.uses(edge).iter().map(|u| (shell[u.face as usize], u.forward))) {
            closed[s as usize] &= n == 0;
        }
    }
    closed
}

/// For each owner, the forward uses minus the backward uses.
fn balance(uses: impl Iterator<Item = (u32, bool)>) -> BTreeMap<u32, i32> {
    let mut balance = BTreeMap::new();
    uses.for_each(|(owner, forward)| *balance.entry(owner).or_default() += if forward { 1 } else { -1 });
    balance
}

/// Pairs of shells that meet, each with one face of both shells, and the shells that meet
/// themselves.
fn crossing_shells(
    mesh: &TriangleMesh,
    shell_of: impl Fn(u32) -> u32,
) -> (BTreeMap<[u32; 2], [u32; 2]>, BTreeSet<u32>) {
    let topology = Topology::new(mesh.faces());
    let flaws = face_flaws(mesh);
    // Closed shells have no open edges for a vertex to lie on.
    let touching = TJunctions::default().with_collinear(mesh, &flaws.zero_area).touching(mesh, &topology);
    let pairs = self_intersections(mesh, &flaws.without_area(), &touching);
    let (mut crossing, mut themselves) = (BTreeMap::new(), BTreeSet::new());
    for &[f, g] in pairs.iter().chain(&flaws.duplicates).chain(&flaws.reversed_duplicates) {
        let (s, t) = (shell_of(f), shell_of(g));
        if s == t {
            themselves.insert(s);
        } else {
            crossing.entry([s.min(t), s.max(t)]).or_insert(if s < t { [f, g] } else { [g, f] });
        }
    }
    (crossing, themselves)
}

/// Six times the signed volume of the faces that `of` accepts, relative to the centre of the mesh.
fn volume(mesh: &TriangleMesh, of: impl Fn(u32) -> bool) -> f64 {
    let middle = mesh.bounds().center();
    let term = |f: u32| {
        let [a, b, c] = mesh.triangle(f as usize).map(|p: DVec3| p - middle);
        a.dot(b.cross(c))
    };
    (0..mesh.faces().len() as u32).filter(|&f| of(f)).map(term).sum()
}
