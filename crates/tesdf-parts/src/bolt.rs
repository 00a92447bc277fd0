use tesdf::SolidMesh;
use tesdf::base::elementary;
use tesdf::glam::DVec3;

use crate::error::{PartError, above, below, positive};
use crate::helix::Helix;
use crate::outline::{angles, hexagon, polar};
use crate::resolution::Resolution;
use crate::surface::{Facing, Loop, Surface};
use crate::thread::{Size, Thread, ThreadRows};

/// A hexagon head bolt. Its axis is z, its tip at z = 0, and its head on top.
///
/// The middle of the crest passes through z = 0 at +x, and rises counter-clockwise.
///
/// # Example
///
/// ```
/// use tesdf_parts::{Bolt, Resolution, Size};
///
/// let bolt = Bolt { length: 0.08, ..Bolt::iso_4014("M16".parse::<Size>()?) };
/// let solid = bolt.mesh(Resolution::Segments(48))?;
/// assert!((solid.mesh().bounds().max.z - 0.09).abs() < 1e-12); // 80 mm, and a head of 10 mm
/// # Ok::<(), tesdf_parts::PartError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bolt {
    /// The thread.
    pub thread: Thread,
    /// Rows of faces of the thread.
    pub rows: ThreadRows,
    /// From the tip to the head, in metres.
    pub length: f64,
    /// From the tip to the end of the full thread, in metres.
    pub thread_length: f64,
    /// Width of the head across flats, in metres.
    pub across_flats: f64,
    /// Height of the head, in metres.
    pub head_height: f64,
    /// Diameter of the washer face under the head, in metres.
    pub washer_diameter: f64,
    /// Height of the washer face, in metres. It is a part of the height of the head.
    pub washer_height: f64,
    /// Distance by which thread and shank are smaller in radius than the basic profile, in metres.
    /// The gap normal to the flanks is half of it.
    pub clearance: f64,
}

impl Bolt {
    /// A bolt of ISO 4014: the shortest length of the standard, without clearance.
    pub fn iso_4014(size: Size) -> Self {
        let row = size.0;
        let length = row.shortest * 1e-3;
        Self {
            thread: size.thread(),
            rows: ThreadRows::default(),
            length,
            thread_length: Self::iso_thread_length(&size.thread(), length),
            across_flats: row.across_flats * 1e-3,
            head_height: row.head_height * 1e-3,
            washer_diameter: row.washer * 1e-3,
            washer_height: row.washer_height * 1e-3,
            clearance: 0.0,
        }
    }

    /// The thread length *b* of ISO 4014 for a bolt of this length, in metres: 2 d + 6 mm up to 125
    /// mm, 2 d + 12 mm up to 200 mm, 2 d + 25 mm above. A shorter bolt is threaded up to the
    /// [run-out](Self::longest_thread) under its head, as in ISO 4017.
    pub fn iso_thread_length(thread: &Thread, length: f64) -> f64 {
        let more = match length {
            l if l <= 0.125 => 6e-3,
            l if l <= 0.2 => 12e-3,
            _ => 25e-3,
        };
        (2.0 * thread.diameter + more).min(Self::longest_thread(thread, length))
    }

    /// The longest thread of a bolt of this length, in metres. The run-out of the thread (0.6 P)
    /// and the fillet under the head (0.05 d) come after it.
    pub fn longest_thread(thread: &Thread, length: f64) -> f64 {
        length - 0.6 * thread.pitch - 0.06 * thread.diameter
    }

