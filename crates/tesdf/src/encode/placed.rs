//! A solid and its domain in the local frame, and the first cells.
use super::attempts::{EFFORT_PER_FACE, refine, refine_within_effort};
use super::cell_signs::CellSigns;
use super::effort::Effort;
use super::error::EncodeError;
use super::lists::Finished;
use super::refine::{GroupWeights, Refiner, Tree, Weights};
use super::roots::{Domain, Roots};
use super::sampled::{Sampler, lipschitz_candidates};
use super::statistics::statistics;
use super::surface::{Surface, Touching};
use super::tighten::Levels;
use super::validate::{validated, validated_inside};
use super::{EncodeOptions, Method, Refinement, Source};
use crate::asset::about::{About, Signs};
use crate::asset::layout;
use crate::base::{Certificate, Progress, Proved};
use crate::domain::{Cell, MAX_DEPTH};
use crate::geometry::{Aabb, AabbTree, LocalFrame};
use crate::mesh::{MeshError, Presented, SolidMesh, Telling, TriangleMesh};

/// The input of an encoding, in addition to the solid.
pub struct Request<'a> {
    /// Where the cells come from.
    pub domain: Domain<'a>,
    /// The file of the mesh, which the asset records.
    pub source: &'a Source,
    /// The options.
    pub options: &'a EncodeOptions,
    /// Looks at the samples of [`Method::Sampled`].
    pub sampler: &'a dyn Sampler,
    /// Shows how far the encoding is, and carries the request to stop.
    pub progress: &'a Progress,
}

/// The solid and its domain in the local frame, whose options are valid.
pub struct Placed {
    /// The frame.
    pub frame: LocalFrame,
    /// The roots of the domain.
    pub roots: Roots,
    /// The presented faces.
    local: TriangleMesh,
    /// What tells the sides of cells.
    pub signs: CellSigns,
    /// Diagonal of the mesh, in its unit.
    diagonal: f64,
    band: f64,
    /// Where lists should fit a group, and keep their faces when they are truncated.
    pub fit_within: f64,
    regions: Vec<Aabb>,
}

impl Placed {
    /// Checks the options, and takes the presented faces to the local frame.
    pub fn new(solid: &SolidMesh, presented: &Presented, request: &Request) -> Result<Self, EncodeError> {
        let Request { domain, options, .. } = request;
        let mesh = &*presented.mesh;
        if mesh.faces().is_empty() {
            return Err(EncodeError::NoSurface);
        }
        let diagonal = mesh.diagonal();
        let frame = LocalFrame::of(mesh.bounds());
        let band = validated(options, domain, diagonal)? * frame.scale;
        if mesh.faces().len() > layout::MAX_FACES {
            return Err(EncodeError::TooLarge {
                what: "faces",
                found: mesh.faces().len(),
                limit: layout::MAX_FACES,
            });
        }
        let local = local_mesh(mesh, frame)?;
        let signs = CellSigns::new(solid, presented, &local);
        validated_inside(solid, presented, signs.jumps(), domain, options)?;
        let in_frame = |r: Aabb| Aabb { min: frame.to_local(r.min), max: frame.to_local(r.max) };
        let regions: Vec<Aabb> = options.region_boxes().map(in_frame).collect();
        let bounds = local.bounds().grown(band);
        let roots = Roots::of(domain, bounds, &regions, frame, diagonal * frame.scale)?;
        let fit_within = options.fit_within(diagonal) * frame.scale;
        Ok(Self { frame, roots, local, signs, diagonal, band, fit_within, regions })
    }

    /// The surface that the lists are made of.
    pub fn surface(&self, domain: &Domain) -> Surface {
        let touching = match domain {
            Domain::Bisection => Touching::Kept,
            Domain::Conforming(_) => Touching::Ignored,
        };
        Surface::new(&self.local, self.roots.cube.side(), touching)
    }

