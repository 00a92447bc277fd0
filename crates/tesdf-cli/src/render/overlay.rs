//! Draws contacts on top of a picture.
use tesdf::glam::{DVec2, DVec3};
use tiny_skia::{Color, FillRule, LineCap, Paint, Path, PathBuilder, Pixmap, Stroke, Transform};

use super::camera::Camera;

/// Radius of a disc, as a fraction of the picture's longer side.
const RADIUS: f64 = 0.006;
/// Length of an arrow along the normal, in radii.
const NORMAL: f64 = 4.5;
/// Opacity of a contact that a body hides.
const HIDDEN: f32 = 0.30;
const DISC: [u8; 3] = [214, 30, 60];
const RIM: [u8; 3] = [255, 255, 255];
const ARROW: [u8; 3] = [120, 10, 40];
/// Number of corners of a disc's outline.
const CORNERS: u32 = 28;

/// Position and normal of a contact that is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactMark {
    /// Point, in world units.
    pub point: DVec3,
    /// Unit normal, world frame.
    pub normal: DVec3,
}

/// Draws each contact as a disc and an arrow along its normal. `depth` returns the distance of the
/// surface at a pixel.
pub fn contacts(
    map: &mut Pixmap,
    camera: &Camera,
    contacts: &[ContactMark],
    depth: impl Fn(u32, u32) -> f64,
) {
    let longer = f64::from(map.width().max(map.height()));
    let mut seen: Vec<(DVec2, f64, &ContactMark)> = contacts
        .iter()
        .filter_map(|contact| camera.project(contact.point).map(|(at, far)| (at, far, contact)))
        .filter(|(at, _, _)| at.x >= 0.0 && at.y >= 0.0)
        .filter(|(at, _, _)| at.x < f64::from(map.width()) && at.y < f64::from(map.height()))
        .collect();
    // The nearest contacts are drawn last, on top. Contacts at the same distance keep their order.
    seen.sort_by(|a, b| b.1.total_cmp(&a.1));
    for (at, far, contact) in seen {
        let radius = RADIUS * longer * camera.pixel_at(far);
        let hidden = far > depth(at.x as u32, at.y as u32) + radius;
        let alpha = if hidden { HIDDEN } else { 1.0 };
        let line = |width: f64| Stroke { width: width as f32, line_cap: LineCap::Round, ..Stroke::default() };
        let thin = (0.1 * RADIUS * longer).max(0.75);
        if let Some(path) = segment(camera, contact.point, contact.point + NORMAL * radius * contact.normal) {
            map.stroke_path(&path, &paint(ARROW, alpha), &line(2.5 * thin), Transform::identity(), None);
        }
        if let Some(path) = disc(camera, contact.point, contact.normal, radius) {
            map.fill_path(&path, &paint(DISC, alpha), FillRule::Winding, Transform::identity(), None);
            map.stroke_path(&path, &paint(RIM, alpha), &line(1.5 * thin), Transform::identity(), None);
        }
    }
}

fn paint(rgb: [u8; 3], alpha: f32) -> Paint<'static> {
    let mut colour = Color::from_rgba8(rgb[0], rgb[1], rgb[2], 255);
    colour.set_alpha(alpha);
    let mut paint = Paint::default();
    paint.set_color(colour);
    paint
}

fn segment(camera: &Camera, a: DVec3, b: DVec3) -> Option<Path> {
    let [a, b] = [camera.project(a)?.0.as_vec2(), camera.project(b)?.0.as_vec2()];
    let mut path = PathBuilder::new();
    path.move_to(a.x, a.y);
    path.line_to(b.x, b.y);
    path.finish()
}

fn disc(camera: &Camera, middle: DVec3, normal: DVec3, radius: f64) -> Option<Path> {
    let (u, v) = normal.try_normalize()?.any_orthonormal_pair();
    let mut path = PathBuilder::new();
    for k in 0..CORNERS {
        let (sin, cos) = (f64::from(k) / f64::from(CORNERS) * std::f64::consts::TAU).sin_cos();
        let at = camera.project(middle + radius * (cos * u + sin * v))?.0.as_vec2();
        if k == 0 { path.move_to(at.x, at.y) } else { path.line_to(at.x, at.y) }
    }
    path.close();
    path.finish()
}
