//! An asset of a file, with its lists as they are.
use std::path::Path;

use super::error::ImportJsonError;
use super::file::Encoded;
use super::read::read;
use crate::asset::TeSdf;
use crate::asset::about::Source;
use crate::asset::layout::{Label, TREE_LEAF};
use crate::base::{Certificate, Chains, Progress, Proved, Side};
use crate::domain::{ConformingMesh, TetMesh};
use crate::encode::assemble::assemble;
use crate::encode::hints::{Simplicity, sign_hints};
use crate::encode::lists::Finished;
use crate::encode::placed::{Placed, Request};
use crate::encode::refine::{Leaf, Tree};
use crate::encode::sections::Parts;
use crate::encode::{Domain, EncodeError, EncodeOptions, Processor, Refinement};
use crate::geometry::{Aabb, AabbTree};
use crate::mesh::{SolidMesh, TriangleMesh};

/// What an imported asset says of its encoder.
const ENCODER: &str = "imported from JSON of TES-Encoder";

impl TeSdf {
    /// Reads a JSON file of TES-Encoder, the program of the paper's authors.
    ///
    /// The lists stay as they are in the file, and nothing is proved of them: the certificate has
    /// no [`delta`](Certificate::delta), and [`prove`](crate::verify::prove) shows where a list
    /// misses a face. The surface and the tetrahedra are checked, as [`ConformingMesh`] says. Each
    /// tetrahedron is on the side of its group. Its corners may be in either order. Coordinates
    /// are in the unit of the file, which has no name.
    ///
    /// # Errors
    /// [`ImportJsonError`]: the file cannot be read, or it names the key and the place in its array
    /// where a value does not fit.
    pub fn import_json(path: impl AsRef<Path>) -> Result<Self, ImportJsonError> {
        let path = path.as_ref();
        let bytes = crate::input::read(path)
            .map_err(|source| ImportJsonError::Read { path: path.to_owned(), source })?;
        let source = Source::of_file(path, blake3::hash(&bytes).to_hex().to_string());
        Self::import_json_bytes(&bytes, &source)
    }

    /// The same as [`import_json`](Self::import_json), for the bytes of a file. The asset records
    /// `source`.
    ///
    /// # Errors
    /// The same as for [`import_json`](Self::import_json).
    pub fn import_json_bytes(bytes: &[u8], source: &Source) -> Result<Self, ImportJsonError> {
        let encoded = read(bytes)?;
        let surface = encoded.vertices[..encoded.surface_vertices].to_vec();
        let solid = SolidMesh::new(TriangleMesh::new(surface, encoded.faces.clone())?)?;
        let tetrahedra = TetMesh::new(encoded.vertices.clone(), encoded.tetrahedra.clone())?;
        let domain = ConformingMesh::new(&solid, &tetrahedra)?;
        for (t, found) in domain.sides().iter().enumerate() {
            let (group, at) = encoded.place(t);
            if *found != group.side {
                let side = |side| if side == Side::Inside { "inside" } else { "outside" };
                return Err(ImportJsonError::Value {
                    place: format!("{}[{at}]", group.tetrahedra),
                    found: format!("a tetrahedron {} of the surface", side(*found)),
                    expected: format!("one {}", side(group.side)),
                });
            }
        }
        Ok(assembled(encoded, &solid, &domain, source)?)
    }
}

/// The asset of a solid with the lists of a file.
fn assembled(
    encoded: Encoded,
    solid: &SolidMesh,
    domain: &ConformingMesh,
    source: &Source,
) -> Result<TeSdf, EncodeError> {
    let options = EncodeOptions { refinement: Refinement::None, ..EncodeOptions::default() };
    let progress = Progress::default();
    let domain = Domain::Conforming(domain);
    let request = Request { domain, source, options: &options, sampler: &Processor, progress: &progress };
    let presented = solid.presented()?;
    let placed = Placed::new(solid, &presented, &request)?;
    let surface = placed.surface(&domain);
    let boxes: Vec<Aabb> = surface.triangles.iter().map(|t| Aabb::of(&t.corners)).collect();
    let tree = AabbTree::build(&boxes, TREE_LEAF);
    let simplicity = if presented.is_simple { Simplicity::Simple } else { Simplicity::Involved };
    let hints = sign_hints(&surface, &tree, simplicity);
    let listed = |faces| Tree::Leaf(Leaf::Listed { faces, crossing: false, chains: Chains::NONE });
    let mut trees: Vec<Tree> = encoded.lists.into_iter().map(listed).collect();
    let label = |side: &Side| if *side == Side::Inside { Label::Inside } else { Label::Outside };
    let labels: Vec<Label> = placed.roots.sides.iter().map(label).collect();
    let finished = Finished { labels, exact_within: f64::INFINITY, proof: None };
    let forest = assemble(&mut trees, &finished.labels, &positions(&tree), &placed.roots.order())?;
    let mut about = placed.about(solid, &presented, &request, &trees, &finished);
    let proved = Proved { within: f64::INFINITY, chains: None };
    let (diagonal, side) = (presented.mesh.diagonal(), placed.roots.cube.side());
    about.certificate = Certificate::new(ENCODER.into(), domain.name().into(), diagonal, side, proved);
    let parts = Parts { presented: &presented, placed: &placed, tree: &tree, hints: &hints, forest: &forest };
    let bytes = parts.write(&request, &about)?;
    Ok(TeSdf::from_bytes(&bytes)?)
}

/// The place of each face in the asset.
fn positions(tree: &AabbTree) -> Vec<u32> {
    let mut position = vec![0; tree.order().len()];
    tree.order().iter().enumerate().for_each(|(at, &face)| position[face as usize] = at as u32);
    position
}
