use std::collections::BTreeMap;

use tiny_skia::{Color, FillRule, Paint, Path, PathBuilder, Pixmap, Transform};

/// Outlines of the Latin-1 characters of DejaVu Sans, so that neither a system font nor a font
/// parser is needed. The example `outlines` makes this file from the font, and a test compares the
/// two. The licence is in `assets/`.
///
/// The first line has the units per em. Each other line has a code point (hexadecimal; `0` for
/// missing characters), the advance, and the outline as an SVG path, y upwards.
const OUTLINES: &str = include_str!("../../assets/DejaVuSans-outlines.txt");

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
    units_per_em: f32,
    glyphs: BTreeMap<char, Glyph>,
}

/// A character, in units of the font.
#[derive(Clone, Debug, Default, PartialEq)]
struct Glyph {
    advance: f32,
    outline: Vec<Segment>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Segment {
    Move([f32; 2]),
    Line([f32; 2]),
    Quad([f32; 2], [f32; 2]),
    Close,
}

/// The key of the glyph that is drawn for missing characters.
const MISSING: char = '\0';

impl Lettering {
    /// The built-in font.
    pub fn new() -> Option<Self> {
        let mut lines = OUTLINES.lines();
        let units_per_em = lines.next()?.parse().ok()?;
        Some(Self { units_per_em, glyphs: lines.map(parse).collect::<Option<_>>()? })
    }

    fn glyph(&self, c: char) -> Option<&Glyph> {
        self.glyphs.get(&c).or_else(|| self.glyphs.get(&MISSING))
    }

    fn advance(&self, c: char) -> f32 {
        self.glyph(c).map_or(0.0, |glyph| glyph.advance / self.units_per_em)
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
        let mut path = PathBuilder::new();
        for c in text.chars() {
            // Pixels, y downwards.
            let at = |[u, v]: [f32; 2]| (pen + scale * u, y - scale * v);
            for segment in self.glyph(c).map_or(&[][..], |glyph| &glyph.outline) {
                match *segment {
                    Segment::Move(to) => path.move_to(at(to).0, at(to).1),
                    Segment::Line(to) => path.line_to(at(to).0, at(to).1),
                    Segment::Quad(by, to) => path.quad_to(at(by).0, at(by).1, at(to).0, at(to).1),
                    Segment::Close => path.close(),
                }
            }
            pen += self.advance(c) * size;
        }
        path.finish()
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

/// A line of [`OUTLINES`].
fn parse(line: &str) -> Option<(char, Glyph)> {
    let mut words = line.split(' ');
    let c = char::from_u32(u32::from_str_radix(words.next()?, 16).ok()?)?;
    let mut glyph = Glyph { advance: words.next()?.parse().ok()?, outline: Vec::new() };
    while let Some(command) = words.next() {
        let mut point = || Some([words.next()?.parse().ok()?, words.next()?.parse().ok()?]);
        glyph.outline.push(match command {
            "M" => Segment::Move(point()?),
            "L" => Segment::Line(point()?),
            "Q" => Segment::Quad(point()?, point()?),
            "Z" => Segment::Close,
            _ => return None,
        });
    }
    Some((c, glyph))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_of_latin_1_has_a_glyph_and_other_characters_a_box() {
        let lettering = Lettering::new().expect("the outlines can be read");
        for c in (' '..='~').chain('\u{a1}'..='\u{ff}').chain(['…', 'µ', '−']) {
            assert!(lettering.advance(c) > 0.2, "{c}");
        }
        assert_eq!(lettering.glyph('\u{4e00}'), lettering.glyphs.get(&MISSING));
        assert!(lettering.width("mm", 10.0) > lettering.width("ii", 10.0));
        assert!(lettering.outline("0.5 mm", 12.0, [3.0, 20.0], Anchor::Middle).is_some());
    }
}
