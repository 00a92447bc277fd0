use std::f64::consts::{FRAC_PI_2, PI, TAU};

use tesdf::SolidMesh;
use tesdf::base::elementary;
use tesdf::glam::DVec3;

use crate::error::{PartError, above, below, not_negative, positive};
use crate::outline::{circle, polar};
use crate::resolution::Resolution;
use crate::spline::Spline;
use crate::surface::{Facing, Loop, Surface};

/// A stepped shaft: sections of different diameters, some with splines or keyways. Its axis is z,
/// and the first section begins at z = 0. Keyways are on the side of -y.
///
/// # Example
///
/// ```
/// use tesdf_parts::{Keyway, Resolution, Section, Shaft};
///
/// let keyway = Keyway { width: 5e-3, depth: 3e-3, length: 19e-3, start: 5e-3 };
/// let shaft = Shaft {
///     sections: vec![Section::round(16e-3, 20e-3), Section::round(20e-3, 30e-3).with_keyway(keyway)],
///     chamfer: 1e-3,
/// };
/// assert!(shaft.mesh(Resolution::DEFAULT)?.is_simple());
/// # Ok::<(), tesdf_parts::PartError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Shaft {
    /// The sections, from below.
    pub sections: Vec<Section>,
    /// Width of the chamfers (45°) at both ends, in metres. Splined ends have none.
    pub chamfer: f64,
}

/// A section of a shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// Its cross-section.
    pub profile: Profile,
    /// Length along the axis, in metres.
    pub length: f64,
}

/// The cross-section of a section of a shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// A circle.
    Round {
        /// Diameter, in metres.
        diameter: f64,
    },
    /// A circle with a keyway.
    Keyed {
        /// Diameter, in metres.
        diameter: f64,
        /// The keyway.
        keyway: Keyway,
    },
    /// A spline.
    Splined(Spline),
}

/// A keyway with round ends (form A of ISO 2491 and DIN 6885).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keyway {
    /// Width, in metres.
    pub width: f64,
    /// Depth below the cylinder, in metres.
    pub depth: f64,
    /// Length with the round ends, in metres.
    pub length: f64,
    /// From the beginning of the section to the keyway, in metres.
    pub start: f64,
}

impl Section {
    /// A cylinder.
    pub const fn round(diameter: f64, length: f64) -> Self {
        Self { profile: Profile::Round { diameter }, length }
    }

    /// A splined section.
    pub const fn splined(spline: Spline, length: f64) -> Self {
        Self { profile: Profile::Splined(spline), length }
    }

    /// The section with a keyway instead of a spline.
    pub fn with_keyway(self, keyway: Keyway) -> Self {
        Self { profile: Profile::Keyed { diameter: 2.0 * self.profile.outer_radius(), keyway }, ..self }
    }
}

impl Profile {
    fn outer_radius(&self) -> f64 {
        match self {
            Self::Round { diameter } | Self::Keyed { diameter, .. } => diameter / 2.0,
            Self::Splined(spline) => spline.major_diameter / 2.0,
        }
    }

    fn is_round(&self) -> bool {
        !matches!(self, Self::Splined(_))
    }

    fn check(&self, length: f64) -> Result<(), PartError> {
        match self {
            Self::Round { diameter } => positive("diameter of a section", *diameter),
            Self::Keyed { diameter, keyway } => {
                positive("diameter of a section", *diameter)?;
                keyway.check(*diameter, length)
            }
            Self::Splined(spline) => spline.check(),
        }
    }
}

impl Keyway {
    fn check(&self, diameter: f64, section: f64) -> Result<(), PartError> {
        let Self { width, depth, length, start } = *self;
        positive("width of the keyway", width)?;
        below("width of the keyway", width, 0.9 * diameter, ", nine tenths of the diameter")?;
        let rim = diameter / 2.0 - (diameter * diameter - width * width).sqrt() / 2.0;
        above("depth of the keyway", depth, rim, ", where its edges are on the cylinder")?;
        below("depth of the keyway", depth, 0.75 * diameter, ", three quarters of the diameter")?;
        above("length of the keyway", length, width, ", its width")?;
        positive("start of the keyway", start)?;
        below("end of the keyway", start + length, section, ", the length of its section")
    }
}

