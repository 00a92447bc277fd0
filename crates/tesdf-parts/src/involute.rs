//! The outline of an involute spur gear, as a rack with rounded tips generates it.
use std::f64::consts::{FRAC_PI_2, PI};

use tesdf::base::elementary;
use tesdf::glam::DVec2;

use crate::error::{PartError, below, count, not_negative, positive};
use crate::outline::polar;
use crate::resolution::Resolution;

/// Pressure angle, addendum, dedendum and radius of the tip of the basic rack, in modules: profile
/// A of ISO 53.
pub(crate) const PRESSURE_ANGLE: f64 = 20.0 * PI / 180.0;
pub(crate) const ADDENDUM: f64 = 1.0;
pub(crate) const DEDENDUM: f64 = 1.25;
const FILLET: f64 = 0.38;

/// The teeth of a gear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Teeth {
    /// Pitch diameter per tooth, in metres.
    pub module: f64,
    /// Number of teeth.
    pub count: usize,
    /// Distance by which the rack is moved outwards, in modules.
    pub profile_shift: f64,
    /// Length by which each tooth is thinner along the pitch circle, in metres. Two gears with the
    /// same value have twice this backlash together.
    pub backlash: f64,
}

impl Teeth {
    /// Radius of the pitch circle, in metres.
    pub fn pitch_radius(&self) -> f64 {
        self.module * self.count as f64 / 2.0
    }

    /// Radius of the circle whose involutes the flanks are, in metres.
    pub fn base_radius(&self) -> f64 {
        self.pitch_radius() * elementary::cos(PRESSURE_ANGLE)
    }

    /// Radius of the tips, in metres.
    pub fn tip_radius(&self) -> f64 {
        self.pitch_radius() + (ADDENDUM + self.profile_shift) * self.module
    }

    /// Radius of the roots, in metres.
    pub fn root_radius(&self) -> f64 {
        self.pitch_radius() - (DEDENDUM - self.profile_shift) * self.module
    }

    /// Half of the angle that a tooth takes at a radius from the base circle on.
    fn half_tooth(&self, radius: f64) -> f64 {
        let thickness = self.module
            * (FRAC_PI_2 + 2.0 * self.profile_shift * elementary::tan(PRESSURE_ANGLE))
            - self.backlash;
        let involute = |angle: f64| elementary::tan(angle) - angle;
        let here = elementary::acos((self.base_radius() / radius).min(1.0));
        thickness / (2.0 * self.pitch_radius()) + involute(PRESSURE_ANGLE) - involute(here)
    }

    /// Distance of the centre of the rounding of the rack's tip from the pitch line, inwards, and
    /// from the middle of the rack's tooth.
    fn rounding(&self) -> [f64; 2] {
        let depth = DEDENDUM - FILLET;
        let half_width =
            PI / 4.0 - depth * elementary::tan(PRESSURE_ANGLE) - FILLET / elementary::cos(PRESSURE_ANGLE);
        [(depth - self.profile_shift) * self.module, half_width * self.module + self.backlash / 2.0]
    }

    /// A point of the fillet: its radius, and its angle from the middle of the space. The centre of
    /// the rounding is `along` beyond the pitch point at that moment.
    fn fillet(&self, along: f64) -> [f64; 2] {
        let [depth, half_width] = self.rounding();
        let pitch = self.pitch_radius();
        let centre = DVec2::new(along, -depth);
        let point = centre + FILLET * self.module * centre.normalize();
        let turned = (along - half_width) / pitch;
        let from_centre = DVec2::new(point.x, point.y + pitch);
        [from_centre.length(), elementary::atan2(from_centre.x, from_centre.y) - turned]
    }

    /// Where the fillet meets the flank.
    fn fillet_end(&self) -> f64 {
        self.rounding()[0] / elementary::tan(PRESSURE_ANGLE)
    }

    pub(crate) fn check(&self) -> Result<(), PartError> {
        let Self { module, count: teeth, profile_shift, backlash } = *self;
        positive("module", module)?;
        count("number of teeth", teeth, 5..=1000)?;
        not_negative("backlash", backlash)?;
        below("backlash", backlash, 0.3 * module, ", 0.3 modules")?;
        // The flank of the rack ends one module below its middle. Beyond the base circle's tangent
        // point it would cut the flanks it has made.
        let least = ADDENDUM - teeth as f64 / 2.0 * elementary::powi(elementary::sin(PRESSURE_ANGLE), 2);
        let parameter = |expected: String| PartError::Parameter {
            name: "profile shift",
            found: format!("{profile_shift} modules"),
            expected,
        };
        if !(profile_shift >= least && profile_shift <= 1.0) {
            let least = (least * 1e3).ceil() / 1e3;
            return Err(parameter(format!("{least} (below it, {teeth} teeth are undercut) to 1")));
        }
        if self.half_tooth(self.tip_radius()) * self.tip_radius() < 0.1 * module {
            return Err(parameter("less: the tips would be narrower than 0.2 modules".into()));
        }
        Ok(())
    }

