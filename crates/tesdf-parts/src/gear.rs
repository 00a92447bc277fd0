use std::f64::consts::PI;

use tesdf::SolidMesh;
use tesdf::base::elementary;

use crate::dogs::{self, Dogs};
use crate::error::{PartError, above, below, positive};
use crate::involute::Teeth;
use crate::outline::circle;
use crate::resolution::Resolution;
use crate::spline::Bore;
use crate::surface::{Facing, Surface};

/// An involute spur gear, with a hub and a dog clutch if asked. Its axis is z, its lower face at
/// z = 0, and the middle of its first tooth on +x. Hub and dog teeth are on the upper face.
///
/// Teeth have the basic rack of ISO 53: 20°, addendum 1 m, dedendum 1.25 m, with the fillet that a
/// rack with rounded tips (0.38 m) makes.
///
/// # Example
///
/// ```
/// use tesdf_parts::{Gear, Resolution};
///
/// let gear = Gear::DEFAULT;
/// assert_eq!(gear.teeth.pitch_radius(), 0.02); // module 2 mm, 20 teeth
/// assert!(gear.mesh(Resolution::DEFAULT)?.is_simple());
/// # Ok::<(), tesdf_parts::PartError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gear {
    /// The teeth.
    pub teeth: Teeth,
    /// Length of the teeth along the axis, in metres.
    pub width: f64,
    /// The hole along the axis.
    pub bore: Option<Bore>,
    /// The hub.
    pub hub: Option<Hub>,
    /// The dog teeth, on the hub if there is one, and on the gear's upper face otherwise.
    pub dogs: Option<Dogs>,
}

/// A round hub on the upper face of a gear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hub {
    /// Diameter, in metres.
    pub diameter: f64,
    /// Height above the teeth, in metres.
    pub height: f64,
}

impl Gear {
    /// Module 2 mm, 20 teeth, 12 mm wide, a round bore of 10 mm, teeth thinner by 0.05 mm.
    pub const DEFAULT: Self = Self {
        teeth: Teeth { module: 2e-3, count: 20, profile_shift: 0.0, backlash: 0.05e-3 },
        width: 12e-3,
        bore: Some(Bore::Round { diameter: 10e-3 }),
        hub: None,
        dogs: None,
    };

    /// The mesh, in metres.
    ///
    /// # Errors
    /// [`PartError`] names the parameter at fault.
    pub fn mesh(&self, resolution: Resolution) -> Result<SolidMesh, PartError> {
        self.check(resolution)?;
        let mut surface = Surface::new("gear");
        let [low, high] = surface.prism(&self.teeth.outline(resolution), 0.0, self.width);
        let bore = self.bore.map(|bore| bore.outline(resolution));
        let below = bore.as_ref().map(|outline| surface.outline(outline, 0.0));
        let mut face = vec![low.as_slice()];
        face.extend(below.as_deref());
        surface.level(Facing::Down, &face)?;
        let mut top = (high, self.width);
        if let Some(hub) = self.hub {
            let outline = circle(hub.diameter / 2.0, resolution.turn(hub.diameter / 2.0, 1));
            let [foot, end] = surface.prism(&outline, self.width, self.width + hub.height);
            surface.level(Facing::Up, &[&top.0, &foot])?;
            top = (end, self.width + hub.height);
        }
        let above = bore.as_ref().map(|outline| surface.outline(outline, top.1));
        if let (Some(below), Some(above)) = (&below, &above) {
            surface.band(above, below);
        }
        let mut face = vec![top.0.as_slice()];
        face.extend(above.as_deref());
        dogs::end(&mut surface, Facing::Up, &face, self.dogs.as_ref(), resolution)?;
        surface.finish()
    }

    fn check(&self, resolution: Resolution) -> Result<(), PartError> {
        resolution.check(self.teeth.tip_radius())?;
        self.teeth.check()?;
        positive("width", self.width)?;
        // Chords of a circle come nearer to the axis than the circle.
        let inside = |radius: f64| radius * elementary::cos(PI / resolution.turn(radius, 1) as f64);
        let mut outer = inside(self.teeth.root_radius());
        if let Some(hub) = self.hub {
            positive("height of the hub", hub.height)?;
            positive("diameter of the hub", hub.diameter)?;
            below("diameter of the hub", hub.diameter, 2.0 * outer, ", the root diameter of the teeth")?;
            outer = inside(hub.diameter / 2.0);
        }
        let mut inner = 0.0;
        if let Some(bore) = self.bore {
            bore.check()?;
            inner = bore.radius();
            below("radius of the bore", inner, outer, ", the radius of the teeth's roots or of the hub")?;
        }
        match self.dogs {
            Some(dogs) => {
                dogs.check([inner, outer])?;
                above(
                    "inner radius of the dog teeth",
                    inside(dogs.inner_radius),
                    inner,
                    ", the radius of the bore",
                )
            }
            None => Ok(()),
        }
    }
}
