use tesdf::SolidMesh;
use tesdf::base::elementary;
use tesdf::glam::{DVec2, DVec3};

use crate::error::{PartError, above, below, positive};
use crate::outline::angles;
use crate::resolution::Resolution;
use crate::surface::{Loop, Surface};

/// A finger of a parallel gripper: a bar along +z whose root is at z = 0, with a pad near its tip
/// that looks to +x. The surface of the pad is in the plane x = 0, and y = 0 is its middle. A
/// finger that faces it is the same one, turned by 180° about z.
///
/// # Example
///
/// ```
/// use tesdf_parts::{Finger, Resolution};
///
/// assert!(Finger::DEFAULT.mesh(Resolution::DEFAULT)?.is_simple());
/// # Ok::<(), tesdf_parts::PartError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finger {
    /// Length along z, in metres.
    pub length: f64,
    /// Width along y, in metres.
    pub width: f64,
    /// Thickness of the bar at its root, along x, in metres.
    pub root_thickness: f64,
    /// Thickness of the bar at its tip, in metres.
    pub tip_thickness: f64,
    /// Length of the pad from the tip on, in metres.
    pub pad_length: f64,
    /// Height of the pad above the bar, in metres.
    pub pad_height: f64,
    /// Depth of a groove of 90° across the middle of the pad, along y; none if 0. In metres.
    pub groove_depth: f64,
    /// Diameter of two holes along y through the root; none if 0. In metres.
    pub hole_diameter: f64,
}

impl Finger {
    /// A finger of 60 mm × 15 mm with a pad of 20 mm, a groove of 3 mm and holes of 4 mm.
    pub const DEFAULT: Self = Self {
        length: 60e-3,
        width: 15e-3,
        root_thickness: 12e-3,
        tip_thickness: 7e-3,
        pad_length: 20e-3,
        pad_height: 2e-3,
        groove_depth: 3e-3,
        hole_diameter: 4e-3,
    };

    /// The outline of its side in x and z.
    fn side(&self) -> Vec<DVec2> {
        let Self { length, root_thickness, tip_thickness, pad_length, pad_height, groove_depth, .. } = *self;
        let front = -pad_height;
        let pad = length - pad_length;
        let mut points = vec![DVec2::new(front, 0.0), DVec2::new(front, pad), DVec2::new(0.0, pad)];
        if groove_depth > 0.0 {
            let middle = length - pad_length / 2.0;
            points.extend([
                DVec2::new(0.0, middle - groove_depth),
                DVec2::new(-groove_depth, middle),
                DVec2::new(0.0, middle + groove_depth),
            ]);
        }
        points.extend([
            DVec2::new(0.0, length),
            DVec2::new(front - tip_thickness, length),
            DVec2::new(front - root_thickness, pad),
            DVec2::new(front - root_thickness, 0.0),
        ]);
        points
    }

    /// The outlines of the holes, in the same direction as the side.
    fn holes(&self, resolution: Resolution) -> Vec<Vec<DVec2>> {
        let radius = self.hole_diameter / 2.0;
        if radius == 0.0 {
            return Vec::new();
        }
        let segments = resolution.turn(radius, 4);
        self.hole_centres()
            .map(|centre| {
                angles(segments).map(|angle| centre + radius * elementary::from_angle(angle)).collect()
            })
            .to_vec()
    }

    fn hole_centres(&self) -> [DVec2; 2] {
        let root = self.length - self.pad_length;
        let x = -self.pad_height - self.root_thickness / 2.0;
        [0.25, 0.75].map(|share| DVec2::new(x, share * root))
    }

    /// The mesh, in metres.
    ///
    /// # Errors
    /// [`PartError`] names the parameter at fault.
    pub fn mesh(&self, resolution: Resolution) -> Result<SolidMesh, PartError> {
        self.check(resolution)?;
        let mut surface = Surface::new("finger");
        let outlines = [vec![self.side()], self.holes(resolution)].concat();
        let ends = [-0.5, 0.5].map(|side| {
            let y = side * self.width;
            outlines
                .iter()
                .map(|outline| surface.curve(outline.iter().map(|p| DVec3::new(p.x, y, p.y))))
                .collect::<Vec<Loop>>()
        });
        for (k, (near, far)) in ends[0].iter().zip(&ends[1]).enumerate() {
            // Counter-clockwise in x and z is clockwise seen from +y.
            match k {
                0 => surface.band(far, near),
                _ => surface.band(near, far),
            }
        }
        let [near, far] = [0, 1].map(|k| ends[k].iter().map(Vec::as_slice).collect::<Vec<_>>());
        surface.flat(DVec3::X, DVec3::Z, &near)?;
        surface.flat(DVec3::Z, DVec3::X, &far)?;
        surface.finish()
    }

    fn check(&self, resolution: Resolution) -> Result<(), PartError> {
        resolution.check(self.hole_diameter / 2.0)?;
        positive("width", self.width)?;
        positive("thickness of the tip", self.tip_thickness)?;
        above("thickness of the root", self.root_thickness, 0.0, "")?;
        let root = self.root_thickness * (1.0 + 1e-12);
        below("thickness of the tip", self.tip_thickness, root, ", the thickness of the root")?;
        positive("length of the pad", self.pad_length)?;
        above("length", self.length, self.pad_length, ", the length of the pad")?;
        positive("height of the pad", self.pad_height)?;
        let thinnest = self.pad_height + (self.tip_thickness + self.root_thickness) / 2.0;
        let deepest = (self.pad_length / 2.0).min(thinnest);
        if self.groove_depth != 0.0 {
            positive("depth of the groove", self.groove_depth)?;
            below("depth of the groove", self.groove_depth, deepest, ", half of the pad and its thickness")?;
        }
        if self.hole_diameter != 0.0 {
            positive("diameter of the holes", self.hole_diameter)?;
            let room = 0.9 * self.root_thickness.min((self.length - self.pad_length) / 2.0);
            below("diameter of the holes", self.hole_diameter, room, ", nine tenths of the room for each")?;
        }
        Ok(())
    }
}
