//! Makes the final lists of refined trees: tightened or sampled, completed for deformation,
//! truncated. Labels the cells.
use crate::parallel::*;

use super::assemble::collect;
use super::cell_signs::CellSigns;
use super::error::EncodeError;
use super::filter::{PAD, Scratch};
use super::list_proof::holds;
use super::rank::{Ranked, rank};
use super::refine::{Leaf, Tree};
use super::roots::Roots;
use super::sampled::{SampledCell, Sampler, sample};
use super::surface::Surface;
use super::tighten::{Levels, tighten};
use super::{Deformation, EncodeOptions, Method, Sampling, Threshold};
use crate::asset::layout::Label;
use crate::base::{Chains, Progress, Side, Stage};
use crate::domain::Cell;
use crate::geometry::{AabbTree, triangle_meets_tetrahedron};

/// What the lists are made from.
pub struct Lists<'a> {
    /// The surface.
    pub surface: &'a Surface,
    /// A tree over its faces.
    pub tree: &'a AabbTree,
    /// The options for encoder, tightening, truncation and deformation.
    pub options: &'a EncodeOptions,
    /// Lengths of the local frame per unit of the mesh.
    pub scale: f64,
    /// Truncation keeps the faces that are needed nearer to the surface than this (local frame).
    pub kept_within: f64,
}

/// The list of a cell, and what is proved of it.
#[derive(Clone, Debug, PartialEq)]
pub struct List {
    /// Face ids, ascending.
    pub faces: Vec<u32>,
    /// Distance from the surface within which the list is exact (local frame). It is infinite,
    /// unless the list was truncated.
    pub exact_within: f64,
    /// The chains of rule C that the proof rests on. `None`: nothing is proved.
    pub proof: Option<Chains>,
}

/// The labels of all cells in depth-first order, and what is proved of all lists.
#[derive(Clone, Debug)]
pub struct Finished {
    /// The labels.
    pub labels: Vec<Label>,
    /// The least distance of all lists.
    pub exact_within: f64,
    /// The heaviest chains of all lists. `None`: at least one list is not proved.
    pub proof: Option<Chains>,
}

/// The faces of a list before any are added or dropped.
struct RankedFaces {
    ranked: Vec<Ranked>,
    proof: Option<Chains>,
}

