use rayon::prelude::*;
use tesdf::glam::{DVec2, DVec3};
use tiny_skia::{
    Color, FillRule, LineCap, LineJoin, Mask, Paint, Path, PathBuilder, Pixmap, Rect, Stroke, Transform,
};

use super::text::{Anchor, Lettering};
use super::{CellLabel, Overlay, View, colour, ticks};

/// Why a picture cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    /// The size of the picture is out of range.
    #[error("a picture of {0} pixels; expected {min} to {max}", min = SIZES.start(), max = SIZES.end())]
    Size(u32),
    /// There is not enough memory to draw the picture.
    #[error("no memory is left for a picture of {0} pixels; draw a smaller one")]
    Memory(u32),
    /// The view is empty, not finite, or too small for its distance from the origin.
    #[error("the view from {min:?} to {max:?} has no area; give a plane that cuts the domain")]
    View {
        /// Lower left corner.
        min: [f64; 2],
        /// Upper right corner.
        max: [f64; 2],
    },
    /// The PNG cannot be encoded.
    #[error("the picture cannot be encoded: {0}")]
    Encode(String),
}

/// Allowed length of the picture's longer side, pixels.
const SIZES: std::ops::RangeInclusive<u32> = 256..=8192;
/// Memory per pixel while a picture is drawn, bytes.
const BYTES_PER_PIXEL: usize = 32;
/// The layout constants below are for this size; other sizes scale them.
const REFERENCE: f32 = 1200.0;
const LEFT: f32 = 28.0;
const TOP: f32 = 92.0;
const RIGHT: f32 = 148.0;
const BOTTOM: f32 = 32.0;
/// Minimum number of contours on the side of the surface with the larger distances.
const CONTOURS: f64 = 8.0;

pub(super) const INK: [u8; 3] = [24, 30, 40];
pub(super) const QUIET: [u8; 3] = [92, 102, 116];

pub(super) fn solid(rgb: [u8; 3], alpha: f32) -> Color {
    let mut c = Color::from_rgba8(rgb[0], rgb[1], rgb[2], 255);
    c.set_alpha(alpha);
    c
}

/// Draws the signed distance on the plane as a PNG whose longer side has `size` pixels.
///
/// `signed_distance` is called once per pixel, from several threads. A pixel whose value is not
/// finite stays grey.
///
/// # Errors
/// [`PictureError`] when the size or the view cannot be drawn.
pub fn draw(
    view: &View,
    overlay: &Overlay,
    size: u32,
    signed_distance: impl Fn(DVec3) -> f64 + Sync,
) -> Result<Vec<u8>, PictureError> {
    let lettering =
        Lettering::new().ok_or_else(|| PictureError::Encode("the built-in font is damaged".into()))?;
    let frame = Frame::of(view, size)?;
    let field = Field::sample(view, &frame, signed_distance);
    let mut map = Pixmap::new(frame.picture[0], frame.picture[1])
        .ok_or_else(|| PictureError::Encode("out of memory".into()))?;
    map.fill(Color::WHITE);
    field.paint(&mut map, &frame, overlay.surface.is_empty());
    paint_overlay(&mut map, &frame, overlay)?;
    paint_surroundings(&mut map, &frame, &field, view, overlay, &lettering);
    map.encode_png().map_err(|e| PictureError::Encode(e.to_string()))
}

/// Positions in the picture, in pixels from the upper left corner.
pub(super) struct Frame {
    pub picture: [u32; 2],
    /// Left and upper border of the plot.
    pub origin: [u32; 2],
    /// Width and height of the plot.
    pub plot: [u32; 2],
    /// Upper left corner of the plot, in the mesh's unit.
    corner: DVec2,
    /// Edge length of a pixel, in the mesh's unit.
    pixel: f64,
    /// Size of the picture divided by [`REFERENCE`].
    pub scale: f32,
}

