use super::assemble::assemble;
use super::error::EncodeError;
use super::hints::{Simplicity, sign_hints};
use super::lists::Lists;
use super::placed::{Placed, Request};
use super::sections::Parts;
use crate::asset::TeSdf;
use crate::asset::layout::TREE_LEAF;
use crate::base::Stage;
use crate::geometry::{Aabb, AabbTree};
use crate::mesh::SolidMesh;
use crate::verify::self_check;

/// Encodes a solid; see [`Encoder::encode`](super::Encoder::encode).
pub fn encode(solid: &SolidMesh, request: &Request) -> Result<TeSdf, EncodeError> {
    let presented = solid.presented()?;
    let placed = Placed::new(solid, &presented, request)?;
    let surface = placed.surface(&request.domain);
    let boxes: Vec<Aabb> = surface.triangles.iter().map(|t| Aabb::of(&t.corners)).collect();
    let tree = AabbTree::build(&boxes, TREE_LEAF);
    let mut trees = placed.refine(&surface, &tree, request)?;
    let lists = Lists {
        surface: &surface,
        tree: &tree,
        options: request.options,
        scale: placed.frame.scale,
        kept_within: placed.fit_within,
    };
    let finished =
        lists.finish(&mut trees, &placed.roots, &placed.signs, request.sampler, request.progress)?;

    request.progress.begin(Stage::Assemble, 1);
    let simplicity = if presented.is_simple { Simplicity::Simple } else { Simplicity::Involved };
    let hints = sign_hints(&surface, &tree, simplicity);
    let mut position = vec![0u32; tree.order().len()];
    for (at, &face) in tree.order().iter().enumerate() {
        position[face as usize] = at as u32;
    }
    let forest = assemble(&mut trees, &finished.labels, &position, &placed.roots.order())?;
    let about = placed.about(solid, &presented, request, &trees, &finished);
    let parts = Parts { presented: &presented, placed: &placed, tree: &tree, hints: &hints, forest: &forest };
    checked(TeSdf::from_bytes(&parts.write(request, &about)?)?, solid)
}

/// Compares an asset whose certificate claims something with the mesh.
fn checked(asset: TeSdf, solid: &SolidMesh) -> Result<TeSdf, EncodeError> {
    if asset.about().certificate().delta().is_some()
        && let Some((precision, worst)) = self_check(&asset, solid)?
    {
        return Err(EncodeError::SelfCheck { precision, worst: Box::new(worst) });
    }
    Ok(asset)
}
