use std::f64::consts::PI;

use tesdf::SolidMesh;
use tesdf::base::elementary;
use tesdf::glam::{DVec2, DVec3};

use crate::error::{PartError, above, below, count, not_negative, positive, wrong};
use crate::outline::{angles, circle};
use crate::resolution::Resolution;
use crate::surface::{Facing, Surface};

/// The cross-section of a lobed peg: the radius is `radius` + `amplitude` cos(`lobes` φ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobes {
    /// Mean radius, in metres.
    pub radius: f64,
    /// Height of the lobes above the mean radius, in metres.
    pub amplitude: f64,
    /// Number of lobes; the first one is on +x.
    pub count: usize,
}

impl Lobes {
    /// The curve at a distance from the cross-section, outwards, in metres.
    fn offset(&self, segments: usize, distance: f64) -> Vec<DVec2> {
        angles(segments).map(|angle| self.point(angle) + distance * self.normal(angle)).collect()
    }

    fn point(&self, angle: f64) -> DVec2 {
        self.at(angle) * elementary::from_angle(angle)
    }

    fn at(&self, angle: f64) -> f64 {
        self.radius + self.amplitude * elementary::cos(self.count as f64 * angle)
    }

    fn normal(&self, angle: f64) -> DVec2 {
        let slope = -self.amplitude * self.count as f64 * elementary::sin(self.count as f64 * angle);
        let direction = elementary::from_angle(angle);
        (self.at(angle) * direction - slope * direction.perp()).normalize()
    }

    /// Largest distance of a chord of the offset curve from its middle.
    fn sagitta(&self, segments: usize, distance: f64) -> f64 {
        let step = 2.0 * PI / segments as f64;
        let point = |angle: f64| self.point(angle) + distance * self.normal(angle);
        angles(segments)
            .map(|angle| {
                let middle = (point(angle) + point(angle + step)) / 2.0;
                (point(angle + step / 2.0) - middle).dot(self.normal(angle + step / 2.0))
            })
            .fold(0.0, f64::max)
    }

    fn segments(&self, resolution: Resolution) -> usize {
        resolution.turn(self.radius + self.amplitude, 2 * self.count)
    }

    fn check(&self) -> Result<(), PartError> {
        positive("mean radius", self.radius)?;
        not_negative("amplitude", self.amplitude)?;
        count("number of lobes", self.count, 1..=64)?;
        below("amplitude", self.amplitude, self.radius / 2.0, ", half of the mean radius")
    }

    /// Smallest radius of curvature where the curve is convex, at its lobes.
    fn sharpest(&self) -> f64 {
        let (r, bend) = (self.radius + self.amplitude, self.amplitude * (self.count * self.count) as f64);
        // Curvature of a curve r(φ) where r' = 0: (r − r'') / r².
        r * r / (r + bend)
    }

    /// Radius of curvature of the valleys between the lobes, infinite where they are convex.
    fn narrowest(&self) -> f64 {
        let (r, bend) = (self.radius - self.amplitude, self.amplitude * (self.count * self.count) as f64);
        if bend > r { r * r / (bend - r) } else { f64::INFINITY }
    }
}

/// A peg with lobes. Its axis is z, and one end at z = 0. Both ends are chamfered at 45°.
///
/// # Example
///
/// ```
/// use tesdf_parts::{LobedPeg, Resolution};
///
/// assert!(LobedPeg::DEFAULT.mesh(Resolution::DEFAULT)?.is_simple());
/// # Ok::<(), tesdf_parts::PartError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobedPeg {
    /// The cross-section.
    pub lobes: Lobes,
    /// Length, in metres.
    pub length: f64,
    /// Width of the chamfers, in metres.
    pub chamfer: f64,
}

impl LobedPeg {
    /// Three lobes on 8 mm, 40 mm long.
    pub const DEFAULT: Self =
        Self { lobes: Lobes { radius: 8e-3, amplitude: 0.6e-3, count: 3 }, length: 40e-3, chamfer: 1e-3 };