impl Lists<'_> {
    /// Finishes the lists and labels the cells. `signs` labels the cells of the bisection domain.
    /// `sampler` is for the sampled encoder.
    pub fn finish(
        &self,
        trees: &mut [Tree],
        roots: &Roots,
        signs: &CellSigns,
        sampler: &dyn Sampler,
        progress: &Progress,
    ) -> Result<Finished, EncodeError> {
        let mut cells = Vec::new();
        for (root, tree) in trees.iter_mut().enumerate() {
            place(tree, roots.cells[root], root, &mut cells);
        }
        let mut leaves = Vec::with_capacity(cells.len());
        for tree in trees.iter_mut() {
            collect(tree, &mut |leaf| leaves.push(leaf));
        }
        let length = |leaf: &&mut Leaf| if let Leaf::Listed { faces, .. } = leaf { faces.len() } else { 0 };
        let entries = leaves.iter().map(length).sum();
        let levels = Levels::new(self.options.tighten_levels, entries, self.surface.faces.len());
        progress.begin(Stage::Tighten, leaves.len() as u64);
        let (sampled, step) = match &self.options.method {
            Method::Certified => (leaves.iter().map(|_| None).collect(), 1),
            // The sampler has done nearly all of the work by then.
            Method::Sampled(sampling) => (self.sampled(&leaves, &cells, sampling, sampler, progress)?, 0),
        };
        let finished: Option<Vec<(Label, f64, Option<Chains>)>> = leaves
            .into_par_iter()
            .zip(cells)
            .zip(sampled)
            .map_init(Scratch::default, |scratch, ((leaf, (cell, root)), sampled)| {
                progress.advance(step);
                if progress.is_cancelled() {
                    return None;
                }
                let mut exact_within = f64::INFINITY;
                let mut proof = Some(Chains::NONE);
                let mut crosses = false;
                if let Leaf::Listed { faces, crossing, chains } = leaf {
                    crosses = *crossing;
                    let tetrahedron = roots.tetrahedra.get(root);
                    let levels = match tetrahedron {
                        // Refinement has tightened them already.
                        _ if self.options.groups.is_some() => 0,
                        None => levels.of(faces),
                        // Wide cells have long lists, which shorten well.
                        Some(_) => self.options.tighten_levels,
                    };
                    let found = sampled.unwrap_or_else(|| self.found(&cell, faces, levels, *chains, scratch));
                    let list = self.completed(&cell, tetrahedron, faces, crosses, found);
                    (*faces, exact_within, proof) = (list.faces, list.exact_within, list.proof);
                }
                let label = match (&leaf, roots.sides.get(root)) {
                    (Leaf::Outside, _) | (_, Some(Side::Outside)) => Label::Outside,
                    (_, Some(Side::Inside)) => Label::Inside,
                    (_, None) => signs.label(&cell, crosses),
                };
                Some((label, exact_within, proof))
            })
            .collect();
        let finished = finished.ok_or(EncodeError::Cancelled)?;
        let exact_within = finished.iter().map(|f| f.1).fold(f64::INFINITY, f64::min);
        let proof = finished.iter().map(|f| f.2).fold(Some(Chains::NONE), Chains::of_both);
        Ok(Finished { labels: finished.into_iter().map(|f| f.0).collect(), exact_within, proof })
    }

    /// Makes the list of a cell.
    ///
    /// `tetrahedron` is the tetrahedron of the conforming domain that has the cell, or `None`.
    /// `faces` contains all faces that the cell needs, and `chains` are those of the filters that
    /// left `faces`.
    pub fn of_cell(
        &self,
        cell: &Cell,
        tetrahedron: Option<&[u32; 4]>,
        faces: &[u32],
        chains: Chains,
        scratch: &mut Scratch,
    ) -> List {
        let found = self.found(cell, faces, self.options.tighten_levels, chains, scratch);
        self.completed(cell, tetrahedron, faces, false, found)
    }

    /// The faces that Alg. 1 finds in each listed cell, before any are added or dropped. `None` for
    /// other leaves.
    fn sampled(
        &self,
        leaves: &[&mut Leaf],
        cells: &[(Cell, usize)],
        sampling: &Sampling,
        sampler: &dyn Sampler,
        progress: &Progress,
    ) -> Result<Vec<Option<RankedFaces>>, EncodeError> {
        let mut found = Vec::with_capacity(leaves.len());
        for (leaves, cells) in leaves.chunks(SAMPLED_AT_ONCE).zip(cells.chunks(SAMPLED_AT_ONCE)) {
            let listed = leaves.par_iter().zip(cells).filter(|(leaf, _)| matches!(leaf, Leaf::Listed { .. }));
            let listed: Vec<SampledCell> = listed
                .map(|(_, (cell, _))| SampledCell::new(self.surface, self.tree, *cell, sampling, self.scale))
                .collect();
            let distances = sampler.sample(self.surface, &listed, sampling, progress)?;
            let of_cell = |scratch: &mut Scratch, (cell, least): (&SampledCell, &Vec<f64>)| {
                self.sampled_found(cell, least, sampling, scratch)
            };
            let of_listed: Vec<RankedFaces> =
                listed.par_iter().zip(&distances).map_init(Scratch::default, of_cell).collect();
            let mut of_listed = of_listed.into_iter();
            found.extend(leaves.iter().map(|leaf| match leaf {
                Leaf::Listed { .. } => of_listed.next(),
                _ => None,
            }));
            progress.advance(leaves.len() as u64);
        }
        Ok(found)
    }

    /// The faces of a cell's list, before any are added or dropped. `chains` are those of the
    /// filters that left `faces`.
    fn found(
        &self,
        cell: &Cell,
        faces: &[u32],
        levels: u32,
        chains: Chains,
        scratch: &mut Scratch,
    ) -> RankedFaces {
        match &self.options.method {
            Method::Certified => {
                let (tight, chains) = match levels {
                    0 => (faces.to_vec(), chains),
                    _ => tighten(self.surface, cell, faces, levels, chains, scratch),
                };
                self.proved(cell, &tight, chains, scratch)
            }
            Method::Sampled(sampling) => {
                let sampled = SampledCell::new(self.surface, self.tree, *cell, sampling, self.scale);
                let least = sample(self.surface, &sampled, sampling, scratch);
                self.sampled_found(&sampled, &least, sampling, scratch)
            }
        }
    }

    /// The faces of an exact list, ranked where the list is to be cut.
    fn proved(&self, cell: &Cell, list: &[u32], chains: Chains, scratch: &mut Scratch) -> RankedFaces {
        let (ranked, chains) = match self.options.max_entries {
            Some(most) if list.len() > most as usize => rank(self.surface, cell, list, chains, scratch),
            _ => (list.iter().map(|&face| Ranked { face, order: 0.0, distance: 0.0 }).collect(), chains),
        };
        RankedFaces { ranked, proof: Some(chains) }
    }

    /// E_t of Alg. 1: the candidates with a d_f.
    ///
    /// A threshold as wide as the grid makes the list exact (docs/math.md, 3), if the sampler did
    /// its work correctly. The result of a [`Sampler`] is no proof. So the certified filter has to
    /// agree, and only its own bounds tell the distance from which on a face is needed.
    fn sampled_found(
        &self,
        cell: &SampledCell,
        least: &[f64],
        sampling: &Sampling,
        scratch: &mut Scratch,
    ) -> RankedFaces {
        let found = cell.faces.iter().zip(least).filter(|(_, least)| least.is_finite());
        let ranked: Vec<Ranked> =
            found.map(|(&face, &distance)| Ranked { face, order: distance, distance }).collect();
        let Threshold::CoveringRadius = sampling.threshold else {
            return RankedFaces { ranked, proof: None };
        };
        let list: Vec<u32> = ranked.iter().map(|r| r.face).collect();
        match holds(self.surface, &cell.cell, &cell.faces, &list, scratch) {
            Some(chains) => self.proved(&cell.cell, &list, chains, scratch),
            None => RankedFaces { ranked, proof: None },
        }
    }

    /// Adds the faces that the cell must have whatever the encoder found, and truncates the list.
    /// The arguments are those of [`of_cell`](Self::of_cell).
    fn completed(
        &self,
        cell: &Cell,
        tetrahedron: Option<&[u32; 4]>,
        faces: &[u32],
        crossing: bool,
        RankedFaces { mut ranked, proof }: RankedFaces,
    ) -> List {
        if crossing {
            // The sign of a point is counted over these faces.
            let corners = |&face: &u32| self.surface.triangles[face as usize].corners;
            let meets = |face: &u32| triangle_meets_tetrahedron(&corners(face), &cell.corners, PAD);
            raise(&mut ranked, faces.iter().copied().filter(meets), f64::NEG_INFINITY);
        }
        if let (Deformation::Expected, Some(tetrahedron)) = (self.options.deformation, tetrahedron) {
            let of_surface = |v: &u32| (*v as usize) < self.surface.vertex_count();
            let around = tetrahedron.iter().copied().filter(of_surface);
            let faces: Vec<u32> = around.flat_map(|v| self.surface.vertex_faces(v).iter().copied()).collect();
            raise(&mut ranked, faces.into_iter(), 0.0);
        }
        let (faces, exact_within) = truncated(ranked, self.options.max_entries, self.kept_within);
        List { faces, exact_within, proof }
    }
}

