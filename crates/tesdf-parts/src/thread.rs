//! ISO metric screw threads.
use std::fmt;
use std::str::FromStr;

use tesdf::base::elementary;

use crate::error::{PartError, below, not_negative, positive};
use crate::resolution::Resolution;

/// A right-handed metric thread with the basic profile of ISO 68-1: flanks at 60° to each other, a
/// flat of P/8 at the crest and of P/4 at the root, a depth of 5/8 H, with H = √3/2 P.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thread {
    /// Major (nominal) diameter, in metres.
    pub diameter: f64,
    /// Height of a turn, in metres.
    pub pitch: f64,
}

impl Thread {
    /// Height of the fundamental triangle, in metres.
    pub fn triangle_height(&self) -> f64 {
        self.pitch * 3f64.sqrt() / 2.0
    }

    /// Diameter at which thread and groove are equally wide, in metres.
    pub fn pitch_diameter(&self) -> f64 {
        self.diameter - 0.75 * self.triangle_height()
    }

    /// Diameter of the basic profile at its root, in metres.
    pub fn minor_diameter(&self) -> f64 {
        self.diameter - 1.25 * self.triangle_height()
    }

    /// Radial depth of the basic profile, in metres.
    pub fn depth(&self) -> f64 {
        0.625 * self.triangle_height()
    }

    /// Radius of the basic profile at a phase in pitches. The middle of the crest has phase 0.
    pub(crate) fn radius(&self, phase: f64) -> f64 {
        let from_crest = (phase + 0.5).rem_euclid(1.0) - 0.5;
        let share = ((from_crest.abs() - 1.0 / 16.0) / (3.0 / 8.0 - 1.0 / 16.0)).clamp(0.0, 1.0);
        self.diameter / 2.0 - self.depth() * share
    }

    /// Phases of the rows of vertices of one pitch.
    pub(crate) fn rows(&self, divided: ThreadRows, segments: usize) -> Vec<f64> {
        let chord = std::f64::consts::PI * self.diameter / segments as f64;
        let flank = self.depth() / elementary::cos(30f64.to_radians());
        let pieces = [
            (-1.0 / 16.0, 1.0 / 16.0, self.pitch / 8.0),
            (1.0 / 16.0, 3.0 / 8.0, flank),
            (3.0 / 8.0, 5.0 / 8.0, self.pitch / 4.0),
            (5.0 / 8.0, 15.0 / 16.0, flank),
        ];
        let mut rows = Vec::new();
        for (from, to, length) in pieces {
            let count = match divided {
                ThreadRows::AsChords => (length / chord).round().max(1.0) as usize,
                ThreadRows::Corners => 1,
            };
            rows.extend((0..count).map(|i| from + (to - from) * i as f64 / count as f64));
        }
        rows
    }

    /// Segments of a turn.
    pub(crate) fn segments(&self, resolution: Resolution) -> usize {
        resolution.turn(self.diameter / 2.0, 12)
    }

    pub(crate) fn check(&self, clearance: f64) -> Result<(), PartError> {
        positive("thread diameter", self.diameter)?;
        positive("pitch", self.pitch)?;
        below("pitch", self.pitch, self.diameter / 2.0, ", half of the thread diameter")?;
        not_negative("clearance", clearance)?;
        below("clearance", clearance, self.depth(), ", the depth of the thread")
    }
}

/// How crest, flanks and root of a thread are divided into rows of faces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ThreadRows {
    /// Rows about as high as the chords of a turn are long.
    #[default]
    AsChords,
    /// A row for the crest, one for each flank, and one for the root: four in a pitch, the fewest.
    Corners,
}

tesdf::named!(ThreadRows {
    AsChords: "as-chords", "About as high as the chords of a turn are long";
    Corners: "corners", "One for each of crest, flanks and root";
});

/// Dimensions of a size of bolt and nut, in millimetres.
///
/// - Pitch: ISO 261 and 262, coarse series.
/// - Width across flats and height of the head (nominal): ISO 4014, the same width in ISO 4032.
/// - Diameter of the washer face (least): ISO 4014, grade A up to M24, grade B above. Its height:
///   half of the largest.
/// - Height of the nut (largest): ISO 4032, style 1.
/// - Shortest length of the bolt: ISO 4014.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Row {
    pub diameter: f64,
    pub pitch: f64,
    pub across_flats: f64,
    pub head_height: f64,
    pub washer: f64,
    pub washer_height: f64,
    pub nut_height: f64,
    pub shortest: f64,
}

