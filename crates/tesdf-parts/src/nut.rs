use std::f64::consts::PI;

use tesdf::SolidMesh;
use tesdf::base::elementary;

use crate::bolt::Hexagon;
use crate::error::{PartError, above};
use crate::helix::Helix;
use crate::resolution::Resolution;
use crate::surface::{Facing, Surface};
use crate::thread::{Size, Thread, ThreadRows};

/// A hexagon nut. Its axis is z and its lower face at z = 0.
///
/// At the same pose its thread fits the thread of a [`Bolt`](crate::Bolt): the nut may move up by z
/// while it turns counter-clockwise by 2π z/P.
///
/// # Example
///
/// ```
/// use tesdf_parts::{Nut, Resolution, Size};
///
/// let nut = Nut { clearance: 25e-6, ..Nut::iso_4032("M16".parse::<Size>()?) };
/// assert!(nut.mesh(Resolution::Segments(48))?.is_simple());
/// # Ok::<(), tesdf_parts::PartError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nut {
    /// The thread.
    pub thread: Thread,
    /// Rows of faces of the thread.
    pub rows: ThreadRows,
    /// Height, in metres.
    pub height: f64,
    /// Width across flats, in metres.
    pub across_flats: f64,
    /// Distance by which the thread is larger in radius than the basic profile, in metres. The gap
    /// normal to the flanks is half of it. No face is nearer to the basic profile, because the
    /// middles of chords, not the vertices, are at this distance.
    pub clearance: f64,
}

impl Nut {
    /// A nut of ISO 4032 (style 1) with a clearance of a fortieth of the pitch.
    pub fn iso_4032(size: Size) -> Self {
        Self {
            thread: size.thread(),
            rows: ThreadRows::default(),
            height: size.0.nut_height * 1e-3,
            across_flats: size.0.across_flats * 1e-3,
            clearance: size.thread().pitch / 40.0,
        }
    }

    /// The mesh, in metres.
    ///
    /// # Errors
    /// [`PartError`] names the parameter at fault.
    pub fn mesh(&self, resolution: Resolution) -> Result<SolidMesh, PartError> {
        self.check(resolution)?;
        let Self { thread, height, across_flats, clearance, .. } = *self;
        let segments = thread.segments(resolution);
        let mut surface = Surface::new("nut");
        let outwards = 1.0 / elementary::cos(PI / segments as f64);
        let mouth = self.mouth();
        let [bottom, top] = Helix {
            columns: segments,
            heights: [0.0, height],
            pitch: thread.pitch,
            rows: &thread.rows(self.rows, segments),
            // Both ends are countersunk at 45°.
            radius: |phase: f64, z: f64| {
                outwards * (thread.radius(phase) + clearance).max(mouth - z.min(height - z))
            },
        }
        .build(&mut surface)?;
        surface.turn_over();
        let hexagon = Hexagon { across_flats, segments };
        let rings = [
            hexagon.circle(&mut surface, hexagon.chamfered(), 0.0),
            hexagon.chamfer(&mut surface, 0.0, Facing::Down),
            hexagon.chamfer(&mut surface, height, Facing::Up),
            hexagon.circle(&mut surface, hexagon.chamfered(), height),
        ];
        let mut below = bottom;
        for ring in rings.into_iter().chain([top]) {
            surface.band(&below, &ring);
            below = ring;
        }
        surface.finish()
    }

    /// Radius of the countersink.
    fn mouth(&self) -> f64 {
        1.04 * (self.thread.diameter / 2.0 + self.clearance)
    }

    fn check(&self, resolution: Resolution) -> Result<(), PartError> {
        resolution.check(self.across_flats / 2.0)?;
        self.thread.check(self.clearance)?;
        above("height", self.height, self.thread.pitch, ", the pitch")?;
        let widest = self.thread.segments(resolution) as f64;
        let mouth = 2.0 * self.mouth() / elementary::cos(PI / widest);
        above("width across flats", 0.95 * self.across_flats, mouth, ", the diameter of the countersink")?;
        above("height", self.height, 0.12 * self.across_flats, ", the height of its two chamfers")
    }
}