impl Shaft {
    /// A shaft of 90 mm in five sections of 16 to 30 mm, with a keyway of 5 mm on the last one.
    pub fn example() -> Self {
        let keyway = Keyway { width: 5e-3, depth: 3e-3, length: 19e-3, start: 5e-3 };
        Self {
            sections: vec![
                Section::round(16e-3, 20e-3),
                Section::round(22e-3, 2e-3),
                Section::round(24e-3, 33e-3),
                Section::round(30e-3, 5e-3),
                Section::round(20e-3, 30e-3).with_keyway(keyway),
            ],
            chamfer: 1e-3,
        }
    }

    /// The mesh, in metres.
    ///
    /// # Errors
    /// [`PartError`] names the parameter at fault.
    pub fn mesh(&self, resolution: Resolution) -> Result<SolidMesh, PartError> {
        self.check(resolution)?;
        let mut surface = Surface::new("shaft");
        let last = self.sections.len() - 1;
        let mut z = 0.0;
        let mut previous: Option<(Loop, f64)> = None;
        for (i, section) in self.sections.iter().enumerate() {
            let chamfer = |end: bool| if end && section.profile.is_round() { self.chamfer } else { 0.0 };
            let margins = [chamfer(i == 0), chamfer(i == last)];
            let heights = [z + margins[0], z + section.length - margins[1]];
            let [mut low, mut high] = build(&mut surface, section, z, heights, resolution)?;
            if margins[0] > 0.0 {
                low = shrunk(&mut surface, &low, self.chamfer, z, Facing::Down);
            }
            z += section.length;
            if margins[1] > 0.0 {
                high = shrunk(&mut surface, &high, self.chamfer, z, Facing::Up);
            }
            let radius = section.profile.outer_radius();
            match &previous {
                None => surface.level(Facing::Down, &[&low])?,
                Some((below, wide)) if *wide > radius => surface.level(Facing::Up, &[below, &low])?,
                Some((below, _)) => surface.level(Facing::Down, &[&low, below])?,
            }
            previous = Some((high, radius));
        }
        if let Some((top, _)) = previous {
            surface.level(Facing::Up, &[&top])?;
        }
        surface.finish()
    }

    fn check(&self, resolution: Resolution) -> Result<(), PartError> {
        let widest = self.sections.iter().map(|section| section.profile.outer_radius()).fold(0.0, f64::max);
        resolution.check(widest)?;
        crate::error::count("number of sections", self.sections.len(), 1..=1000)?;
        not_negative("chamfer", self.chamfer)?;
        for section in &self.sections {
            positive("length of a section", section.length)?;
            section.profile.check(section.length)?;
        }
        for pair in self.sections.windows(2) {
            let [a, b] = [pair[0].profile.outer_radius(), pair[1].profile.outer_radius()];
            if (a - b).abs() < 1e-3 * a.max(b) {
                return Err(PartError::Parameter {
                    name: "diameter of a section",
                    found: format!("{}, as that of the section before it", crate::error::Mm(2.0 * b)),
                    expected: "another one, by a thousandth at least".into(),
                });
            }
        }
        let ends = [self.sections.first(), self.sections.last()];
        for end in ends.into_iter().flatten().filter(|end| end.profile.is_round()) {
            below("chamfer", self.chamfer, end.profile.outer_radius(), ", the radius of the end")?;
            below("chamfer", self.chamfer, end.length / 2.0, ", half of the length of the last section")?;
            if let Profile::Keyed { keyway, .. } = end.profile {
                let left = keyway.start.min(end.length - keyway.start - keyway.length);
                below("chamfer", self.chamfer, left, ", the distance of the keyway from the end")?;
            }
        }
        Ok(())
    }
}