    /// The outline, counter-clockwise. The middle of the first tooth is on +x.
    pub(crate) fn outline(&self, resolution: Resolution) -> Vec<DVec2> {
        let pitch_angle = 2.0 * PI / self.count as f64;
        // Half of a space and the flank after it, by the angle from the middle of the space.
        let mut half = self.root_and_fillet(resolution);
        let joint = half.pop().unwrap_or_default();
        half.extend(self.flank(joint[0], resolution).map(|r| [r, pitch_angle / 2.0 - self.half_tooth(r)]));
        let tip = self.half_tooth(self.tip_radius());
        let tip_segments = resolution.arc(self.tip_radius(), 2.0 * tip).next_multiple_of(2);
        let mut one = Vec::new();
        // From the tip of this tooth to that of the next one.
        let tips = (tip_segments / 2)..tip_segments;
        one.extend(tips.map(|i| [self.tip_radius(), 2.0 * tip * i as f64 / tip_segments as f64 - tip]));
        one.extend(half.iter().rev().map(|&[r, a]| [r, pitch_angle / 2.0 - a]));
        one.extend(half.iter().skip(1).map(|&[r, a]| [r, pitch_angle / 2.0 + a]));
        let tips = 1..(tip_segments / 2);
        one.extend(
            tips.map(|i| [self.tip_radius(), pitch_angle + 2.0 * tip * i as f64 / tip_segments as f64 - tip]),
        );
        (0..self.count)
            .flat_map(|k| one.iter().map(move |&[r, a]| polar(r, a + pitch_angle * k as f64)))
            .collect()
    }

    /// Radii of the flank, from the fillet to the tip, at equal steps of the angle of roll.
    fn flank(&self, from: f64, resolution: Resolution) -> impl Iterator<Item = f64> {
        let base = self.base_radius();
        let roll = |radius: f64| (elementary::powi(radius / base, 2) - 1.0).max(0.0).sqrt();
        let [first, last] = [from, self.tip_radius()].map(roll);
        let segments = match resolution {
            Resolution::Segments(segments) => segments.div_ceil(12).max(2),
            // An involute has the radius of curvature b t at the angle of roll t, and the length of
            // a step dt is b t dt.
            Resolution::Deviation(deviation) => {
                ((last - first) * (base * last / (8.0 * deviation)).sqrt()).ceil().clamp(2.0, 1000.0) as usize
            }
        };
        let tip = self.tip_radius();
        (0..=segments).map(move |i| match i {
            0 => from,
            i if i == segments => tip,
            i => base * elementary::hypot(first + (last - first) * i as f64 / segments as f64, 1.0),
        })
    }

    /// Radii and angles from the middle of the space over the root and the fillet to the flank.
    fn root_and_fillet(&self, resolution: Resolution) -> Vec<[f64; 2]> {
        let end = self.fillet_end();
        let point = |share: f64| self.fillet(end * share);
        let mut segments = match resolution {
            Resolution::Segments(segments) => segments.div_ceil(24).max(2),
            Resolution::Deviation(_) => 2,
        };
        if let Resolution::Deviation(deviation) = resolution {
            while segments < 1000 && largest_sagitta(&point, segments) > deviation {
                segments *= 2;
            }
        }
        let root = self.root_radius();
        let root_angle = self.rounding()[1] / self.pitch_radius();
        let root_segments = resolution.arc(root, root_angle);
        let mut points: Vec<_> =
            (0..root_segments).map(|i| [root, root_angle * i as f64 / root_segments as f64]).collect();
        points.extend((0..=segments).map(|i| point(i as f64 / segments as f64)));
        points
    }
}

/// Largest distance of the middle of a chord from the curve, over equal steps of the parameter.
fn largest_sagitta(point: &impl Fn(f64) -> [f64; 2], segments: usize) -> f64 {
    let at = |share: f64| {
        let [radius, angle] = point(share);
        polar(radius, angle)
    };
    (0..segments)
        .map(|i| {
            let [from, middle, to] = [0.0, 0.5, 1.0].map(|half| at((i as f64 + half) / segments as f64));
            middle.distance((from + to) / 2.0)
        })
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fillet_ends_on_the_flank() {
        for (count, profile_shift, backlash) in
            [(18, 0.0, 0.0), (40, 0.3, 5e-5), (12, 0.4, 1e-5), (25, -0.2, 0.0)]
        {
            let teeth = Teeth { module: 2e-3, count, profile_shift, backlash };
            teeth.check().unwrap();
            let [radius, angle] = teeth.fillet(teeth.fillet_end());
            assert!(radius >= teeth.base_radius() - 1e-15, "{count} teeth");
            let flank = PI / count as f64 - teeth.half_tooth(radius);
            assert!((angle - flank).abs() < 1e-9, "{count} teeth: {angle} {flank}");
            assert!((teeth.fillet(0.0)[0] - teeth.root_radius()).abs() < 1e-15);
        }
    }
}
