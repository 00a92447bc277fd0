//! Whether the units of assets fit together in a scene.
use tesdf::base::unit::metres;
use tesdf::collide::{Shape, ShapeId};

use super::BodySection;
use crate::System;

/// What a body makes of the unit that its asset records.
#[derive(Clone, Copy)]
pub(super) struct Measure<'a> {
    body: &'a str,
    scale: f64,
    /// Metres of the unit.
    metres: f64,
}

impl<'a> Measure<'a> {
    /// `None` when no unit that is known is recorded.
    pub fn of(system: &System, body: &'a BodySection, shape: ShapeId) -> Option<Self> {
        let Ok(Shape::Mesh(asset)) = system.scene().shape(shape) else { return None };
        Some(Self { body: &body.name, scale: body.scale, metres: metres(asset.unit()?)? })
    }

    /// Assets of one unit may have any scales. Where units differ, the scales have to make one unit of them.
    pub fn check(&self, other: &Self) -> Result<(), String> {
        let expected = other.scale * self.metres / other.metres;
        if self.metres == other.metres || (self.scale / expected - 1.0).abs() <= 1e-9 {
            return Ok(());
        }
        Err(format!(
            "the unit of its asset is {} m, that of body {} is {} m with scale = {}: they do not fit together with scale = {}; \
             give scale = {expected}, or encode the mesh without --unit to scale it at will",
            self.metres, other.body, other.metres, other.scale, self.scale
        ))
    }
}