    fn weights(&self, surface: &Surface, options: &EncodeOptions) -> Weights {
        let diagonal = self.diagonal * self.frame.scale;
        let near = NEAR * diagonal;
        let groups = options.groups.map(|groups| GroupWeights {
            size: f64::from(groups.size),
            fit_within: self.fit_within,
            levels: Levels::new(options.tighten_levels, 0, surface.faces.len()),
        });
        Weights {
            byte: options.byte_worth / surface.faces.len() as f64,
            near,
            per_volume: 1.0 / (surface.area.max(near * diagonal) * 4.0 * near),
            far_faces: FAR_FACES,
            far_list: FAR_LIST,
            far_distance: FAR_DISTANCE * diagonal,
            floor: groups.map_or(FLOOR, |g| FULL * g.size),
            long_faces: 0.0,
            groups,
        }
    }

    /// Bisects the roots.
    pub fn refine(
        &self,
        surface: &Surface,
        tree: &AabbTree,
        request: &Request,
    ) -> Result<Vec<Tree>, EncodeError> {
        let unlimited = Effort::new(u64::MAX);
        let mut refiner = Refiner {
            surface,
            weights: self.weights(surface, request.options),
            band: self.band,
            bounds: self.local.bounds(),
            regions: &self.regions,
            inside: &|p| self.signs.is_inside(p),
            max_depth: MAX_DEPTH,
            progress: request.progress,
            effort: &unlimited,
        };
        match request.domain {
            Domain::Bisection => refine_within_effort(refiner, &self.roots.cells, EFFORT_PER_FACE),
            Domain::Conforming(_) => {
                // The whole mesh of tetrahedra is the domain, and every cell gets a list.
                refiner.band = f64::INFINITY;
                refiner.weights.far_list = usize::MAX;
                if request.options.refinement == Refinement::None {
                    refiner.max_depth = 0;
                }
                let candidates = |cell: &Cell| lipschitz_candidates(surface, tree, cell);
                refine(&refiner, &self.roots.cells, candidates).ok_or(EncodeError::Cancelled)
            }
        }
    }

    /// What the asset says about itself.
    pub fn about(
        &self,
        solid: &SolidMesh,
        presented: &Presented,
        request: &Request,
        trees: &[Tree],
        finished: &Finished,
    ) -> About {
        let encoder = match request.options.method {
            Method::Certified => "certified".into(),
            Method::Sampled(_) => request.sampler.name(),
        };
        let proved = Proved { within: finished.exact_within / self.frame.scale, chains: finished.proof };
        let (domain, side) = (request.domain.name().into(), self.roots.cube.side());
        let mut certificate = Certificate::new(encoder, domain, self.diagonal, side, proved);
        certificate.inside = *solid.inside();
        certificate.jumps = self.signs.jumps();
        About {
            source: request.source.clone(),
            options: EncodeOptions { inside: *solid.inside(), ..request.options.clone() },
            certificate,
            signs: match presented.telling {
                Telling::Winding => Signs::Cells,
                Telling::Rule => Signs::Rule,
                Telling::RuleUnoriented => Signs::RuleUnoriented,
                Telling::Sheet => Signs::Sheet,
            },
            statistics: statistics(trees, &finished.labels, &self.roots.cells, &presented.mesh, self.frame),
        }
    }
}

/// Half width of the layer around the surface in which a query counts in full, as a share of the
/// diagonal.
const NEAR: f64 = 0.01;
/// Faces and nodes that a query by the face tree reads where lists are long. On bolt and nut it
/// reads 270 to 330.
const FAR_FACES: f64 = 250.0;
/// A cell with a shorter list is never left to the face tree.
const FAR_LIST: usize = 48;
/// A cell nearer to the surface than this share of the diagonal is never left to the face tree.
const FAR_DISTANCE: f64 = 0.025;
/// Refinement is not expected to make a list shorter than this.
const FLOOR: f64 = 6.0;
/// The same where lists are read in groups, as a share of a group: tightening makes such a list
/// shorter, and merging fills it again.
const FULL: f64 = 0.75;

fn local_mesh(mesh: &TriangleMesh, frame: LocalFrame) -> Result<TriangleMesh, MeshError> {
    let vertices = mesh.vertices().iter().map(|&v| frame.to_local(v)).collect();
    TriangleMesh::new(vertices, mesh.faces().to_vec())
}
