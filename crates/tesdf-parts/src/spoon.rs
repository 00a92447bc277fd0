use tesdf::SolidMesh;
use tesdf::base::elementary;
use tesdf::glam::DVec3;

use crate::error::{PartError, above, below, positive};
use crate::outline::angles;
use crate::resolution::Resolution;
use crate::surface::{Facing, Surface};

/// A spoon: a bowl and a bent handle, lofted through oval sections. It lies along +x with the tip
/// of the bowl near the origin, and the bowl is open upwards, to +z.
///
/// # Example
///
/// ```
/// use tesdf_parts::{Resolution, Spoon};
///
/// assert!(Spoon::DEFAULT.mesh(Resolution::DEFAULT)?.is_simple());
/// # Ok::<(), tesdf_parts::PartError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spoon {
    /// Length, in metres.
    pub length: f64,
    /// Width of the bowl, in metres.
    pub bowl_width: f64,
    /// Depth of the bowl, in metres.
    pub bowl_depth: f64,
    /// Width of the handle at its thinnest, in metres.
    pub handle_width: f64,
    /// Thickness at the rim of the bowl, in metres. The end of the handle is 2.75 times as thick.
    pub thickness: f64,
}

/// Where the middle of the bowl is, and how fast it ends, as shares of the length.
const BOWL: [f64; 2] = [0.17, 0.12];

/// A section of the spoon.
struct Oval {
    half_width: f64,
    depth: f64,
    height: f64,
    half_thickness: f64,
}

impl Spoon {
    /// A spoon of 160 mm with a bowl of 40 mm × 11 mm.
    pub const DEFAULT: Self =
        Self { length: 160e-3, bowl_width: 40e-3, bowl_depth: 11e-3, handle_width: 7e-3, thickness: 1.6e-3 };

    /// The section at a share of the length, from 0 to 1.
    fn section(&self, along: f64) -> Oval {
        let bump = |width: f64| elementary::exp(-elementary::powi((along - BOWL[0]) / width, 2));
        let ends = |power: i32| (1.0 - elementary::powi(2.0 * along - 1.0, power)).max(0.0).sqrt();
        let knob = 0.86 * elementary::exp(-elementary::powi((along - 0.93) / 0.08, 2));
        let handle = self.handle_width / 2.0;
        // The ends narrow the middle of the bowl a little, too.
        let narrowed = (1.0 - elementary::powi(1.0 - 2.0 * BOWL[0], 8)).sqrt();
        let bowl = self.bowl_width / 2.0 / narrowed - handle;
        Oval {
            half_width: (handle * (1.0 + knob) + bowl * bump(BOWL[1])) * ends(8),
            depth: self.bowl_depth * bump(BOWL[1] + 0.01),
            height: self.length * (0.0875 * along * along + 0.0375 * elementary::sin(3.0 * along)),
            half_thickness: self.thickness / 2.0 * ((1.0 + 1.75 * along) * ends(16) + 0.05),
        }
    }

    /// The mesh, in metres.
    ///
    /// # Errors
    /// [`PartError`] names the parameter at fault.
    pub fn mesh(&self, resolution: Resolution) -> Result<SolidMesh, PartError> {
        self.check(resolution)?;
        let around = resolution.turn(self.bowl_width / 2.0, 4);
        let along = around;
        let mut surface = Surface::new("spoon");
        // Close together at both ends, where the outline is round.
        let shares =
            (1..along).map(|i| (1.0 - elementary::cos(std::f64::consts::PI * i as f64 / along as f64)) / 2.0);
        let rings: Vec<_> = shares
            .map(|share| {
                let oval = self.section(share);
                surface.curve(angles(around).map(|angle| {
                    let across = elementary::cos(angle);
                    let bottom = oval.height - oval.depth * (1.0 - across * across);
                    DVec3::new(
                        share * self.length,
                        oval.half_width * across,
                        bottom + oval.half_thickness * elementary::sin(angle),
                    )
                }))
            })
            .collect();
        for pair in rings.windows(2) {
            surface.band(&pair[0], &pair[1]);
        }
        let tip = |share: f64| {
            let oval = self.section(share);
            DVec3::new(share * self.length, 0.0, oval.height - oval.depth)
        };
        surface.fan(tip(0.0), &rings[0], Facing::Down);
        surface.fan(tip(1.0), &rings[rings.len() - 1], Facing::Up);
        surface.finish()
    }

    fn check(&self, resolution: Resolution) -> Result<(), PartError> {
        resolution.check(self.bowl_width / 2.0)?;
        positive("width of the handle", self.handle_width)?;
        above("width of the bowl", self.bowl_width, self.handle_width, ", the width of the handle")?;
        above("length", self.length, 2.0 * self.bowl_width, ", twice the width of the bowl")?;
        positive("depth of the bowl", self.bowl_depth)?;
        below("depth of the bowl", self.bowl_depth, self.bowl_width, ", its width")?;
        positive("thickness", self.thickness)?;
        below("thickness", self.thickness, self.handle_width / 2.0, ", half of the width of the handle")
    }
}
