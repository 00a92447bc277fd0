//! Shading: two lamps and the sky, with shadows and ambient occlusion.
use tesdf::glam::{DVec3, Vec3};
use tesdf_playback::{Linear, linear};

use super::camera::Camera;
use super::stage::{Met, Part, Stage};

/// Reach of ambient occlusion, as a fraction of the scene's diagonal.
const OCCLUSION: f64 = 0.07;
/// Number of steps of ambient occlusion along the normal.
const OCCLUSION_STEPS: u32 = 6;
/// Sharpness of shadows: the distance of the lamp divided by its size.
const SHARPNESS: f64 = 9.0;
/// Maximum number of steps of a shadow ray.
const SHADOW_STEPS: usize = 96;
/// Distance between the lines of a hatch, in pixels of a picture of 1200 pixels.
const HATCH: f64 = 14.0;

pub struct Lights<'a> {
    stage: &'a Stage<'a>,
    camera: &'a Camera,
    /// Unit vector towards the main lamp.
    key: DVec3,
    /// Unit vector towards the weaker lamp.
    fill: DVec3,
    diagonal: f64,
    /// Number of hatch lines per unit of length.
    hatch: f64,
    /// Edge length of the floor's squares.
    check: f64,
}

impl<'a> Lights<'a> {
    pub fn new(stage: &'a Stage<'a>, camera: &'a Camera, pixels: u32, check: f64) -> Self {
        let to = |right: f64, up: f64, back: f64, above: f64| {
            (right * camera.right + up * camera.up - back * camera.forward + above * DVec3::Z).normalize()
        };
        let diagonal = stage.bounds.extent().length();
        let middle = stage.bounds.center();
        let distance = camera.project(middle).map_or(diagonal, |p| p.1);
        let line = camera.pixel_at(distance) * f64::from(pixels) / 1200.0;
        Self {
            stage,
            camera,
            key: to(-0.55, 0.35, 0.75, 0.8),
            fill: to(0.9, 0.1, 0.6, 0.0),
            diagonal,
            hatch: 1.0 / (HATCH * line),
            check,
        }
    }

    /// The light that the hit point sends back along the ray.
    pub fn colour(&self, met: &Met, along: DVec3, background: Linear) -> Linear {
        let facing = |n: DVec3| if n.dot(along) > 0.0 { -n } else { n };
        let (normal, smooth) = (facing(met.normal), met.smooth);
        let smooth = if smooth.dot(normal) > 0.0 { smooth } else { normal };
        let body = &self.stage.bodies[met.body];
        match met.part {
            Part::Section | Part::Overlap => self.section(met, normal),
            Part::Skin if body.is_floor() => self.floor(met, normal, background),
            Part::Skin => self.lit(met, normal, smooth, along, body.drawn.colour),
        }
    }

    fn lit(&self, met: &Met, normal: DVec3, smooth: DVec3, along: DVec3, colour: Linear) -> Linear {
        let open = self.openness(met.point, normal) as f32;
        let falls = |lamp: DVec3| smooth.dot(lamp).max(0.0) as f32;
        let shadow = if falls(self.key) > 0.0 { self.shadow(met.point, normal) as f32 } else { 0.0 };
        let sky = 0.5 + 0.5 * smooth.z as f32;
        let ambient = Vec3::new(0.30, 0.29, 0.28).lerp(Vec3::new(0.46, 0.49, 0.54), sky) * open;
        let key = Vec3::new(1.02, 0.99, 0.94) * (falls(self.key) * shadow * (0.4 + 0.6 * open));
        let fill = Vec3::new(0.17, 0.19, 0.22) * (falls(self.fill) * open);
        let half = (self.key - along).normalize();
        let gloss = (smooth.dot(half).max(0.0) as f32).powi(48) * shadow * 0.22;
        let grazing = (1.0 + smooth.dot(along).min(0.0) as f32).powi(4) * 0.12 * open;
        colour * (ambient + key + fill) + Vec3::splat(gloss + grazing)
    }

