//! Orients surfaces that are connected only over edges with more than two faces.
use std::collections::BTreeMap;

use super::{Draft, around_edge::pairs, orient::OneSided, split::open_lengths};
use crate::mesh::{Topology, topology::Edge};

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
pub(super) fn agree_across(
    draft: &mut Draft,
    one_sided: &OneSided,
    reversed_faces: &mut [bool],
) -> Vec<[u32; 2]> {
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
        if uses.iter().any(|u| one_sided.faces[u.face as usize]) {
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
    for (flag, s) in reversed_faces.iter_mut().zip(&surface) {
        *flag ^= reversed[*s as usize];
    }
    paired
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
