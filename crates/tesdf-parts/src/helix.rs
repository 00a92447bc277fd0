//! Surfaces whose radius repeats along a helix: threads and grooves.
use tesdf::glam::DVec3;

use crate::error::PartError;
use crate::outline::{angles, polar};
use crate::surface::{Loop, Surface};

/// A right-handed helical surface between two heights: the radius as a function of the phase and of
/// the height.
///
/// The rows of vertices follow the helix, so edges follow crests and roots. Where a row leaves the
/// band, it ends in the ring at that height. The surface is a graph over angle and height, so it
/// does not overlap itself; the radius must not change by more than some six times the height.
pub(crate) struct Helix<'a, F> {
    /// Vertices around a turn.
    pub columns: usize,
    /// Heights of the ends.
    pub heights: [f64; 2],
    /// Height of a turn.
    pub pitch: f64,
    /// Phases of the rows of one pitch, rising, in pitches. The last one is less than the first one
    /// plus 1.
    pub rows: &'a [f64],
    /// Radius at a phase (in pitches, of which only the fraction matters) and a height.
    pub radius: F,
}

/// Rows nearer than this share of the pitch to an end join the end. Thinner faces would be needles.
const JOINS: f64 = 0.012;

impl<F: Fn(f64, f64) -> f64> Helix<'_, F> {
    /// Adds the surface, looking outwards. Returns its lower and upper ring.
    pub(crate) fn build(&self, surface: &mut Surface) -> Result<[Loop; 2], PartError> {
        let [z0, z1] = self.heights;
        let turns = ((z1 - z0) / self.pitch).ceil();
        surface.check_count(2.0 * turns * (self.columns * self.rows.len()) as f64)?;
        let join = self.pitch * JOINS;
        // Rows start three pitches early, so that the last column finds all its neighbours.
        let pitches = (z0 / self.pitch).floor() as i64 - 3..(z1 / self.pitch).ceil() as i64 + 3;
        let phases: Vec<f64> =
            pitches.flat_map(|k| self.rows.iter().map(move |row| row + k as f64)).collect();
        let mut columns = Vec::with_capacity(self.columns);
        let [mut bottom, mut top] = [Loop::new(), Loop::new()];
        for (i, angle) in angles(self.columns).enumerate() {
            let turn = i as f64 / self.columns as f64;
            let mut place = |z: f64| {
                let p = polar((self.radius)(z / self.pitch - turn, z), angle);
                surface.vertex(DVec3::new(p.x, p.y, z))
            };
            let (low, high) = (place(z0), place(z1));
            let row = |phase: &f64| match self.pitch * (phase + turn) {
                z if z < z0 + join => low,
                z if z > z1 - join => high,
                z => place(z),
            };
            columns.push(phases.iter().map(row).collect::<Vec<u32>>());
            bottom.push(low);
            top.push(high);
        }
        // The column after the last one is the first one, a pitch higher.
        let mut last = columns[0][self.rows.len()..].to_vec();
        last.resize(phases.len(), top[0]);
        columns.push(last);
        for pair in columns.windows(2) {
            for k in 1..phases.len() {
                let ([a, d], [b, c]) = ([pair[0][k - 1], pair[0][k]], [pair[1][k - 1], pair[1][k]]);
                surface.triangle(a, b, c);
                surface.triangle(a, c, d);
            }
        }
        Ok([bottom, top])
    }
}
