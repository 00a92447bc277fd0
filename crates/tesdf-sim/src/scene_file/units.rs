//! Checks whether the units of a scene's assets agree with the scales of its bodies.
use tesdf::base::unit::metres;
use tesdf::collide::{Shape, ShapeId};

use super::BodySection;
use crate::System;

/// The unit that a body's asset records, and the body's scale.
#[derive(Clone, Copy)]
pub(super) struct Measure<'a> {
    body: &'a str,
    scale: f64,
    /// Length of the unit, m.
    metres: f64,
}

impl<'a> Measure<'a> {
    /// Returns `None` when the asset records no unit, or a unit that is not known.
    pub fn of(system: &System, body: &'a BodySection, shape: ShapeId) -> Option<Self> {
        let Ok(Shape::Mesh(asset)) = system.scene().shape(shape) else { return None };
        Some(Self { body: &body.name, scale: body.scale, metres: metres(asset.unit()?)? })
    }

    /// Assets that record the same unit may have any scales. Where the units differ, the scales
    /// must bring them to one unit.
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
