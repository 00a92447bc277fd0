use std::f64::consts::PI;

use tesdf::SolidMesh;
use tesdf::base::elementary;

use crate::dogs::{self, Dogs};
use crate::error::{PartError, above, below, positive};
use crate::outline::circle;
use crate::resolution::Resolution;
use crate::spline::{Bore, Spline};
use crate::surface::{Facing, Surface};

/// A shift sleeve: it slides on a splined shaft, a fork in its groove moves it, and its dog teeth
/// on both ends engage with those of a [`Gear`](crate::Gear). Its axis is z, the lower face of its
/// body at z = 0; the lower dog teeth are below.
///
/// # Example
///
/// ```
/// use tesdf_parts::{Resolution, Sleeve};
///
/// assert!(Sleeve::DEFAULT.mesh(Resolution::DEFAULT)?.is_simple());
/// # Ok::<(), tesdf_parts::PartError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sleeve {
    /// Diameter of the body, in metres.
    pub diameter: f64,
    /// Length of the body without dog teeth, in metres.
    pub width: f64,
    /// The hole along the axis.
    pub bore: Bore,
    /// Width of the groove in the middle of the body, in metres.
    pub groove_width: f64,
    /// Depth of the groove, in metres.
    pub groove_depth: f64,
    /// The dog teeth of both ends.
    pub dogs: Dogs,
}

impl Sleeve {
    /// 44 mm × 16 mm, for the shaft [`Spline::ISO_14_6X23X26`], with 6 dog teeth on each end.
    pub const DEFAULT: Self = Self {
        diameter: 44e-3,
        width: 16e-3,
        bore: Bore::Splined { spline: Spline::ISO_14_6X23X26, clearance: 0.05e-3 },
        groove_width: 6e-3,
        groove_depth: 4e-3,
        dogs: Dogs { count: 6, inner_radius: 15e-3, outer_radius: 20e-3, height: 3e-3, clearance: 0.5e-3 },
    };

    /// The mesh, in metres.
    ///
    /// # Errors
    /// [`PartError`] names the parameter at fault.
    pub fn mesh(&self, resolution: Resolution) -> Result<SolidMesh, PartError> {
        self.check(resolution)?;
        let Self { diameter, width, groove_width, groove_depth, .. } = *self;
        let mut surface = Surface::new("sleeve");
        let segments = resolution.turn(diameter / 2.0, 1);
        let (outer, groove) =
            (circle(diameter / 2.0, segments), circle(diameter / 2.0 - groove_depth, segments));
        let [low, high] = [-0.5, 0.5].map(|side| width / 2.0 + side * groove_width);
        let rings =
            [(&outer, 0.0), (&outer, low), (&groove, low), (&groove, high), (&outer, high), (&outer, width)]
                .map(|(outline, z)| surface.outline(outline, z));
        for pair in rings.windows(2) {
            surface.band(&pair[0], &pair[1]);
        }
        let bore = self.bore.outline(resolution);
        let [below, above] = [0.0, width].map(|z| surface.outline(&bore, z));
        surface.band(&above, &below);
        dogs::end(&mut surface, Facing::Down, &[&rings[0], &below], Some(&self.dogs), resolution)?;
        dogs::end(&mut surface, Facing::Up, &[&rings[5], &above], Some(&self.dogs), resolution)?;
        surface.finish()
    }

    fn check(&self, resolution: Resolution) -> Result<(), PartError> {
        resolution.check(self.diameter / 2.0)?;
        positive("diameter", self.diameter)?;
        positive("width of the groove", self.groove_width)?;
        positive("depth of the groove", self.groove_depth)?;
        above("width", self.width, self.groove_width, ", the width of the groove")?;
        self.bore.check()?;
        let inside = |radius: f64| radius * elementary::cos(PI / resolution.turn(radius, 1) as f64);
        let inner = self.bore.radius();
        let left = inside(self.diameter / 2.0) - inner;
        below("depth of the groove", self.groove_depth, left, ", the thickness of the body")?;
        self.dogs.check([inner, inside(self.diameter / 2.0)])?;
        above(
            "inner radius of the dog teeth",
            inside(self.dogs.inner_radius),
            inner,
            ", the radius of the bore",
        )
    }
}