#[rustfmt::skip]
const TABLE: [Row; 17] = [
    row([ 3.0, 0.5 ,  5.5,  2.0,  4.57, 0.20,  2.4,  20.0]),
    row([ 4.0, 0.7 ,  7.0,  2.8,  5.88, 0.20,  3.2,  25.0]),
    row([ 5.0, 0.8 ,  8.0,  3.5,  6.88, 0.25,  4.7,  25.0]),
    row([ 6.0, 1.0 , 10.0,  4.0,  8.88, 0.25,  5.2,  30.0]),
    row([ 8.0, 1.25, 13.0,  5.3, 11.63, 0.30,  6.8,  40.0]),
    row([10.0, 1.5 , 16.0,  6.4, 14.63, 0.30,  8.4,  45.0]),
    row([12.0, 1.75, 18.0,  7.5, 16.63, 0.30, 10.8,  50.0]),
    row([14.0, 2.0 , 21.0,  8.8, 19.64, 0.30, 12.8,  60.0]),
    row([16.0, 2.0 , 24.0, 10.0, 22.49, 0.40, 14.8,  65.0]),
    row([18.0, 2.5 , 27.0, 11.5, 25.34, 0.40, 15.8,  70.0]),
    row([20.0, 2.5 , 30.0, 12.5, 28.19, 0.40, 18.0,  80.0]),
    row([22.0, 2.5 , 34.0, 14.0, 31.71, 0.40, 19.4,  90.0]),
    row([24.0, 3.0 , 36.0, 15.0, 33.61, 0.40, 21.5,  90.0]),
    row([27.0, 3.0 , 41.0, 17.0,  38.0, 0.40, 23.8, 100.0]),
    row([30.0, 3.5 , 46.0, 18.7, 42.75, 0.40, 25.6, 110.0]),
    row([33.0, 3.5 , 50.0, 21.0, 46.55, 0.40, 28.7, 130.0]),
    row([36.0, 4.0 , 55.0, 22.5, 51.11, 0.40, 31.0, 140.0]),
];

const fn row(v: [f64; 8]) -> Row {
    let [diameter, pitch, across_flats, head_height, washer, washer_height, nut_height, shortest] = v;
    Row { diameter, pitch, across_flats, head_height, washer, washer_height, nut_height, shortest }
}

/// A size of ISO metric bolts and nuts with coarse pitch, `M3` to `M36`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size(pub(crate) Row);

impl Size {
    /// All sizes, from small to large.
    pub fn all() -> impl Iterator<Item = Self> {
        TABLE.into_iter().map(Self)
    }

    /// The thread of this size.
    pub fn thread(&self) -> Thread {
        Thread { diameter: self.0.diameter * 1e-3, pitch: self.0.pitch * 1e-3 }
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "M{}", self.0.diameter)
    }
}

impl FromStr for Size {
    type Err = PartError;

    /// Reads `M16`, also in lower case.
    fn from_str(text: &str) -> Result<Self, PartError> {
        let wanted = text.trim().to_ascii_uppercase();
        Self::all().find(|size| size.to_string() == wanted).ok_or_else(|| {
            let known: Vec<String> = Self::all().map(|size| size.to_string()).collect();
            PartError::UnknownSize { found: text.trim().to_string(), known: known.join(", ") }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_basic_profile_has_its_diameters() {
        let m16: Size = "m16".parse().unwrap();
        let thread = m16.thread();
        // ISO 724: M16 has a pitch diameter of 14.701 mm and a minor diameter of 13.835 mm.
        assert!((thread.pitch_diameter() - 14.701e-3).abs() < 5e-7);
        assert!((thread.minor_diameter() - 13.835e-3).abs() < 5e-7);
        assert!((thread.radius(5.0) - 8e-3).abs() < 1e-15);
        assert!((thread.radius(0.5) * 2.0 - thread.minor_diameter()).abs() < 1e-15);
        // At the pitch diameter, thread and groove are half of a pitch wide.
        assert!((thread.radius(-0.25) * 2.0 - thread.pitch_diameter()).abs() < 1e-15);
        let error = "M17".parse::<Size>().unwrap_err().to_string();
        assert!(error.starts_with("M17 is not in the table of sizes; expected one of M3, M4, "), "{error}");
    }

    #[test]
    fn minor_diameters_are_those_of_iso_724() {
        let expected = [
            2.459, 3.242, 4.134, 4.917, 6.647, 8.376, 10.106, 11.835, 13.835, 15.294, 17.294, 19.294, 20.752,
        ];
        for (size, minor) in Size::all().zip(expected) {
            assert!((size.thread().minor_diameter() * 1e3 - minor).abs() < 6e-4, "{size}");
        }
    }
}
