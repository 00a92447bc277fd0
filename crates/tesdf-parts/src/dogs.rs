use std::f64::consts::{PI, TAU};

use tesdf::glam::DVec2;

use crate::error::{PartError, above, below, count, not_negative, positive};
use crate::outline::polar;
use crate::resolution::Resolution;
use crate::surface::{Facing, Loop, Surface};

/// The teeth of a dog clutch (face clutch) on the end of a gear or sleeve: sectors of a ring with
/// radial sides. The middle of the first tooth is on +x.
///
/// Two equal clutches that face each other fit when one is turned by half of a pitch, 180° /
/// `count`. The side of a tooth is then `clearance` from the side of the next one, measured along
/// the mean circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dogs {
    /// Number of teeth.
    pub count: usize,
    /// Radius of the inner ends of the teeth, in metres.
    pub inner_radius: f64,
    /// Radius of the outer ends of the teeth, in metres.
    pub outer_radius: f64,
    /// Height of the teeth above the face, in metres.
    pub height: f64,
    /// Gap between the sides of two engaged clutches along the mean circle, in metres.
    pub clearance: f64,
}

impl Dogs {
    /// Half of the angle of a tooth.
    fn half_angle(&self) -> f64 {
        let mean = (self.inner_radius + self.outer_radius) / 2.0;
        PI / (2 * self.count) as f64 - self.clearance / mean / 2.0
    }

    /// Checks the teeth, which stand on a ring between two radii.
    pub(crate) fn check(&self, ring: [f64; 2]) -> Result<(), PartError> {
        count("number of dog teeth", self.count, 2..=64)?;
        positive("height of the dog teeth", self.height)?;
        not_negative("clearance of the dog teeth", self.clearance)?;
        above("inner radius of the dog teeth", self.inner_radius, ring[0], ", the radius of the bore")?;
        above("outer radius of the dog teeth", self.outer_radius, self.inner_radius, ", their inner radius")?;
        below("outer radius of the dog teeth", self.outer_radius, ring[1], ", the radius of the face")?;
        let pitch = PI * (self.inner_radius + self.outer_radius) / (2 * self.count) as f64;
        below("clearance of the dog teeth", self.clearance, 0.9 * pitch, ", nine tenths of a tooth")
    }

    fn outlines(&self, resolution: Resolution) -> impl Iterator<Item = Vec<DVec2>> {
        let half = self.half_angle();
        let segments = resolution.arc(self.outer_radius, 2.0 * half).max(2);
        let Self { count, inner_radius, outer_radius, .. } = *self;
        (0..count).map(move |k| {
            let angle =
                |i: usize| TAU * k as f64 / count as f64 + half * (2.0 * i as f64 / segments as f64 - 1.0);
            let outer = (0..=segments).map(|i| polar(outer_radius, angle(i)));
            outer.chain((0..=segments).rev().map(|i| polar(inner_radius, angle(i)))).collect()
        })
    }

    /// Adds the teeth on a face at the height `z`. Returns their outlines there, which are holes of
    /// the face.
    fn build(
        &self,
        surface: &mut Surface,
        z: f64,
        facing: Facing,
        resolution: Resolution,
    ) -> Result<Vec<Loop>, PartError> {
        let mut feet = Vec::new();
        for outline in self.outlines(resolution) {
            let foot = surface.outline(&outline, z);
            let top = surface
                .outline(&outline, if facing == Facing::Up { z + self.height } else { z - self.height });
            match facing {
                Facing::Up => surface.band(&foot, &top),
                Facing::Down => surface.band(&top, &foot),
            }
            surface.level(facing, &[&top])?;
            feet.push(foot);
        }
        Ok(feet)
    }
}

/// A level end with its teeth, if it has any: the face inside of the first curve and outside of the
/// others.
pub(crate) fn end(
    surface: &mut Surface,
    facing: Facing,
    curves: &[&[u32]],
    dogs: Option<&Dogs>,
    resolution: Resolution,
) -> Result<(), PartError> {
    let z = surface.position(curves[0][0]).z;
    let feet = match dogs {
        Some(dogs) => dogs.build(surface, z, facing, resolution)?,
        None => Vec::new(),
    };
    let curves: Vec<&[u32]> = curves.iter().copied().chain(feet.iter().map(Vec::as_slice)).collect();
    surface.level(facing, &curves)
}
