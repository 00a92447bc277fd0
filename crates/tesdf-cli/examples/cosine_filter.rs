//! Draws Fig. 5 of the paper: two faces of a body in the distance field of a rectangle, and the
//! gradients that the cosine filter keeps.
//!
//! `cargo run -p tesdf-cli --example cosine_filter -- docs/images/cosine-filter.png`
use std::error::Error;
use std::sync::Arc;

use tesdf::collide::{CollideOptions, Contact, Instance, InstanceId, Mode, Pose, Scene, detect};
use tesdf::encode::{Encoder, Preset};
use tesdf::geometry::Triangle;
use tesdf::glam::{DVec2, DVec3};
use tesdf::mesh::{SolidMesh, TriangleMesh};
use tiny_skia::{Color, FillRule, LineCap, Paint, PathBuilder, Pixmap, Stroke, StrokeDash, Transform};

/// Corners in x and z, counter-clockwise.
const RECTANGLE: [[f64; 2]; 4] = [[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [0.0, 1.0]];
/// The lower side (normal n¹) is deeper than the middle of the rectangle. The next side (normal n²)
/// leaves the rectangle.
const PROBE: [[f64; 2]; 5] = [[1.0, 0.35], [2.0, 0.35], [3.2, 1.15], [3.2, 1.6], [1.0, 1.6]];

/// A prism over a convex polygon, from -`half_depth` to `half_depth` along y.
fn prism(polygon: &[[f64; 2]], half_depth: f64) -> Result<SolidMesh, Box<dyn Error>> {
    let n = polygon.len() as u32;
    let at = |y: f64| polygon.iter().map(move |&[x, z]| DVec3::new(x, y, z));
    let mut faces = Vec::new();
    for i in 0..n {
        let j = (i + 1) % n;
        faces.extend([[i, n + j, j], [i, n + i, n + j]]);
        if i > 0 && i + 1 < n {
            faces.extend([[0, i, i + 1], [n, n + i + 1, n + i]]);
        }
    }
    let mesh = TriangleMesh::new(at(-half_depth).chain(at(half_depth)).collect(), faces)?;
    Ok(SolidMesh::new(mesh)?)
}

fn main() -> Result<(), Box<dyn Error>> {
    let output = std::env::args().nth(1).unwrap_or_else(|| "cosine-filter.png".into());
    let solids = [prism(&PROBE, 0.5)?, prism(&RECTANGLE, 2.0)?];
    let mut scene = Scene::new();
    for solid in &solids {
        let asset = Encoder::new().preset(Preset::Fast).encode(solid)?;
        let shape = scene.add_shape(Arc::new(asset))?;
        scene.add(Instance::new(shape, Pose::IDENTITY))?;
    }
    let normal = |c: &Contact| Triangle::new(solids[0].mesh().triangle(c.face_a as usize)).normal;
    let cos = 0.5;
    let found = detect(&scene, &CollideOptions::default())?;
    let kept = detect(&scene, &CollideOptions::with_mode(Mode::exact().filtered(cos)))?;

    // The deepest contact of each face and direction. Only the two lower faces are drawn.
    let mut shown: Vec<Contact> = Vec::new();
    let mut all: Vec<Contact> = found.into_iter().filter(|c| c.instance_a == InstanceId(0)).collect();
    all.sort_by(|x, y| x.distance.total_cmp(&y.distance));
    for c in all {
        let like = |s: &Contact| normal(s).distance(normal(&c)) < 1e-9 && s.normal.distance(c.normal) < 0.1;
        if normal(&c).z < -0.1 && c.normal.y.abs() < 0.1 && !shown.iter().any(like) {
            shown.push(c);
        }
    }

    let mut picture = Picture::new()?;
    picture.outline(&RECTANGLE, [214, 226, 240]);
    picture.outline(&PROBE, [240, 222, 186]);
    for pair in [[PROBE[0], PROBE[1]], [PROBE[1], PROBE[2]]] {
        let [p, q] = pair.map(DVec2::from_array);
        let outward = -(q - p).perp().normalize();
        picture.arrow(p.lerp(q, 0.12), outward, 0.25, [60, 66, 76], false);
    }
    for c in &shown {
        let stays = kept.iter().any(|k| k.point_a == c.point_a && k.normal == c.normal);
        let colour = if stays { [22, 128, 60] } else { [200, 40, 40] };
        let [at, along] = [c.point_a, c.normal].map(|v| DVec2::new(v.x, v.z));
        picture.arrow(at, along, 0.5, colour, !stays);
        println!(
            "normal of the face {:.2}, gradient {:.2}, distance {:.3}: {}",
            normal(c),
            c.normal,
            c.distance,
            if stays { "stays" } else { "dropped" }
        );
    }
    std::fs::write(&output, picture.0.encode_png()?)?;
    println!("{output}");
    Ok(())
}

struct Picture(Pixmap);

/// Pixels per unit.
const SCALE: f64 = 200.0;

impl Picture {
    fn new() -> Result<Self, Box<dyn Error>> {
        let mut map = Pixmap::new(920, 480).ok_or("no memory for a picture")?;
        map.fill(Color::WHITE);
        Ok(Self(map))
    }

    fn place(p: DVec2) -> (f32, f32) {
        ((60.0 + SCALE * p.x) as f32, (370.0 - SCALE * p.y) as f32)
    }

    fn paint(rgb: [u8; 3], alpha: u8) -> Paint<'static> {
        let mut paint = Paint { anti_alias: true, ..Paint::default() };
        paint.set_color_rgba8(rgb[0], rgb[1], rgb[2], alpha);
        paint
    }

    fn path(points: &[DVec2]) -> Option<tiny_skia::Path> {
        let mut path = PathBuilder::new();
        for (i, &p) in points.iter().enumerate() {
            let (x, y) = Self::place(p);
            if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
        path.finish()
    }

    fn outline(&mut self, polygon: &[[f64; 2]], rgb: [u8; 3]) {
        let points: Vec<DVec2> = polygon.iter().chain(&polygon[..1]).map(|&p| p.into()).collect();
        let Some(path) = Self::path(&points) else { return };
        self.0.fill_path(&path, &Self::paint(rgb, 200), FillRule::Winding, Transform::identity(), None);
        let stroke = Stroke { width: 2.0, ..Stroke::default() };
        self.0.stroke_path(&path, &Self::paint([60, 66, 76], 255), &stroke, Transform::identity(), None);
    }

    /// A dropped contact has a dashed arrow, so the picture is readable without colours.
    fn arrow(&mut self, at: DVec2, along: DVec2, length: f64, rgb: [u8; 3], is_dashed: bool) {
        let tip = at + length * along;
        let (back, aside) = (tip - 0.1 * along, 0.045 * along.perp());
        let dash = if is_dashed { StrokeDash::new(vec![10.0, 7.0], 0.0) } else { None };
        let stroke = Stroke { width: 4.0, line_cap: LineCap::Butt, dash, ..Stroke::default() };
        let paint = Self::paint(rgb, 255);
        if let Some(shaft) = Self::path(&[at, back]) {
            self.0.stroke_path(&shaft, &paint, &stroke, Transform::identity(), None);
        }
        for shape in [vec![tip, back + aside, back - aside], circle(at)] {
            if let Some(path) = Self::path(&shape) {
                self.0.fill_path(&path, &paint, FillRule::Winding, Transform::identity(), None);
            }
        }
    }
}

/// A dot of radius 0.03.
fn circle(center: DVec2) -> Vec<DVec2> {
    (0..24).map(|k| center + 0.03 * DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / 24.0)).collect()
}