impl Frame {
    pub(super) fn of(view: &View, size: u32) -> Result<Self, PictureError> {
        if !SIZES.contains(&size) {
            return Err(PictureError::Size(size));
        }
        let extent = view.max - view.min;
        let bad = || PictureError::View { min: view.min.into(), max: view.max.into() };
        if !(extent.is_finite() && extent.min_element() > 0.0) {
            return Err(bad());
        }
        let scale = size as f32 / REFERENCE;
        let margin = [LEFT + RIGHT, TOP + BOTTOM].map(|m| f64::from(m * scale));
        let room = [f64::from(size) - margin[0], f64::from(size) - margin[1]];
        let pixel = (extent.x / room[0]).max(extent.y / room[1]);
        if !(pixel.is_normal() && view.max.abs().max(view.min.abs()).max_element() < pixel / f64::EPSILON) {
            return Err(bad());
        }
        let plot = [extent.x, extent.y].map(|e| (e / pixel).round().max(1.0) as u32);
        let picture = [0, 1].map(|i| plot[i] + margin[i].round() as u32);
        let origin = [LEFT, TOP].map(|m| (m * scale).round() as u32);
        // Reserved and released again: the memory of values, colours, and copies for the PNG.
        let memory = picture[0] as usize * picture[1] as usize * BYTES_PER_PIXEL;
        if Vec::<u8>::new().try_reserve_exact(memory).is_err() {
            return Err(PictureError::Memory(size));
        }
        Ok(Self { picture, origin, plot, corner: DVec2::new(view.min.x, view.max.y), pixel, scale })
    }

    /// Centre of a pixel of the plot, in the mesh's unit.
    pub(super) fn place(&self, column: u32, row: u32) -> DVec2 {
        self.corner + self.pixel * DVec2::new(f64::from(column) + 0.5, -(f64::from(row) + 0.5))
    }

    fn pixel_of(&self, [x, y]: [f64; 2]) -> [f32; 2] {
        [
            ((x - self.corner.x) / self.pixel) as f32 + self.origin[0] as f32,
            ((self.corner.y - y) / self.pixel) as f32 + self.origin[1] as f32,
        ]
    }

    pub(super) fn rect(&self) -> Option<Rect> {
        let [x, y] = self.origin.map(|v| v as f32);
        Rect::from_xywh(x, y, self.plot[0] as f32, self.plot[1] as f32)
    }
}

/// Signed distances at the pixels of the plot.
struct Field {
    values: Vec<f64>,
    width: usize,
    /// Largest distance on each side of the surface. A side with small distances gets half of the
    /// other's.
    outside: f64,
    inside: f64,
    /// Smallest and largest value.
    range: [f64; 2],
    /// Distance between contours.
    step: f64,
}

impl Field {
    fn sample(view: &View, frame: &Frame, signed_distance: impl Fn(DVec3) -> f64 + Sync) -> Self {
        let [width, height] = frame.plot;
        let values: Vec<f64> = (0..height)
            .into_par_iter()
            .flat_map_iter(|row| (0..width).map(move |column| (column, row)))
            .map(|(column, row)| signed_distance(view.axis.point(view.offset, frame.place(column, row))))
            .collect();
        let finite = || values.iter().copied().filter(|v| v.is_finite());
        let range = [finite().fold(0.0, f64::min), finite().fold(0.0, f64::max)];
        let largest = range[1].max(-range[0]).max(f64::MIN_POSITIVE);
        Self {
            width: width as usize,
            outside: range[1].max(0.5 * largest),
            inside: (-range[0]).max(0.5 * largest),
            range,
            step: ticks::round_step(largest, CONTOURS),
            values,
        }
    }

    /// Gradient length of the values in the plane, per pixel.
    fn slope(&self, at: usize) -> f64 {
        let (row, column) = (at / self.width, at % self.width);
        let last_row = self.values.len() / self.width - 1;
        let difference =
            |a: usize, b: usize, pixels: usize| (self.values[b] - self.values[a]) / pixels.max(1) as f64;
        let (left, right) = (column.saturating_sub(1), (column + 1).min(self.width - 1));
        let (up, down) = (row.saturating_sub(1), (row + 1).min(last_row));
        let across = difference(row * self.width + left, row * self.width + right, right - left);
        let along = difference(up * self.width + column, down * self.width + column, down - up);
        across.hypot(along)
    }

    /// The fraction of the pixel that a contour covers, 0 to 1, and whether this contour is the
    /// surface.
    fn contour(&self, at: usize, frame: &Frame) -> (f64, bool) {
        let value = self.values[at];
        let level = (value / self.step).round();
        let slope = self.slope(at);
        // Where the plane nearly touches a level set, a contour would be a meaningless spot, so it
        // fades out.
        let clear = (slope / (0.25 * frame.pixel)).min(1.0);
        let width = f64::from(frame.scale) * if level == 0.0 { 2.6 } else { 1.1 };
        let distance = (value - level * self.step).abs() / slope.max(f64::MIN_POSITIVE);
        (clear * (0.5 * width + 0.5 - distance).clamp(0.0, 1.0) * width.min(1.0), level == 0.0)
    }