    /// The mesh, in metres.
    ///
    /// # Errors
    /// [`PartError`] names the parameter at fault.
    pub fn mesh(&self, resolution: Resolution) -> Result<SolidMesh, PartError> {
        self.check(resolution)?;
        let Self { thread, length, thread_length, clearance, .. } = *self;
        let segments = thread.segments(resolution);
        let mut surface = Surface::new("bolt");
        // The chamfer of 45° begins below the root.
        let tip = thread.minor_diameter() / 2.0 - clearance - 0.175 * thread.pitch;
        let [bottom, top] = Helix {
            columns: segments,
            heights: [0.0, thread_length],
            pitch: thread.pitch,
            rows: &thread.rows(self.rows, segments),
            radius: |phase: f64, z: f64| (thread.radius(phase) - clearance).min(tip + z),
        }
        .build(&mut surface)?;
        surface.fan(DVec3::ZERO, &bottom, Facing::Down);
        let shank = thread.diameter / 2.0 - clearance;
        let mut below = top;
        let run_out = thread_length + 0.6 * thread.pitch;
        let fillet = 0.05 * thread.diameter;
        for (radius, z) in [(shank, run_out), (shank, length - fillet), (shank + 0.4 * fillet, length)] {
            let ring = surface.outline(&crate::outline::circle(radius, segments), z);
            surface.band(&below, &ring);
            below = ring;
        }
        let head = Hexagon { across_flats: self.across_flats, segments };
        let washer = self.washer_diameter / 2.0;
        let edge = self.washer_height;
        let rings = [
            head.circle(&mut surface, washer, length),
            head.circle(&mut surface, washer, length + edge),
            head.side(&mut surface, length + edge),
            head.chamfer(&mut surface, length + self.head_height, Facing::Up),
            head.circle(&mut surface, head.chamfered(), length + self.head_height),
        ];
        for ring in rings {
            surface.band(&below, &ring);
            below = ring;
        }
        surface.fan(DVec3::Z * (length + self.head_height), &below, Facing::Up);
        surface.finish()
    }

    fn check(&self, resolution: Resolution) -> Result<(), PartError> {
        resolution.check(self.across_flats / 2.0)?;
        let Self { thread, length, thread_length, across_flats, head_height, washer_diameter, .. } = *self;
        thread.check(self.clearance)?;
        positive("length", length)?;
        above("thread length", thread_length, thread.pitch, ", the pitch")?;
        let longest = Self::longest_thread(&thread, length);
        below(
            "thread length",
            thread_length,
            longest * (1.0 + 1e-9),
            ", the length without run-out and fillet",
        )?;
        above(
            "diameter of the washer face",
            washer_diameter,
            1.1 * thread.diameter,
            ", 1.1 thread diameters",
        )?;
        above("width across flats", across_flats, washer_diameter, ", the diameter of the washer face")?;
        positive("height of the washer face", self.washer_height)?;
        let least = 0.06 * across_flats + self.washer_height;
        above("height of the head", head_height, least, ", the height of its washer face and of its chamfer")
    }
}

/// A hexagon with corners at 30° + k 60°, whose ends are chamfered at 30°.
pub(crate) struct Hexagon {
    pub across_flats: f64,
    pub segments: usize,
}

impl Hexagon {
    /// Radius at which the chamfer begins.
    pub(crate) fn chamfered(&self) -> f64 {
        0.95 * self.across_flats / 2.0
    }

    pub(crate) fn circle(&self, surface: &mut Surface, radius: f64, z: f64) -> Loop {
        surface.outline(&crate::outline::circle(radius, self.segments), z)
    }

    pub(crate) fn side(&self, surface: &mut Surface, z: f64) -> Loop {
        self.ring(surface, |_| z)
    }

    /// The curve in which the cone of the chamfer that ends at the height `z` cuts the sides.
    pub(crate) fn chamfer(&self, surface: &mut Surface, z: f64, end: Facing) -> Loop {
        let slope = elementary::tan(30f64.to_radians());
        let begins = self.chamfered();
        self.ring(surface, |radius| {
            let drop = (radius - begins) * slope;
            if end == Facing::Up { z - drop } else { z + drop }
        })
    }

    fn ring(&self, surface: &mut Surface, z: impl Fn(f64) -> f64) -> Loop {
        surface.curve(angles(self.segments).map(|angle| {
            let radius = hexagon(self.across_flats, angle);
            polar(radius, angle).extend(z(radius))
        }))
    }
}
