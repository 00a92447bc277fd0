//! An asset as a file.
use std::path::Path;

use serde::Serialize;
use serde::ser::SerializeMap;

use super::error::ExportJsonError;
use super::file::{COUNT, FACES, GROUPS, NODES};
use crate::TeSdf;
use crate::asset::layout::Node;
use crate::base::Side;

impl TeSdf {
    /// Writes a JSON file of TES-Encoder, the program of the paper's authors. A file at `path` is
    /// replaced atomically.
    ///
    /// The asset must have a conforming domain. Where its tetrahedra are bisected, a tetrahedron
    /// gets the faces of all of its cells, so its list is exact where theirs are. Corners are
    /// written in the order of the authors, the negative one: `(b − a) × (c − a) · (d − a) < 0`.
    /// Faces are in the order of the source, and coordinates in the unit of the mesh, with all
    /// their digits.
    ///
    /// # Errors
    /// [`ExportJsonError`]: the asset has the bisection domain, or the file cannot be written.
    pub fn export_json(&self, path: impl AsRef<Path>) -> Result<(), ExportJsonError> {
        Ok(crate::save::save_atomic(path, &self.to_json_bytes()?)?)
    }

    /// The bytes that [`export_json`](Self::export_json) writes.
    ///
    /// # Errors
    /// The same as for [`export_json`](Self::export_json), except those of writing.
    pub fn to_json_bytes(&self) -> Result<Vec<u8>, ExportJsonError> {
        let file = File::of(self)?;
        serde_json::to_vec(&file).map_err(|e| ExportJsonError::Text(e.to_string()))
    }
}

/// What a file holds.
#[derive(Default)]
struct File {
    nodes: [Vec<[f64; 3]>; 3],
    faces: Vec<[u32; 3]>,
    tetrahedra: [Vec<[u32; 4]>; 4],
    lengths: [Vec<u32>; 4],
    lists: [Vec<u32>; 4],
}

impl File {
    fn of(asset: &TeSdf) -> Result<Self, ExportJsonError> {
        let Some(domain) = &asset.conforming else { return Err(ExportJsonError::NotConforming) };
        let mut file = Self::default();
        // The place in the file of the face at each place in the asset.
        let mut of_source: Vec<u32> = (0..asset.face_count() as u32).collect();
        of_source.sort_by_key(|&at| asset.face_id(at as usize));
        let mut face_of = vec![0; of_source.len()];
        of_source.iter().enumerate().for_each(|(id, &at)| face_of[at as usize] = id as u32);
        file.faces = of_source.iter().map(|&at| asset.face_vertices(at as usize)).collect();

        let surface = asset.vertices.len();
        file.nodes[0] = asset.vertices.to_vec();
        let sides = (0..domain.tetrahedra().len()).map(|root| {
            let mut list = Vec::new();
            let side = add_cells(asset, root as u32, &mut list).ok_or(root)?;
            list.iter_mut().for_each(|face| *face = face_of[*face as usize]);
            list.sort_unstable();
            list.dedup();
            Ok((side, list))
        });
        let cells: Vec<(Side, Vec<u32>)> =
            sides.collect::<Result<_, _>>().map_err(|tetrahedron| ExportJsonError::NoList { tetrahedron })?;
        // A vertex that is not of the surface is inside or outside, as its tetrahedra are.
        let mut is_inner = vec![false; domain.vertices().len()];
        for (corners, _) in domain.tetrahedra().iter().zip(&cells).filter(|(_, c)| c.0 == Side::Inside) {
            let own = corners.iter().filter_map(|&v| (v as usize).checked_sub(surface));
            own.for_each(|v| is_inner[v] = true);
        }
        let inner = is_inner.iter().filter(|inner| **inner).count();
        let mut id = vec![0; is_inner.len()];
        for (v, place) in domain.vertices().iter().enumerate() {
            let (nodes, first) = if is_inner[v] { (1, surface) } else { (2, surface + inner) };
            id[v] = (first + file.nodes[nodes].len()) as u32;
            file.nodes[nodes].push(*place);
        }
        for (corners, (side, list)) in domain.tetrahedra().iter().zip(cells) {
            let at_surface = corners.iter().any(|&v| (v as usize) < surface);
            let group = 2 * usize::from(side == Side::Outside) + usize::from(!at_surface);
            let [a, b, c, d] = corners.map(|v| (v as usize).checked_sub(surface).map_or(v, |own| id[own]));
            file.tetrahedra[group].push(ascending([a, b, d, c]));
            file.lengths[group].push(list.len() as u32);
            file.lists[group].extend(list);
        }
        Ok(file)
    }
}

/// The same tetrahedron with the same orientation, and its corners in ascending order but for the last
/// two. So an asset that is exported again has the same bytes.
fn ascending(mut corners: [u32; 4]) -> [u32; 4] {
    let pairs = (0..4).flat_map(|i| (0..i).map(move |j| (i, j)));
    let is_odd = pairs.filter(|&(i, j)| corners[i] < corners[j]).count() % 2 == 1;
    corners.sort_unstable();
    if is_odd {
        corners.swap(2, 3);
    }
    corners
}

/// Adds the lists of the cells below a word, by the places of faces in the asset. The side of the
/// cells; `None` where a cell has no list.
fn add_cells(asset: &TeSdf, word: u32, list: &mut Vec<u32>) -> Option<Side> {
    let mut stack = vec![word];
    let mut side = Side::Outside;
    while let Some(word) = stack.pop() {
        match Node::decode(asset.nodes[word as usize], &asset.lists) {
            Node::Split(children) => stack.extend([children, children + 1]),
            Node::Listed(label, offset) => {
                if label == crate::asset::layout::Label::Inside {
                    side = Side::Inside;
                }
                asset.with_list(offset, |faces| list.extend(faces.ids()));
            }
            Node::Far(_) | Node::NotOfDomain => return None,
        }
    }
    Some(side)
}

impl Serialize for File {
    fn serialize<S: serde::Serializer>(&self, text: S) -> Result<S::Ok, S::Error> {
        let mut map = text.serialize_map(None)?;
        let count = |key: &str| format!("{COUNT}{key}");
        for (key, nodes) in NODES.iter().zip(&self.nodes) {
            map.serialize_entry(&count(key), &nodes.len())?;
        }
        map.serialize_entry(&count(FACES), &self.faces.len())?;
        for (group, tetrahedra) in GROUPS.iter().zip(&self.tetrahedra) {
            map.serialize_entry(&count(group.tetrahedra), &tetrahedra.len())?;
        }
        for (key, nodes) in NODES.iter().zip(&self.nodes) {
            map.serialize_entry(key, nodes)?;
        }
        map.serialize_entry(FACES, &self.faces)?;
        for (group, tetrahedra) in GROUPS.iter().zip(&self.tetrahedra) {
            map.serialize_entry(group.tetrahedra, tetrahedra)?;
        }
        for ((group, lengths), lists) in GROUPS.iter().zip(&self.lengths).zip(&self.lists) {
            map.serialize_entry(group.lengths, lengths)?;
            map.serialize_entry(group.lists, lists)?;
        }
        map.end()
    }
}
