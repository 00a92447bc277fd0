use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{FontRef, GlyphId, MetadataProvider};
use tiny_skia::{Color, FillRule, Paint, Path, PathBuilder, Pixmap, Transform};

/// The Latin-1 characters of DejaVu Sans, so that no system font is needed; its licence is in
/// `assets/`.
const FONT: &[u8] = include_bytes!("../../assets/DejaVuSans-subset.ttf");

/// Alignment of a text at its point.
#[derive(Clone, Copy)]
pub enum Anchor {
    /// The text starts at the point.
    Start,
    /// The text is centred on the point.
    Middle,
}

/// Draws single lines of text.
pub struct Lettering {
    font: FontRef<'static>,
    units_per_em: f32,
}

impl Lettering {
    /// The built-in font.
    pub fn new() -> Option<Self> {
        let font = FontRef::new(FONT).ok()?;
        let units_per_em = font.metrics(Size::unscaled(), LocationRef::default()).units_per_em;
        Some(Self { font, units_per_em: f32::from(units_per_em) })
    }

    fn advance(&self, c: char) -> f32 {
        let metrics = self.font.glyph_metrics(Size::unscaled(), LocationRef::default());
        metrics.advance_width(self.glyph(c)).unwrap_or(0.0) / self.units_per_em
    }

    fn glyph(&self, c: char) -> GlyphId {
        self.font.charmap().map(c).unwrap_or_default()
    }

    /// Width of `text` in pixels, at `size` pixels per em.
    pub fn width(&self, text: &str, size: f32) -> f32 {
        text.chars().map(|c| self.advance(c)).sum::<f32>() * size
    }

    /// `text`, shortened with an ellipsis if it is wider than `width` pixels.
    pub fn fit(&self, text: &str, size: f32, width: f32) -> String {
        if self.width(text, size) <= width {
            return text.to_string();
        }
        let mut left = width - self.width("…", size);
        let mut kept: String = text
            .chars()
            .take_while(|&c| {
                left -= self.advance(c) * size;
                left >= 0.0
            })
            .collect();
        kept.push('…');
        kept
    }

    /// The outline of `text` with its baseline at `y`.
    pub fn outline(&self, text: &str, size: f32, [x, y]: [f32; 2], anchor: Anchor) -> Option<Path> {
        let scale = size / self.units_per_em;
        let mut pen = x - match anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => 0.5 * self.width(text, size),
        };
        let outlines = self.font.outline_glyphs();
        let mut glyphs = Glyphs { path: PathBuilder::new(), x: 0.0, y, scale };
        for c in text.chars() {
            glyphs.x = pen;
            let settings = DrawSettings::unhinted(Size::unscaled(), LocationRef::default());
            // A space has no outline.
            let _ = outlines.get(self.glyph(c)).map(|outline| outline.draw(settings, &mut glyphs));
            pen += self.advance(c) * size;
        }
        glyphs.path.finish()
    }

    /// Draws `text` with its baseline at `y`.
    pub fn draw(&self, map: &mut Pixmap, text: &str, size: f32, at: [f32; 2], anchor: Anchor, colour: Color) {
        if let Some(path) = self.outline(text, size, at, anchor) {
            let mut paint = Paint::default();
            paint.set_color(colour);
            map.fill_path(&path, &paint, FillRule::Winding, Transform::identity(), None);
        }
    }
}

/// Collects glyph outlines in pixels, y downwards.
struct Glyphs {
    path: PathBuilder,
    x: f32,
    y: f32,
    scale: f32,
}

impl Glyphs {
    fn at(&self, x: f32, y: f32) -> (f32, f32) {
        (self.x + self.scale * x, self.y - self.scale * y)
    }
}

impl OutlinePen for Glyphs {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.path.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.path.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.at(x1, y1), self.at(x, y));
        self.path.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) = (self.at(x1, y1), self.at(x2, y2), self.at(x, y));
        self.path.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}
