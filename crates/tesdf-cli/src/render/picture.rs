use rayon::prelude::*;
use tesdf::collide::Shape;
use tesdf::glam::{DVec2, DVec3};
use tesdf_playback::{Linear, linear, srgb};
use tiny_skia::{Pixmap, PremultipliedColorU8};

use super::camera::{Camera, View};
use super::cut::Cut;
use super::light::Lights;
use super::stage::{Drawn, Part, Stage};
use super::{ContactMark, RenderError, overlay};
use crate::slice::ticks;

/// Allowed size of each side of a picture, pixels.
pub const SIZES: std::ops::RangeInclusive<u32> = 16..=8192;
/// Rays per pixel and axis where the colour differs from a neighbouring pixel.
const FINE: u32 = 4;
/// Difference in sRGB, 0 to 255, at which a pixel gets more rays.
const DIFFERENCE: u8 = 5;
/// Minimum number of floor squares per diagonal of the scene.
const CHECKS: f64 = 8.0;

/// The contents of a picture.
#[derive(Clone, Copy, Debug)]
pub struct Scenery<'a> {
    /// The bodies.
    pub bodies: &'a [Drawn<'a>],
    /// The space that is removed from the bodies with [`Exposure::Cut`](super::Exposure::Cut).
    pub cut: &'a Cut,
    /// Contacts, drawn as discs with their normals; faint where a body hides them.
    pub contacts: &'a [ContactMark],
}

/// Draws the bodies in a picture of `size` pixels. The picture fits all bodies except planes, which
/// are floors.
///
/// The same input gives the same picture on any number of threads.
///
/// # Errors
/// [`RenderError`] when the size or the scene cannot be drawn.
pub fn render(scenery: &Scenery, view: &View, size: [u32; 2]) -> Result<Pixmap, RenderError> {
    if !size.iter().all(|side| SIZES.contains(side)) {
        return Err(RenderError::Size(size));
    }
    let stage = Stage::new(scenery.bodies, scenery.cut);
    let points: Vec<DVec3> = scenery.bodies.iter().flat_map(outer_points).collect();
    let camera = Camera::fitted(view, &points, size).ok_or(RenderError::Nothing)?;
    let check = ticks::round_step(stage.bounds.extent().length(), CHECKS);
    let lights = Lights::new(&stage, &camera, size[0].max(size[1]), check);
    let artist = Artist { stage: &stage, camera: &camera, lights: &lights, size };

    let [width, height] = size.map(|side| side as usize);
    // Memory is reserved before the work; the largest picture takes 4 GB.
    let (mut coarse, mut colours) = (Vec::<Sample>::new(), Vec::<[u8; 3]>::new());
    let memory = coarse.try_reserve_exact(width * height).and(colours.try_reserve_exact(width * height));
    let map = memory.ok().and_then(|()| Pixmap::new(size[0], size[1]));
    let mut map = map.ok_or(RenderError::Memory(size))?;
    let pixels = || (0..width * height).into_par_iter();
    coarse.par_extend(pixels().map(|i| artist.sample(pixel(i, width), DVec2::splat(0.5))));
    colours.par_extend(pixels().with_min_len(64).map(|i| {
        if is_plain(&coarse, i, width, height) { srgb(coarse[i].light) } else { artist.fine(pixel(i, width)) }
    }));
    for (pixel, [r, g, b]) in map.pixels_mut().iter_mut().zip(colours) {
        if let Some(colour) = PremultipliedColorU8::from_rgba(r, g, b, 255) {
            *pixel = colour;
        }
    }
    let depth = |x: u32, y: u32| coarse[y as usize * width + x as usize].depth;
    overlay::contacts(&mut map, &camera, scenery.contacts, depth);
    Ok(map)
}

/// Points whose convex hull contains the body; none for a plane.
fn outer_points(body: &Drawn) -> Vec<DVec3> {
    let points: Vec<DVec3> = match body.shape {
        Shape::Plane => Vec::new(),
        Shape::Mesh(asset) => {
            (0..asset.face_count()).flat_map(|position| asset.face_corners(position)).collect()
        }
        shape => {
            let bounds = shape.bounds();
            (0..8)
                .map(|k| {
                    DVec3::select(
                        tesdf::glam::BVec3::new(k & 1 > 0, k & 2 > 0, k & 4 > 0),
                        bounds.min,
                        bounds.max,
                    )
                })
                .collect()
        }
    };
    points.into_iter().map(|p| body.placement.to_world(p)).collect()
}

fn pixel(i: usize, width: usize) -> DVec2 {
    DVec2::new((i % width) as f64, (i / width) as f64)
}

/// What a ray sees.
#[derive(Clone, Copy)]
struct Sample {
    light: Linear,
    /// Body and part that the ray hits; `None` for the background.
    seen: Option<(usize, Part)>,
    /// Distance along the ray; infinite for the background.
    depth: f64,
}

struct Artist<'a> {
    stage: &'a Stage<'a>,
    camera: &'a Camera,
    lights: &'a Lights<'a>,
    size: [u32; 2],
}

impl Artist<'_> {
    /// Traces the ray through a point of the pixel. `within` is measured from the pixel's upper
    /// left corner.
    fn sample(&self, pixel: DVec2, within: DVec2) -> Sample {
        let at = pixel + within;
        let background = background(at.y / f64::from(self.size[1]));
        let [origin, along] = self.camera.ray(at);
        match self.stage.first(origin, along) {
            None => Sample { light: background, seen: None, depth: f64::INFINITY },
            Some(met) => Sample {
                light: self.lights.colour(&met, along, background),
                seen: Some((met.body, met.part)),
                depth: met.t,
            },
        }
    }

    fn fine(&self, pixel: DVec2) -> [u8; 3] {
        let step = 1.0 / f64::from(FINE);
        let offsets =
            (0..FINE * FINE).map(|k| DVec2::new(f64::from(k % FINE) + 0.5, f64::from(k / FINE) + 0.5) * step);
        // Bright light is clipped before the average, because the edges of highlights would be
        // jagged otherwise.
        let sum: Linear = offsets.map(|within| self.sample(pixel, within).light.min(Linear::ONE)).sum();
        srgb(sum / (FINE * FINE) as f32)
    }
}

/// A gradient from white at the top to cool grey at the bottom.
fn background(down: f64) -> Linear {
    linear([250, 251, 253]).lerp(linear([226, 231, 238]), down as f32)
}

/// Whether the pixel has the body, part and, up to [`DIFFERENCE`], the colour of its four
/// neighbours.
fn is_plain(samples: &[Sample], i: usize, width: usize, height: usize) -> bool {
    let (x, y) = (i % width, i / width);
    let own = srgb(samples[i].light);
    let around = [
        (x > 0).then(|| i - 1),
        (x + 1 < width).then(|| i + 1),
        (y > 0).then(|| i - width),
        (y + 1 < height).then(|| i + width),
    ];
    around.into_iter().flatten().all(|k| {
        let other = srgb(samples[k].light);
        samples[k].seen == samples[i].seen && own.iter().zip(other).all(|(a, b)| a.abs_diff(b) < DIFFERENCE)
    })
}