    /// With `with_surface` the zero contour is drawn, because no overlay shows the surface.
    fn paint(&self, map: &mut Pixmap, frame: &Frame, with_surface: bool) {
        let stride = frame.picture[0] as usize;
        let rows = map.data_mut().par_chunks_mut(4 * stride).skip(frame.origin[1] as usize);
        rows.zip(self.values.par_chunks(self.width)).enumerate().for_each(|(row, (line, values))| {
            for (column, &value) in values.iter().enumerate() {
                let rgb = if value.is_finite() {
                    let (cover, is_surface) = self.contour(row * self.width + column, frame);
                    let ink = match (is_surface, with_surface) {
                        (false, _) => 0.34,
                        (true, true) => 0.95,
                        (true, false) => 0.0,
                    };
                    colour::blend(colour::of(value, self.outside, self.inside), INK, ink * cover)
                } else {
                    [200; 3]
                };
                let at = 4 * (frame.origin[0] as usize + column);
                line[at..at + 4].copy_from_slice(&[rgb[0], rgb[1], rgb[2], 255]);
            }
        });
    }
}

pub(super) fn paint_overlay(map: &mut Pixmap, frame: &Frame, overlay: &Overlay) -> Result<(), PictureError> {
    let mut mask = Mask::new(frame.picture[0], frame.picture[1])
        .ok_or_else(|| PictureError::Encode("out of memory".into()))?;
    if let Some(rect) = frame.rect() {
        mask.fill_path(&PathBuilder::from_rect(rect), FillRule::Winding, false, Transform::identity());
    }
    let mut stroke = |path: PathBuilder, colour: Color, width: f32| {
        if let Some(path) = path.finish() {
            line(map, &path, colour, width * frame.scale, Some(&mask));
        }
    };
    for (label, colour) in [
        (CellLabel::Far, solid([255; 3], 0.75)),
        (CellLabel::Outside, solid([255; 3], 0.75)),
        (CellLabel::Inside, solid([255; 3], 0.75)),
        (CellLabel::Crossing, solid([255; 3], 0.9)),
    ] {
        let mut path = PathBuilder::new();
        for cell in overlay.cells.iter().filter(|cell| cell.label == label) {
            let mut corners = cell.polygon.iter().map(|&p| frame.pixel_of(p));
            if let Some([x, y]) = corners.next() {
                path.move_to(x, y);
                corners.for_each(|[x, y]| path.line_to(x, y));
                path.close();
            }
        }
        stroke(path, colour, 0.75);
    }
    let mut path = PathBuilder::new();
    for &[a, b] in &overlay.surface {
        let ([ax, ay], [bx, by]) = (frame.pixel_of(a), frame.pixel_of(b));
        path.move_to(ax, ay);
        path.line_to(bx, by);
    }
    stroke(path, solid(INK, 1.0), 2.4);
    Ok(())
}

pub(super) fn line(map: &mut Pixmap, path: &Path, colour: Color, width: f32, mask: Option<&Mask>) {
    let mut paint = Paint::default();
    paint.set_color(colour);
    let stroke = Stroke { width, line_cap: LineCap::Round, line_join: LineJoin::Round, ..Stroke::default() };
    map.stroke_path(path, &paint, &stroke, Transform::identity(), mask);
}

/// Draws the title, colour bar, scale bar and border.
fn paint_surroundings(
    map: &mut Pixmap,
    frame: &Frame,
    field: &Field,
    view: &View,
    overlay: &Overlay,
    lettering: &Lettering,
) {
    let k = frame.scale;
    let [left, top] = frame.origin.map(|v| v as f32);
    let unit = if view.unit.is_empty() { String::new() } else { format!(" {}", view.unit) };
    let room = frame.picture[0] as f32 - 2.0 * left;
    let title = lettering.fit(&view.title, 26.0 * k, room);
    lettering.draw(map, &title, 26.0 * k, [left, 44.0 * k], Anchor::Start, solid(INK, 1.0));
    let mut line_two = format!(
        "signed distance · {} = {}{unit} · contours every {}{unit}",
        view.axis,
        ticks::short(view.offset),
        ticks::label(field.step, field.step)
    );
    if !overlay.cells.is_empty() {
        line_two += &format!(" · {} cells", overlay.cells.len());
    }
    let line_two = lettering.fit(&line_two, 17.0 * k, room);
    lettering.draw(map, &line_two, 17.0 * k, [left, 72.0 * k], Anchor::Start, solid(QUIET, 1.0));
    if let Some(rect) = frame.rect() {
        line(map, &PathBuilder::from_rect(rect), solid(QUIET, 1.0), k, None);
    }
    paint_colour_bar(map, frame, field, &view.unit, lettering, top);
    paint_scale_bar(map, frame, &unit, lettering);
}

