//! Orients surfaces that are connected only over edges with more than two faces.
use std::collections::BTreeMap;

use glam::DVec3;

use super::{
    Draft,
    holes::around,
    orient::Agreed,
    split::open_lengths,
};
use crate::mesh::{
    Topology,
    topology::{Edge, EdgeUse},
};

/// For two surfaces, the length of the edges where paired faces agree, and where they disagree.
type Votes = BTreeMap<[u32; 2], [f64; 2]>;

/// Makes surfaces agree over edges with an even number of faces, more than two. Around such an
/// edge, each face is paired with the next one in the order of their angles, so that each pair is
/// the edge of a solid, or of a hole in it. Where paired faces run along the edge in the same
/// direction, they disagree. Of two surfaces that disagree along a greater length than they agree,
/// one is reversed, beginning with the clearest case. All is left as it is when that does not make
/// the unbalanced edges shorter in total.
///
/// Returns the edges at which faces were paired.
pub(super) fn agree_across(draft: &mut Draft, agreed: &mut Agreed) -> Vec<[u32; 2]> {
    let topology = Topology::new(&draft.faces);
    if topology.is_closed() {
        return Vec::new();
    }
    let (surface, count) = topology.components(|edge| edge.face_count() == 2);
    let mut votes = Votes::new();
    let mut paired = Vec::new();
    let many = |edge: &&Edge| edge.face_count() > 2 && edge.face_count().is_multiple_of(2);
    for edge in topology.edges().iter().filter(many) {
        let uses = topology.uses(edge);
        if uses.iter().any(|u| agreed.one_sided.faces[u.face as usize]) {
            continue;
        }
        let Some(pairs) = pairs(draft, edge, uses) else { continue };
        let [a, b] = edge.vertices.map(|v| draft.vertices[v as usize]);
        for [u, v] in pairs {
            let [s, t] = [u, v].map(|u| surface[u.face as usize]);
            if s != t {
                let votes = votes.entry([s.min(t), s.max(t)]).or_default();
                votes[usize::from(u.forward == v.forward)] += a.distance(b);
            }
        }
        paired.push(edge.vertices);
    }
    let mut sizes = vec![0; count];
    surface.iter().for_each(|&s| sizes[s as usize] += 1);
    let reversed = decide(votes, &sizes);
    let mut faces = draft.faces.clone();
    for (face, _) in faces.iter_mut().zip(&surface).filter(|(_, s)| reversed[**s as usize]) {
        face.swap(1, 2);
    }
    let length = |topology: &Topology| open_lengths(&draft.vertices, topology)[1];
    if length(&Topology::new(&faces)) >= length(&topology) {
        return Vec::new();
    }
    draft.faces = faces;
    for (flag, s) in agreed.reversed.iter_mut().zip(&surface) {
        *flag ^= reversed[*s as usize];
    }
    paired
}

/// Pairs of neighbours around an edge. There are two ways to pair them. The faces agree best in
/// the chosen way; if they agree equally well in both, the angles within its pairs are smaller.
/// `None` when a face has no area.
fn pairs(draft: &Draft, edge: &Edge, uses: &[EdgeUse]) -> Option<Vec<[EdgeUse; 2]>> {
    let [a, b] = edge.vertices.map(|v| draft.vertices[v as usize]);
    let axis = (b - a).try_normalize()?;
    let across = |u: &EdgeUse| {
        let apex = draft.faces[u.face as usize].into_iter().find(|v| !edge.vertices.contains(v))?;
        (draft.vertices[apex as usize] - a).reject_from_normalized(axis).try_normalize()
    };
    let first = across(&uses[0])?;
    let side: DVec3 = axis.cross(first);
    let mut turned: Vec<(f64, EdgeUse)> = Vec::with_capacity(uses.len());
    for u in uses {
        let direction = across(u)?;
        turned.push((around(first.dot(direction), side.dot(direction)), *u));
    }
    turned.sort_by(|x, y| x.0.total_cmp(&y.0).then(x.1.face.cmp(&y.1.face)));
    let way = |from: usize| {
        let n = turned.len();
        let pair = |k: usize| [turned[(from + 2 * k) % n], turned[(from + 2 * k + 1) % n]];
        let pairs: Vec<[(f64, EdgeUse); 2]> = (0..n / 2).map(pair).collect();
        let agreeing = pairs.iter().filter(|[u, v]| u.1.forward != v.1.forward).count();
        let angles: f64 = pairs.iter().map(|[u, v]| (v.0 - u.0).rem_euclid(4.0)).sum();
        (agreeing, angles, pairs.into_iter().map(|pair| pair.map(|(_, u)| u)).collect())
    };
    let (one, other): ((usize, f64, Vec<_>), _) = (way(0), way(1));
    let better = other.0 > one.0 || other.0 == one.0 && other.1 < one.1;
    Some(if better { other.2 } else { one.2 })
}

/// The surfaces to reverse. Of the surfaces that agree with each other afterwards, those with fewer
/// faces are reversed.
fn decide(votes: Votes, sizes: &[usize]) -> Vec<bool> {
    let mut clearest: Vec<([u32; 2], f64)> =
        votes.into_iter().map(|(pair, [agree, disagree])| (pair, disagree - agree)).collect();
    clearest.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()).then(a.0.cmp(&b.0)));
    let mut group: Vec<usize> = (0..sizes.len()).collect();
    let mut members: Vec<Vec<usize>> = (0..sizes.len()).map(|s| vec![s]).collect();
    let mut reversed = vec![false; sizes.len()];
    for ([s, t], disagreement) in clearest {
        let (s, t) = (s as usize, t as usize);
        if group[s] == group[t] || disagreement == 0.0 {
            continue;
        }
        let flip = (reversed[s] != reversed[t]) != (disagreement > 0.0);
        // The smaller group joins the larger one, so that no surface changes its group often.
        let [small, large] = match members[group[s]].len() <= members[group[t]].len() {
            true => [group[s], group[t]],
            false => [group[t], group[s]],
        };
        let joining = std::mem::take(&mut members[small]);
        joining.iter().for_each(|&i| (group[i], reversed[i]) = (large, reversed[i] ^ flip));
        members[large].extend(joining);
    }
    for members in members {
        let faces = |flag: bool| -> usize {
            members.iter().filter(|&&i| reversed[i] == flag).map(|&i| sizes[i]).sum()
        };
        if faces(true) > faces(false) {
            members.iter().for_each(|&i| reversed[i] = !reversed[i]);
        }
    }
    reversed
}