    /// A flat, hatched colour, with a dark line along the surface.
    fn section(&self, met: &Met, normal: DVec3) -> Linear {
        let body = &self.stage.bodies[met.body];
        let (colour, deep) = match met.part {
            Part::Overlap => (linear([226, 52, 52]), linear([150, 14, 24])),
            _ => (body.drawn.colour.lerp(Vec3::ONE, 0.24), body.drawn.colour * 0.85),
        };
        let pixel = self.camera.pixel_at(met.t);
        // Neighbouring bodies have hatch lines of opposite slope.
        let slope = if met.body.is_multiple_of(2) { 1.0 } else { -1.0 };
        let across = normal.any_orthonormal_pair();
        let (u, v) = upright(normal).unwrap_or(across);
        let phase =
            (met.point.dot(u) + slope * met.point.dot(v)) * self.hatch * std::f64::consts::FRAC_1_SQRT_2;
        let hatched = (phase - phase.floor()) < 0.16;
        // The planes of a wedge differ in brightness.
        let shade = (0.86 + 0.14 * normal.z.abs()) as f32;
        let depth = -body.signed_distance(met.point);
        if depth < 1.1 * pixel {
            return body.drawn.colour * 0.16;
        }
        shade * if hatched { deep } else { colour }
    }

    fn floor(&self, met: &Met, normal: DVec3, background: Linear) -> Linear {
        let middle = self.stage.bounds.center();
        let body = &self.stage.bodies[met.body];
        let at = body.drawn.placement.pose.to_body(met.point);
        let odd = ((at.x / self.check).floor() + (at.y / self.check).floor()).rem_euclid(2.0) > 0.5;
        let tile = if odd { linear([222, 226, 232]) } else { linear([240, 242, 245]) };
        let away = met.point - middle;
        let away = (away - normal * away.dot(normal)).length() / self.diagonal;
        let seen = 1.0 - smoothstep(0.55, 1.5, away);
        if seen <= 0.0 {
            return background;
        }
        let open = self.openness(met.point, normal) as f32;
        let shadow = self.shadow(met.point, normal) as f32;
        let light = tile * (0.42 + 0.58 * shadow) * (0.35 + 0.65 * open);
        background.lerp(light, seen as f32)
    }

    /// The visible fraction of the sky, 0 to 1, estimated from the distances at points above `p`.
    fn openness(&self, p: DVec3, normal: DVec3) -> f64 {
        let reach = OCCLUSION * self.diagonal;
        let (mut hidden, mut total) = (0.0, 0.0);
        for step in 1..=OCCLUSION_STEPS {
            let share = f64::from(step) / f64::from(OCCLUSION_STEPS);
            let height = reach * share * share;
            let weight = 1.0 - 0.6 * share;
            let found = self.stage.distance(p + height * normal, height);
            hidden += weight * (1.0 - (found / height).max(0.0));
            total += weight;
        }
        let open = 1.0 - hidden / total;
        0.12 + 0.88 * open * open.sqrt()
    }

    /// The visible fraction of the lamp, 0 to 1: a march along the shadow ray records how closely
    /// it passes a surface.
    fn shadow(&self, p: DVec3, normal: DVec3) -> f64 {
        let start = 2e-3 * self.diagonal;
        let origin = p + start * normal;
        let (mut t, mut seen) = (start, 1.0f64);
        for _ in 0..SHADOW_STEPS {
            // From this distance on nothing is darkened, and a full step is safe.
            let enough = t / SHARPNESS + 0.01 * self.diagonal;
            let found = self.stage.distance(origin + t * self.key, enough);
            if found < 2e-4 * self.diagonal {
                return 0.0;
            }
            seen = seen.min(SHARPNESS * found / t);
            // Full steps would pass the closest point at random, and the shadows would have
            // streaks.
            let step = if found < enough { 0.5 * found } else { found };
            t += step.max(2e-3 * self.diagonal);
            if t > self.diagonal {
                break;
            }
        }
        smoothstep(0.0, 1.0, seen)
    }
}

/// Axes in the plane with this normal: a horizontal axis, and the axis perpendicular to it. `None`
/// for a horizontal plane.
fn upright(normal: DVec3) -> Option<(DVec3, DVec3)> {
    let level = DVec3::Z.cross(normal).try_normalize()?;
    Some((level, normal.cross(level)))
}

fn smoothstep(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
