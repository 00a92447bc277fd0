use std::f64::consts::{FRAC_PI_2, PI};

use tesdf::SolidMesh;
use tesdf::base::elementary;
use tesdf::glam::{DVec2, DVec3};

use crate::error::{PartError, above, positive};
use crate::outline::angles;
use crate::resolution::Resolution;
use crate::surface::Surface;

/// A chain link: a round wire along two straight lines and two half circles, in the plane z = 0,
/// long in x, with its centre at the origin.
///
/// The next link of a straight chain is turned by 90° about x and moved along x by
/// [`pitch`](Self::pitch). At that distance the links touch.
///
/// # Example
///
/// ```
/// use tesdf_parts::{ChainLink, Resolution};
///
/// assert!((ChainLink::DEFAULT.pitch() - 0.029).abs() < 1e-12);
/// assert!(ChainLink::DEFAULT.mesh(Resolution::DEFAULT)?.is_simple());
/// # Ok::<(), tesdf_parts::PartError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainLink {
    /// Diameter of the wire, in metres.
    pub wire_diameter: f64,
    /// Length of the straight parts, in metres.
    pub straight: f64,
    /// Radius of the half circles, to the middle of the wire, in metres.
    pub bend_radius: f64,
}

impl ChainLink {
    /// A wire of 5 mm, 20 mm straight, and bends of 7 mm.
    pub const DEFAULT: Self = Self { wire_diameter: 5e-3, straight: 20e-3, bend_radius: 7e-3 };

    /// The inner length, which is the distance from link to link in a tight chain, in metres.
    pub fn pitch(&self) -> f64 {
        self.straight + 2.0 * self.bend_radius - self.wire_diameter
    }

    /// The width of the link, in metres.
    pub fn width(&self) -> f64 {
        2.0 * self.bend_radius + self.wire_diameter
    }

    /// The mesh, in metres.
    ///
    /// # Errors
    /// [`PartError`] names the parameter at fault.
    pub fn mesh(&self, resolution: Resolution) -> Result<SolidMesh, PartError> {
        self.check(resolution)?;
        let Self { wire_diameter, straight, bend_radius } = *self;
        let wire = wire_diameter / 2.0;
        let around = resolution.turn(wire, 4);
        let bend = resolution.arc(bend_radius + wire, PI).next_multiple_of(2);
        // As long as the chords of the bends, and at most 256.
        let along = (straight / (PI * bend_radius / bend as f64)).ceil().clamp(1.0, 256.0) as usize;
        let mut surface = Surface::new("chain link");
        let mut rings = Vec::new();
        let mut ring = |centre: DVec2, out: DVec2| {
            let points = angles(around).map(|angle| {
                (centre + out * (wire * elementary::cos(angle))).extend(0.0)
                    + DVec3::Z * (wire * elementary::sin(angle))
            });
            rings.push(surface.curve(points.collect::<Vec<_>>()));
        };
        for side in [1.0, -1.0] {
            let centre = DVec2::new(side * straight / 2.0, 0.0);
            for i in 0..=bend {
                let out = side * elementary::from_angle(PI * i as f64 / bend as f64 - FRAC_PI_2);
                ring(centre + bend_radius * out, out);
            }
            for i in 1..along {
                let out = side * DVec2::Y;
                let x = side * straight * (0.5 - i as f64 / along as f64);
                ring(DVec2::new(x, 0.0) + bend_radius * out, out);
            }
        }
        for (i, ring) in rings.iter().enumerate() {
            surface.band(&rings[(i + 1) % rings.len()], ring);
        }
        surface.finish()
    }

    fn check(&self, resolution: Resolution) -> Result<(), PartError> {
        resolution.check(self.bend_radius + self.wire_diameter)?;
        positive("diameter of the wire", self.wire_diameter)?;
        above("radius of the bends", self.bend_radius, self.wire_diameter, ", so that the next link fits")?;
        positive("straight length", self.straight)
    }
}
