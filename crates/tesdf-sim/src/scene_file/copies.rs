//! Bodies that are given once and placed many times, as the links of a chain.
use serde::{Deserialize, Serialize};
use tesdf::collide::Pose;
use tesdf::glam::{DQuat, DVec3};
use toml::Spanned;

use super::{BodySection, MAX_BODIES, PoseSection, identity};

/// Copies of a body, each placed by the one before. The names of the bodies are the name and a
/// number from 0 on: `link0`, `link1`, …
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CopiesSection {
    /// How many bodies there are.
    pub count: usize,
    /// The next copy's origin in the frame of the one before, m.
    #[serde(default)]
    pub translation: [f64; 3],
    /// The next copy's orientation in the frame of the one before: a unit quaternion x y z w.
    #[serde(default = "identity")]
    pub rotation: [f64; 4],
    /// Both together: x y z qx qy qz qw, or the rows of a matrix of 4 × 4. A loaded scene has them
    /// apart.
    #[serde(default, skip_serializing)]
    pub pose: Option<PoseSection>,
}

/// A body whose copies are not valid, and what is wrong with them.
pub(super) type Refused = (Box<Spanned<BodySection>>, String);

/// The bodies with all copies.
///
/// # Errors
/// The body at fault.
pub(super) fn expand(bodies: Vec<Spanned<BodySection>>) -> Result<Vec<Spanned<BodySection>>, Refused> {
    let mut expanded = Vec::with_capacity(bodies.len());
    for body in bodies {
        match copies(body.get_ref(), expanded.len()) {
            Ok(None) => expanded.push(body),
            Ok(Some(copies)) => {
                expanded.extend(copies.into_iter().map(|copy| Spanned::new(body.span(), copy)));
            }
            Err(reason) => return Err((Box::new(body), reason)),
        }
    }
    Ok(expanded)
}

/// The copies of a body that comes after `before` others; `None` if it has no copies.
fn copies(body: &BodySection, before: usize) -> Result<Option<Vec<BodySection>>, String> {
    let Some(CopiesSection { count, translation, rotation, .. }) = body.copies else { return Ok(None) };
    if count == 0 || count > MAX_BODIES - before.min(MAX_BODIES) {
        return Err(format!("copies.count is {count}; expected 1 to {MAX_BODIES} bodies in the scene"));
    }
    let pose = |translation, rotation| {
        Pose::new(DVec3::from_array(translation), DQuat::from_array(rotation)).map_err(|e| e.to_string())
    };
    let mut at = pose(body.translation, body.rotation)?;
    let next = pose(translation, rotation).map_err(|e| format!("copies: {e}"))?;
    let copy = |number: usize| {
        let copy = BodySection {
            name: format!("{}{number}", body.name),
            translation: at.translation.to_array(),
            rotation: at.rotation.to_array(),
            copies: None,
            ..body.clone()
        };
        // The product of unit quaternions is one up to rounding, which would add up.
        let rotation = (at.rotation * next.rotation).normalize();
        at = Pose { translation: at.to_world(next.translation), rotation };
        copy
    };
    Ok(Some((0..count).map(copy).collect()))
}