fn paint_colour_bar(
    map: &mut Pixmap,
    frame: &Frame,
    field: &Field,
    unit: &str,
    lettering: &Lettering,
    top: f32,
) {
    let k = frame.scale;
    let x = (frame.origin[0] + frame.plot[0]) as f32 + 24.0 * k;
    let width = 22.0 * k;
    let [low, high] = field.range;
    // Leaves room for the unit above the bar.
    let head = if unit.is_empty() { 0.0 } else { 26.0 * k };
    let (top, height) = (top + head, frame.plot[1] as f32 - head);
    if height < 40.0 * k || high <= low {
        return;
    }
    if !unit.is_empty() {
        lettering.draw(map, unit, 16.0 * k, [x, top - 12.0 * k], Anchor::Start, solid(QUIET, 1.0));
    }
    let fill = |map: &mut Pixmap, rect: Option<Rect>, colour: Color| {
        if let Some(rect) = rect {
            let mut paint = Paint { anti_alias: false, ..Paint::default() };
            paint.set_color(colour);
            map.fill_rect(rect, &paint, Transform::identity(), None);
        }
    };
    let rows = height.round() as u32;
    for row in 0..rows {
        let value = high + (low - high) * (f64::from(row) + 0.5) / f64::from(rows);
        let rgb = colour::of(value, field.outside, field.inside);
        fill(map, Rect::from_xywh(x, top + row as f32, width, 1.0), solid(rgb, 1.0));
    }
    let y_of = |value: f64| top + height * ((high - value) / (high - low)) as f32;
    let apart = height * (field.step / (high - low)) as f32;
    let every = if apart < 22.0 * k { (22.0 * k / apart).ceil() } else { 1.0 };
    let (first, last) = ((low / field.step).ceil() as i64, (high / field.step).floor() as i64);
    for level in first..=last {
        let value = level as f64 * field.step;
        let y = y_of(value);
        let is_surface = level == 0;
        let mut tick = PathBuilder::new();
        tick.move_to(x, y);
        tick.line_to(x + width, y);
        if let Some(tick) = tick.finish() {
            let (ink, thick) = if is_surface { (1.0, 2.4) } else { (0.34, 1.1) };
            line(map, &tick, solid(INK, ink), thick * k, None);
        }
        if level % every as i64 == 0 {
            let text = ticks::label(value, field.step);
            let at = [x + width + 10.0 * k, y + 5.5 * k];
            lettering.draw(map, &text, 16.0 * k, at, Anchor::Start, solid(INK, 1.0));
        }
    }
    if let Some(rect) = Rect::from_xywh(x, top, width, height) {
        line(map, &PathBuilder::from_rect(rect), solid(QUIET, 1.0), k, None);
    }
}

pub(super) fn paint_scale_bar(map: &mut Pixmap, frame: &Frame, unit: &str, lettering: &Lettering) {
    let k = frame.scale;
    let length = ticks::round_step(frame.pixel * f64::from(frame.plot[0]), 4.0);
    let pixels = (length / frame.pixel) as f32;
    let text = format!("{}{unit}", ticks::label(length, length));
    let x = frame.origin[0] as f32 + 18.0 * k;
    let y = (frame.origin[1] + frame.plot[1]) as f32 - 18.0 * k;
    let text_width = lettering.width(&text, 16.0 * k);
    let plate = Rect::from_xywh(x - 8.0 * k, y - 30.0 * k, pixels.max(text_width) + 16.0 * k, 38.0 * k);
    if let Some(plate) = plate {
        let mut paint = Paint::default();
        paint.set_color(solid([255; 3], 0.78));
        map.fill_rect(plate, &paint, Transform::identity(), None);
    }
    let mut bar = PathBuilder::new();
    bar.move_to(x, y - 4.0 * k);
    bar.line_to(x, y);
    bar.line_to(x + pixels, y);
    bar.line_to(x + pixels, y - 4.0 * k);
    if let Some(bar) = bar.finish() {
        line(map, &bar, solid(INK, 1.0), 2.0 * k, None);
    }
    let middle = x + 0.5 * pixels.max(text_width);
    lettering.draw(map, &text, 16.0 * k, [middle, y - 10.0 * k], Anchor::Middle, solid(INK, 1.0));
}
