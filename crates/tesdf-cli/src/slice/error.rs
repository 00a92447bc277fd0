//! Draws where an asset is exact on a plane, and its error elsewhere, as Fig. 11 of the paper.
use rayon::prelude::*;
use tesdf::glam::DVec3;
use tiny_skia::{Color, Paint, PathBuilder, Pixmap, Rect, Transform};

use super::picture::{Frame, INK, PictureError, QUIET, line, paint_overlay, paint_scale_bar, solid};
use super::text::{Anchor, Lettering};
use super::{Overlay, View, colour, ticks};

/// Colour of exact points.
const EXACT: colour::Rgb = [214, 232, 220];
/// Colour of points without a value.
const NONE: colour::Rgb = [236; 3];

/// The exact signed distance at a point, and the error of the asset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// The exact signed distance, in the mesh's unit.
    pub exact: f64,
    /// Absolute error of the asset's signed distance, in the mesh's unit.
    pub error: f64,
}

/// Deviations at the pixels of the plot.
struct Field {
    values: Vec<Option<Deviation>>,
    width: usize,
    max_error: f64,
    /// Errors up to this value count as exact.
    tolerance: f64,
    /// Greatest exact distance from the surface inside the solid.
    max_inside: f64,
    /// Half widths of two bands around the surface: no pixel of the first has an error, and no
    /// pixel of the second has an error above 1 % of `max_inside`. Infinite when there is no such
    /// error.
    widths: [f64; 2],
}

impl Field {
    fn sample(
        view: &View,
        frame: &Frame,
        tolerance: f64,
        deviation: impl Fn(DVec3) -> Option<Deviation> + Sync,
    ) -> Self {
        let [width, height] = frame.plot;
        let values: Vec<Option<Deviation>> = (0..height)
            .into_par_iter()
            .flat_map_iter(|row| (0..width).map(move |column| (column, row)))
            .map(|(column, row)| deviation(view.axis.point(view.offset, frame.place(column, row))))
            .collect();
        let all = || values.iter().flatten();
        let max_inside = all().map(|d| -d.exact).fold(0.0, f64::max);
        let width_of = |bound: f64| {
            all().filter(|d| d.error > bound).map(|d| d.exact.abs()).fold(f64::INFINITY, f64::min)
        };
        Self {
            max_error: all().map(|d| d.error).fold(0.0, f64::max),
            widths: [width_of(tolerance), width_of((0.01 * max_inside).max(tolerance))],
            width: width as usize,
            tolerance,
            max_inside,
            values,
        }
    }

    /// The colour depends on the square root of the error, which makes small errors visible.
    fn colour(&self, error: f64) -> colour::Rgb {
        if error <= self.tolerance {
            return EXACT;
        }
        colour::of(-(error / self.max_error).sqrt(), 1.0, 1.0)
    }

    /// Whether a border of a band passes near the pixel: a neighbour within `reach` lies on its
    /// other side.
    fn border(&self, at: usize, reach: usize) -> bool {
        let Some(here) = self.values[at] else { return false };
        let (row, column) = (at / self.width, at % self.width);
        let near = (row.saturating_sub(reach)..=row + reach)
            .flat_map(|r| [(r, column.saturating_sub(reach)), (r, column), (r, column + reach)]);
        self.widths.iter().filter(|w| w.is_finite()).any(|&width| {
            near.clone().filter(|&(_, c)| c < self.width).any(|(r, c)| {
                let there = self.values.get(r * self.width + c).copied().flatten();
                there.is_some_and(|d| {
                    (d.exact.abs() < width) != (here.exact.abs() < width) && d.exact * here.exact > 0.0
                })
            })
        })
    }

    fn paint(&self, map: &mut Pixmap, frame: &Frame) {
        let stride = frame.picture[0] as usize;
        let reach = (frame.scale.round() as usize).max(1);
        let rows = map.data_mut().par_chunks_mut(4 * stride).skip(frame.origin[1] as usize);
        rows.zip(self.values.par_chunks(self.width)).enumerate().for_each(|(row, (line, values))| {
            for (column, value) in values.iter().enumerate() {
                let rgb = match value {
                    None => NONE,
                    Some(_) if self.border(row * self.width + column, reach) => QUIET,
                    Some(deviation) => self.colour(deviation.error),
                };
                let at = 4 * (frame.origin[0] as usize + column);
                line[at..at + 4].copy_from_slice(&[rgb[0], rgb[1], rgb[2], 255]);
            }
        });
    }
}