    /// The mesh, in metres.
    ///
    /// # Errors
    /// [`PartError`] names the parameter at fault.
    pub fn mesh(&self, resolution: Resolution) -> Result<SolidMesh, PartError> {
        resolution.check(self.lobes.radius + self.lobes.amplitude)?;
        let Self { lobes, length, chamfer } = *self;
        lobes.check()?;
        positive("chamfer", chamfer)?;
        below("chamfer", chamfer, lobes.sharpest(), ", the radius of curvature of the lobes")?;
        above("length", length, 2.0 * chamfer, ", twice the chamfer")?;
        let segments = lobes.segments(resolution);
        let mut surface = Surface::new("peg");
        let [end, side] = [-chamfer, 0.0].map(|distance| lobes.offset(segments, distance));
        let mut rings = vec![surface.outline(&end, 0.0)];
        rings.extend(heights(chamfer, length - chamfer, lobes.radius).map(|z| surface.outline(&side, z)));
        rings.push(surface.outline(&end, length));
        for pair in rings.windows(2) {
            surface.band(&pair[0], &pair[1]);
        }
        surface.fan(DVec3::ZERO, &rings[0], Facing::Down);
        surface.fan(DVec3::Z * length, &rings[rings.len() - 1], Facing::Up);
        surface.finish()
    }
}

/// Heights from `low` to `high`, about as far apart as `step`, at most 65.
fn heights(low: f64, high: f64, step: f64) -> impl DoubleEndedIterator<Item = f64> {
    let count = ((high - low) / step).round().clamp(1.0, 64.0) as usize;
    (0..=count).map(move |i| if i == count { high } else { low + (high - low) * i as f64 / count as f64 })
}

/// A round block with a blind hole for a [`LobedPeg`]. Its axis is z, its lower face at z = 0, and
/// the hole is open at the top, with a chamfer of 45°.
///
/// # Example
///
/// ```
/// use tesdf_parts::{LobedHole, Resolution};
///
/// let tight = LobedHole { clearance: 50e-6, ..LobedHole::DEFAULT };
/// assert!(tight.mesh(Resolution::DEFAULT)?.is_simple());
/// # Ok::<(), tesdf_parts::PartError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LobedHole {
    /// The cross-section of the peg.
    pub lobes: Lobes,
    /// Distance of the hole from the cross-section of the peg, in metres. No face is nearer: the
    /// middles of the longest chords, not the vertices, are at this distance.
    pub clearance: f64,
    /// Depth of the hole, in metres.
    pub depth: f64,
    /// Thickness below the hole, in metres.
    pub floor: f64,
    /// Radius of the block, in metres.
    pub outer_radius: f64,
    /// Width of the chamfer, in metres.
    pub chamfer: f64,
}

impl LobedHole {
    /// The hole for [`LobedPeg::DEFAULT`] with a clearance of 0.1 mm.
    pub const DEFAULT: Self = Self {
        lobes: LobedPeg::DEFAULT.lobes,
        clearance: 0.1e-3,
        depth: 25e-3,
        floor: 5e-3,
        outer_radius: 16e-3,
        chamfer: 1e-3,
    };

    /// The mesh, in metres.
    ///
    /// # Errors
    /// [`PartError`] names the parameter at fault.
    pub fn mesh(&self, resolution: Resolution) -> Result<SolidMesh, PartError> {
        resolution.check(self.outer_radius)?;
        let Self { lobes, clearance, depth, floor, outer_radius, chamfer } = *self;
        lobes.check()?;
        not_negative("clearance", clearance)?;
        positive("chamfer", chamfer)?;
        positive("thickness of the floor", floor)?;
        above("depth", depth, chamfer, ", the chamfer")?;
        let segments = lobes.segments(resolution);
        let distance = clearance + lobes.sagitta(segments, clearance);
        let most = lobes.narrowest() - distance;
        below("chamfer", chamfer, most, ", the radius of curvature between the lobes less the clearance")?;
        let mouth = lobes.radius + lobes.amplitude + distance + chamfer;
        if outer_radius * elementary::cos(PI / segments as f64) <= mouth {
            let least = mouth / elementary::cos(PI / segments as f64);
            return Err(wrong(
                "outer radius",
                outer_radius,
                format!("more than {}, that of the chamfered hole", crate::error::Mm(least)),
            ));
        }
        let top = floor + depth;
        let mut surface = Surface::new("hole");
        let outer = circle(outer_radius, segments);
        let hole = lobes.offset(segments, distance);
        let mut rings: Vec<_> = heights(0.0, top, lobes.radius).map(|z| surface.outline(&outer, z)).collect();
        rings.push(surface.outline(&lobes.offset(segments, distance + chamfer), top));
        rings.extend(heights(floor, top - chamfer, lobes.radius).rev().map(|z| surface.outline(&hole, z)));
        for pair in rings.windows(2) {
            surface.band(&pair[0], &pair[1]);
        }
        surface.fan(DVec3::ZERO, &rings[0], Facing::Down);
        surface.fan(DVec3::Z * floor, &rings[rings.len() - 1], Facing::Up);
        surface.finish()
    }
}