/// Number of cells whose candidates the sampled encoder holds at a time.
const SAMPLED_AT_ONCE: usize = 1 << 10;

/// Adds `faces` to the list where they are missing, and lowers their order to `order`.
fn raise(ranked: &mut Vec<Ranked>, faces: impl Iterator<Item = u32>, order: f64) {
    ranked.sort_unstable_by_key(|r| r.face);
    let known = ranked.len();
    for face in faces {
        match ranked[..known].binary_search_by_key(&face, |r| r.face) {
            Ok(at) => ranked[at].order = ranked[at].order.min(order),
            Err(_) => ranked.push(Ranked { face, order, distance: f64::INFINITY }),
        }
    }
    ranked.sort_by_key(|r| r.face);
    ranked.dedup_by_key(|r| r.face);
}

/// The first `most` faces by order, with their ids ascending. Also the least distance at which a
/// dropped face may be needed.
///
/// This is distance-ordered truncation (Sec. V-C). Faces of order −∞ are never dropped, and neither
/// are faces that are needed nearer to the surface than `kept_within`.
fn truncated(mut ranked: Vec<Ranked>, most: Option<u32>, kept_within: f64) -> (Vec<u32>, f64) {
    let most = most.map_or(ranked.len(), |most| most as usize);
    let mut exact_within = f64::INFINITY;
    if ranked.len() > most {
        let kept = ranked.iter_mut().filter(|r| r.distance < kept_within);
        kept.for_each(|r| r.order = f64::NEG_INFINITY);
        // The faces for deformation have the order 0. Of these, the faces that are needed nearest
        // to the surface at rest come first.
        let key =
            |a: &Ranked, b: &Ranked| a.order.total_cmp(&b.order).then(a.distance.total_cmp(&b.distance));
        ranked.sort_by(|a, b| key(a, b).then(a.face.cmp(&b.face)));
        let held = ranked.partition_point(|r| r.order == f64::NEG_INFINITY);
        exact_within = ranked[most.max(held)..].iter().map(|r| r.distance).fold(exact_within, f64::min);
        ranked.truncate(most.max(held));
    }
    let mut faces: Vec<u32> = ranked.into_iter().map(|r| r.face).collect();
    faces.sort_unstable();
    (faces, exact_within)
}

/// Collects the cells of the leaves in depth-first order, each with its root.
fn place(tree: &Tree, cell: Cell, root: usize, cells: &mut Vec<(Cell, usize)>) {
    match tree {
        Tree::Leaf(_) => cells.push((cell, root)),
        Tree::Split(children) => {
            children.iter().enumerate().for_each(|(side, child)| place(child, cell.child(side), root, cells));
        }
    }
}