/// Draws where the asset is exact on the plane, as a PNG whose longer side has `size` pixels.
///
/// Grey lines bound two bands around the surface: no pixel of the first has an error above
/// `tolerance`, and no pixel of the second has an error above 1 % of the greatest distance inside.
/// `deviation` is called once per pixel, from several threads; a pixel with `None` is grey.
///
/// # Errors
/// [`PictureError`] when the size or the view cannot be drawn.
pub fn draw_error(
    view: &View,
    overlay: &Overlay,
    size: u32,
    tolerance: f64,
    deviation: impl Fn(DVec3) -> Option<Deviation> + Sync,
) -> Result<Vec<u8>, PictureError> {
    let frame = Frame::of(view, size)?;
    let lettering =
        Lettering::new().ok_or_else(|| PictureError::Encode("the built-in font is damaged".into()))?;
    let field = Field::sample(view, &frame, tolerance, deviation);
    let mut map = Pixmap::new(frame.picture[0], frame.picture[1])
        .ok_or_else(|| PictureError::Encode("out of memory".into()))?;
    map.fill(Color::WHITE);
    field.paint(&mut map, &frame);
    paint_overlay(&mut map, &frame, overlay)?;
    paint_words(&mut map, &frame, &field, view, &lettering);
    map.encode_png().map_err(|e| PictureError::Encode(e.to_string()))
}

fn paint_words(map: &mut Pixmap, frame: &Frame, field: &Field, view: &View, lettering: &Lettering) {
    let k = frame.scale;
    let left = frame.origin[0] as f32;
    let unit = if view.unit.is_empty() { String::new() } else { format!(" {}", view.unit) };
    let room = frame.picture[0] as f32 - 2.0 * left;
    let title = lettering.fit(&view.title, 26.0 * k, room);
    lettering.draw(map, &title, 26.0 * k, [left, 44.0 * k], Anchor::Start, solid(INK, 1.0));
    let band = |width: f64| match width < field.max_inside {
        true => format!("{:.3}", width / field.max_inside),
        false => "1".into(),
    };
    let text = format!(
        "{} = {}{unit} · exact up to {}{unit}, band {} · 1 % band {}",
        view.axis,
        ticks::short(view.offset),
        ticks::short(field.widths[0].min(field.max_inside)),
        band(field.widths[0]),
        band(field.widths[1]),
    );
    let text = lettering.fit(&text, 17.0 * k, room);
    lettering.draw(map, &text, 17.0 * k, [left, 72.0 * k], Anchor::Start, solid(QUIET, 1.0));
    if let Some(rect) = frame.rect() {
        line(map, &PathBuilder::from_rect(rect), solid(QUIET, 1.0), k, None);
    }
    paint_scale_bar(map, frame, &unit, lettering);
    paint_bar(map, frame, field, lettering);
}

/// Draws the legend: exact at the bottom, the largest error at the top.
fn paint_bar(map: &mut Pixmap, frame: &Frame, field: &Field, lettering: &Lettering) {
    let k = frame.scale;
    let [x, top] = [(frame.origin[0] + frame.plot[0]) as f32 + 24.0 * k, frame.origin[1] as f32];
    let (width, height, foot) = (22.0 * k, frame.plot[1] as f32, 30.0 * k);
    let fill = |map: &mut Pixmap, y: f32, height: f32, rgb: colour::Rgb| {
        if let Some(rect) = Rect::from_xywh(x, y, width, height) {
            let mut paint = Paint { anti_alias: false, ..Paint::default() };
            paint.set_color(solid(rgb, 1.0));
            map.fill_rect(rect, &paint, Transform::identity(), None);
        }
    };
    let words = |map: &mut Pixmap, y: f32, text: &str| {
        lettering.draw(map, text, 16.0 * k, [x + width + 10.0 * k, y], Anchor::Start, solid(INK, 1.0));
    };
    fill(map, top + height - foot, foot, EXACT);
    words(map, top + height - 0.5 * foot + 5.5 * k, "exact");
    let ramp = (height - foot).round();
    if field.max_error <= field.tolerance || ramp < 40.0 * k {
        return;
    }
    for row in 0..ramp as u32 {
        let share = 1.0 - (f64::from(row) + 0.5) / f64::from(ramp);
        fill(map, top + row as f32, 1.0, colour::of(-share, 1.0, 1.0));
    }
    for share in [1.0f64, 0.75, 0.5, 0.25] {
        let y = top + ramp * (1.0 - share as f32);
        let percent = 100.0 * share * share * field.max_error / field.max_inside.max(f64::MIN_POSITIVE);
        words(map, y.max(top + 6.0 * k) + 5.5 * k, &format!("{} %", ticks::short(percent)));
    }
}
