use std::f64::consts::{PI, TAU};

use tesdf::base::elementary;
use tesdf::glam::DVec2;

use crate::error::{PartError, above, below, count, not_negative, positive};
use crate::outline::{circle, polar};
use crate::resolution::Resolution;

/// A spline with straight, parallel sides, as in ISO 14. The middle of the first tooth is on +x.
///
/// The shaft has teeth, the bore grooves. Sizes are those of the shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spline {
    /// Number of teeth.
    pub count: usize,
    /// Diameter at the roots of the shaft's teeth, in metres.
    pub minor_diameter: f64,
    /// Diameter at the tips of the shaft's teeth, in metres.
    pub major_diameter: f64,
    /// Width of the teeth, in metres.
    pub width: f64,
}

impl Spline {
    /// The spline 6 × 23 × 26 of ISO 14: 6 teeth of 6 mm.
    pub const ISO_14_6X23X26: Self =
        Self { count: 6, minor_diameter: 23e-3, major_diameter: 26e-3, width: 6e-3 };

    pub(crate) fn check(&self) -> Result<(), PartError> {
        count("number of spline teeth", self.count, 3..=64)?;
        positive("minor diameter of the spline", self.minor_diameter)?;
        above(
            "major diameter of the spline",
            self.major_diameter,
            self.minor_diameter,
            ", its minor diameter",
        )?;
        positive("width of the spline teeth", self.width)?;
        let space = self.minor_diameter * elementary::sin(PI / self.count as f64);
        below("width of the spline teeth", self.width, 0.9 * space, ", nine tenths of their pitch")
    }

    /// The outline at a distance from that of the shaft, outwards.
    fn outline(&self, distance: f64, resolution: Resolution) -> Vec<DVec2> {
        let [minor, major] = [self.minor_diameter, self.major_diameter].map(|d| d / 2.0 + distance);
        let half = self.width / 2.0 + distance;
        let pitch = TAU / self.count as f64;
        let [foot, tip] = [minor, major].map(|radius| elementary::asin(half / radius));
        let tip_segments = resolution.arc(major, 2.0 * tip).next_multiple_of(2);
        let foot_segments = resolution.arc(minor, pitch - 2.0 * foot).max(1);
        let arc = |radius: f64, from: f64, to: f64, segments: usize| {
            (0..=segments).map(move |i| polar(radius, from + (to - from) * i as f64 / segments as f64))
        };
        (0..self.count)
            .flat_map(|k| {
                let middle = pitch * k as f64;
                arc(major, middle - tip, middle + tip, tip_segments).chain(arc(
                    minor,
                    middle + foot,
                    middle + pitch - foot,
                    foot_segments,
                ))
            })
            .collect()
    }

    /// The outline of a shaft.
    pub(crate) fn shaft(&self, resolution: Resolution) -> Vec<DVec2> {
        self.outline(0.0, resolution)
    }
}

/// The hole along the axis of a gear or sleeve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bore {
    /// A cylinder.
    Round {
        /// Diameter, in metres.
        diameter: f64,
    },
    /// Grooves for the teeth of a splined shaft.
    Splined {
        /// The spline of the shaft.
        spline: Spline,
        /// Gap between bore and shaft on all sides, in metres.
        clearance: f64,
    },
}

impl Bore {
    /// Greatest distance from the axis, in metres.
    pub(crate) fn radius(&self) -> f64 {
        match self {
            Self::Round { diameter } => diameter / 2.0,
            Self::Splined { spline, clearance } => spline.major_diameter / 2.0 + clearance,
        }
    }

    pub(crate) fn check(&self) -> Result<(), PartError> {
        match self {
            Self::Round { diameter } => positive("diameter of the bore", *diameter),
            Self::Splined { spline, clearance } => {
                spline.check()?;
                not_negative("clearance of the spline", *clearance)?;
                below(
                    "clearance of the spline",
                    *clearance,
                    0.05 * spline.width,
                    ", a twentieth of its teeth",
                )
            }
        }
    }

    pub(crate) fn outline(&self, resolution: Resolution) -> Vec<DVec2> {
        match self {
            Self::Round { diameter } => circle(diameter / 2.0, resolution.turn(diameter / 2.0, 1)),
            Self::Splined { spline, clearance } => spline.outline(*clearance, resolution),
        }
    }
}