/// Adds the side of a section between two heights. `z` is where the section begins, with its
/// chamfer.
fn build(
    surface: &mut Surface,
    section: &Section,
    z: f64,
    heights: [f64; 2],
    resolution: Resolution,
) -> Result<[Loop; 2], PartError> {
    match section.profile {
        Profile::Round { diameter } => {
            let outline = circle(diameter / 2.0, resolution.turn(diameter / 2.0, 1));
            Ok(surface.prism(&outline, heights[0], heights[1]))
        }
        Profile::Splined(spline) => Ok(surface.prism(&spline.shaft(resolution), heights[0], heights[1])),
        Profile::Keyed { diameter, keyway } => keyed(surface, diameter / 2.0, keyway, z, heights, resolution),
    }
}

/// A curve whose points are nearer to the axis by `by`, at the height `z`, and the cone to it.
fn shrunk(surface: &mut Surface, curve: &[u32], by: f64, z: f64, facing: Facing) -> Loop {
    let points: Vec<_> = curve
        .iter()
        .map(|&vertex| {
            let p = surface.position(vertex).truncate();
            (p - by * p.normalize()).extend(z)
        })
        .collect();
    let ring = surface.curve(points);
    match facing {
        Facing::Up => surface.band(curve, &ring),
        Facing::Down => surface.band(&ring, curve),
    }
    ring
}

/// A cylinder with a keyway around -y.
///
/// The columns over the keyway are those of the points of its round ends. So the curve in which the
/// keyway cuts the cylinder passes through vertices alone.
fn keyed(
    surface: &mut Surface,
    radius: f64,
    keyway: Keyway,
    z: f64,
    heights: [f64; 2],
    resolution: Resolution,
) -> Result<[Loop; 2], PartError> {
    let half = keyway.width / 2.0;
    let steps = resolution.arc(half, PI).max(6).next_multiple_of(2);
    // The points of a round end, from -x to +x, and how far the end goes beyond its centre there.
    let end: Vec<[f64; 2]> = (0..=steps)
        .map(|j| {
            let angle = PI * (1.0 - j as f64 / steps as f64);
            [
                half * elementary::cos(angle),
                if j == 0 || j == steps { 0.0 } else { half * elementary::sin(angle) },
            ]
        })
        .collect();
    let angle_of = |x: f64| elementary::asin(x / radius) - FRAC_PI_2;
    let edge = angle_of(half);
    let rest = TAU - 2.0 * elementary::asin(half / radius);
    let others = resolution.arc(radius, rest);
    let mut angles: Vec<f64> = end.iter().map(|&[x, _]| angle_of(x)).collect();
    angles.extend((1..others).map(|i| edge + rest * i as f64 / others as f64));
    let place = |angle: f64, z: f64| polar(radius, angle).extend(z);
    let [low, high] = heights.map(|z| surface.curve(angles.iter().map(|&angle| place(angle, z))));
    let centres = [z + keyway.start + half, z + keyway.start + keyway.length - half];
    let [rim_low, rim_high] = [(centres[0], -1.0), (centres[1], 1.0)].map(|(centre, side)| {
        surface
            .curve(end.iter().zip(&angles).map(|(&[_, beyond], &angle)| place(angle, centre + side * beyond)))
    });
    let floor = keyway.depth - radius;
    let [floor_low, floor_high] = [(centres[0], -1.0), (centres[1], 1.0)].map(|(centre, side)| {
        surface.curve(end.iter().map(|&[x, beyond]| DVec3::new(x, floor, centre + side * beyond)))
    });
    surface.strip(&low[..=steps], &rim_low);
    surface.strip(&rim_high, &high[..=steps]);
    surface.strip(&low[steps + 1..], &high[steps + 1..]);
    // Beside the keyway, one side of a column has its two corners, too.
    let after = (steps + 1) % low.len();
    let before = low.len() - 1;
    surface.zip(&[low[steps], rim_low[steps], rim_high[steps], high[steps]], &[low[after], high[after]]);
    surface.zip(&[low[before], high[before]], &[low[0], rim_low[0], rim_high[0], high[0]]);
    let around = |low: &[u32], high: &[u32]| low.iter().chain(high.iter().rev()).copied().collect::<Loop>();
    let [rim, floor] = [around(&rim_low, &rim_high), around(&floor_low, &floor_high)];
    surface.band(&rim, &floor);
    surface.flat(DVec3::X, DVec3::Z, &[&floor])?;
    Ok([low, high])
}
