use tiny_skia::{Color, FillRule, Paint, Path, PathBuilder, Pixmap, Transform};
use ttf_parser::{Face, OutlineBuilder};

/// Latin-1 of DejaVu Sans, so that no font of the system is needed; licence in `assets/`.
const FONT: &[u8] = include_bytes!("../../assets/DejaVuSans-subset.ttf");

/// Where a text stands relative to its point.
#[derive(Clone, Copy)]
pub enum Anchor {
    /// The text starts at the point.
    Start,
    /// The text is centred on the point.
    Middle,
}

/// Draws single lines of text.
pub struct Lettering {
    face: Face<'static>,
}

impl Lettering {
    /// The built-in font.
    pub fn new() -> Option<Self> {
        Face::parse(FONT, 0).ok().map(|face| Self { face })
    }

    fn advance(&self, c: char) -> f32 {
        let glyph = self.face.glyph_index(c).unwrap_or_default();
        f32::from(self.face.glyph_hor_advance(glyph).unwrap_or(0)) / f32::from(self.face.units_per_em())
    }

    /// Width of `text` in pixels, `size` pixels per em.
    pub fn width(&self, text: &str, size: f32) -> f32 {
        text.chars().map(|c| self.advance(c)).sum::<f32>() * size
    }

    /// `text`, cut with an ellipsis where it is wider than `width` pixels.
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
        let scale = size / f32::from(self.face.units_per_em());
        let mut pen = x - match anchor {
            Anchor::Start => 0.0,
            Anchor::Middle => 0.5 * self.width(text, size),
        };
        let mut glyphs = Glyphs { path: PathBuilder::new(), x: 0.0, y, scale };
        for c in text.chars() {
            glyphs.x = pen;
            self.face.outline_glyph(self.face.glyph_index(c).unwrap_or_default(), &mut glyphs);
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

/// Glyph outlines in pixels, y downwards.
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

impl OutlineBuilder for Glyphs {
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
