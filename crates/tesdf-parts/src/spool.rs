use tesdf::SolidMesh;

use crate::chain_link::ChainLink;
use crate::error::{PartError, above, below, positive};
use crate::helix::Helix;
use crate::outline::circle;
use crate::resolution::Resolution;
use crate::surface::Surface;

/// A spool: a drum between two flanges, with a bore, and a helical groove if asked. Its axis is z,
/// its lower face at z = 0.
///
/// # Example
///
/// ```
/// use tesdf_parts::{Resolution, Spool};
///
/// assert!(Spool::DEFAULT.mesh(Resolution::DEFAULT)?.is_simple());
/// # Ok::<(), tesdf_parts::PartError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spool {
    /// Diameter of the drum, in metres.
    pub drum_diameter: f64,
    /// Length of the drum between the flanges, in metres.
    pub drum_length: f64,
    /// Diameter of the flanges, in metres.
    pub flange_diameter: f64,
    /// Thickness of each flange, in metres.
    pub flange_thickness: f64,
    /// Diameter of the bore, in metres.
    pub bore_diameter: f64,
    /// The groove of the drum.
    pub groove: Option<Groove>,
}

/// A right-handed helical groove with sides at 10° to the radius. It grows from nothing to its full
/// depth over half of a turn at each end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Groove {
    /// Width at the bottom, in metres.
    pub width: f64,
    /// Depth, in metres.
    pub depth: f64,
    /// Distance from turn to turn along the axis, in metres.
    pub pitch: f64,
}

/// How much wider the groove is at the top than at the bottom, as a share of the depth: 2 tan 10°.
const DRAFT: f64 = 0.352_653_961_416_929;

impl Groove {
    /// The groove in which every second link of a chain stands, while the other links lie flat on
    /// the drum. `clearance` is the gap on each side and below, in metres.
    pub fn of_chain(link: &ChainLink, clearance: f64) -> Self {
        let depth = link.bend_radius + clearance;
        let width = link.wire_diameter + 2.0 * clearance;
        Self { width, depth, pitch: (link.width() + 2.0 * clearance).max(1.2 * (width + DRAFT * depth)) }
    }

    fn top_width(&self) -> f64 {
        self.width + DRAFT * self.depth
    }

    /// Share of the depth at a phase in pitches. The middle of the groove has phase 0.
    fn share(&self, phase: f64) -> f64 {
        let from_middle = ((phase + 0.5).rem_euclid(1.0) - 0.5).abs() * self.pitch;
        1.0 - ((from_middle - self.width / 2.0) / (DRAFT / 2.0 * self.depth)).clamp(0.0, 1.0)
    }

    /// Phases of the rows of one pitch.
    fn rows(&self, chord: f64) -> Vec<f64> {
        let side = DRAFT / 2.0 * self.depth;
        let half = self.width / 2.0;
        let land = self.pitch - self.top_width();
        let pieces = [
            (-half, self.width, self.width),
            (half, side, self.depth),
            (half + side, land, land),
            (self.pitch - half - side, side, self.depth),
        ];
        let mut rows = Vec::new();
        for (from, height, length) in pieces {
            // Steep sides need short steps, so that they look the same in neighbouring columns.
            let count = (length / chord).round().max(1.0);
            rows.extend((0..count as usize).map(|i| (from + height * i as f64 / count) / self.pitch));
        }
        rows
    }

    fn check(&self, drum: f64, length: f64, bore: f64) -> Result<(), PartError> {
        positive("width of the groove", self.width)?;
        positive("depth of the groove", self.depth)?;
        let left = 0.95 * (drum - bore) / 2.0;
        below("depth of the groove", self.depth, left, ", the thickness of the drum")?;
        above(
            "pitch of the groove",
            self.pitch,
            1.05 * self.top_width(),
            ", the width of the groove at the top",
        )?;
        below("pitch of the groove", self.pitch, 0.9 * length, ", nine tenths of the length of the drum")
    }
}

impl Spool {
    /// A drum of 60 mm × 50 mm with flanges of 90 mm.
    pub const DEFAULT: Self = Self {
        drum_diameter: 60e-3,
        drum_length: 50e-3,
        flange_diameter: 90e-3,
        flange_thickness: 5e-3,
        bore_diameter: 12e-3,
        groove: None,
    };

    /// The mesh, in metres.
    ///
    /// # Errors
    /// [`PartError`] names the parameter at fault.
    pub fn mesh(&self, resolution: Resolution) -> Result<SolidMesh, PartError> {
        self.check(resolution)?;
        let Self { drum_length, flange_thickness, .. } = *self;
        let [drum, flange, bore] =
            [self.drum_diameter, self.flange_diameter, self.bore_diameter].map(|diameter| diameter / 2.0);
        let segments = resolution.turn(flange, 1);
        let heights = [flange_thickness, flange_thickness + drum_length];
        let end = heights[1] + flange_thickness;
        let mut surface = Surface::new("spool");
        let ring = |surface: &mut Surface, radius: f64, z: f64| surface.outline(&circle(radius, segments), z);
        let sides = match self.groove {
            None => {
                let rings = heights.map(|z| ring(&mut surface, drum, z));
                surface.band(&rings[0], &rings[1]);
                rings
            }
            Some(groove) => Helix {
                columns: segments,
                heights,
                pitch: groove.pitch,
                rows: &groove.rows(std::f64::consts::TAU * drum / segments as f64),
                radius: |phase: f64, z: f64| {
                    let from_end = (z - heights[0]).min(heights[1] - z);
                    let grown = (2.0 * from_end / groove.pitch).clamp(0.0, 1.0);
                    drum - groove.depth * groove.share(phase) * grown
                },
            }
            .build(&mut surface)?,
        };
        let below = [(bore, 0.0), (flange, 0.0), (flange, heights[0])];
        let above = [(flange, heights[1]), (flange, end), (bore, end)];
        let [below, above] =
            [below, above].map(|rings| rings.map(|(radius, z)| ring(&mut surface, radius, z)));
        let [low, high] = sides;
        for pair in [&below[0], &below[1], &below[2], &low].windows(2) {
            surface.band(pair[0], pair[1]);
        }
        for pair in [&high, &above[0], &above[1], &above[2], &below[0]].windows(2) {
            surface.band(pair[0], pair[1]);
        }
        surface.finish()
    }

    fn check(&self, resolution: Resolution) -> Result<(), PartError> {
        resolution.check(self.flange_diameter / 2.0)?;
        positive("diameter of the bore", self.bore_diameter)?;
        above("diameter of the drum", self.drum_diameter, self.bore_diameter, ", that of the bore")?;
        above("diameter of the flanges", self.flange_diameter, self.drum_diameter, ", that of the drum")?;
        positive("length of the drum", self.drum_length)?;
        positive("thickness of the flanges", self.flange_thickness)?;
        match self.groove {
            Some(groove) => groove.check(self.drum_diameter, self.drum_length, self.bore_diameter),
            None => Ok(()),
        }
    }
}
