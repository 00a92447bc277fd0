//! Where the mode `node` can miss a contact.
use crate::parallel::*;

use crate::collide::detect::ordered_pair::OrderedPair;
use crate::collide::mode::Mode;
use crate::collide::options::{CollideOptions, Reduction};
use crate::collide::scene::Scene;
use crate::collide::scene::error::CollideError;
use crate::collide::scene::ids::InstanceId;
use crate::query::corner_reach;

/// A face that touches, and that is large against the body that it touches. The mode
/// [`Node`](Mode::Node) tests its vertices only, so it does not see what lies between them: two
/// equal boxes on top of each other, one turned by 30°, touch without a vertex on the other box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoarseContact {
    /// The body that has the face.
    pub instance_a: InstanceId,
    /// The body that it touches.
    pub instance_b: InstanceId,
    /// The face, 0-based in the encoded mesh.
    pub face_a: u32,
    /// The greatest distance of a point of the face from its nearest vertex, in the world's unit.
    pub corner_reach: f64,
    /// The least signed distance of the face, in the world's unit.
    pub distance: f64,
}

/// For each ordered pair of instances that touches with such a face, the first one. `options` are
/// those of the detection in the mode node; other modes see these contacts.
///
/// A face is large when its longest edge exceeds 1/16 of the diagonal of the smaller body.
///
/// # Errors
/// As [`detect`](crate::collide::detect()).
pub fn coarse_contacts(scene: &Scene, options: &CollideOptions) -> Result<Vec<CoarseContact>, CollideError> {
    let options = CollideOptions { mode: Mode::exact(), reduction: Reduction::None, ..*options };
    let pairs = OrderedPair::all(scene, &options)?;
    Ok(pairs.par_iter().filter_map(of_pair).collect())
}

fn of_pair(pair: &OrderedPair) -> Option<CoarseContact> {
    pair.candidates().into_iter().find_map(|candidate| {
        let (part, face_a, _) = pair.part(candidate);
        let corners: [_; 3] = part.points().try_into().ok()?;
        if !pair.search.is_large(&part) {
            return None;
        }
        let mut least: Option<f64> = None;
        pair.search_of([&part]).minima(&pair.field, &part, None, &mut |_| (), &mut |_, minimum| {
            let distance = minimum.value.distance - part.radius;
            least = Some(least.map_or(distance, |l| l.min(distance)));
        });
        let unit = pair.field.unit();
        least.map(|distance| CoarseContact {
            instance_a: pair.a,
            instance_b: pair.b,
            face_a,
            corner_reach: corner_reach(corners) * unit,
            distance: distance * unit,
        })
    })
}
