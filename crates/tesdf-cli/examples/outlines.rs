//! Writes the outlines of the built-in font, `assets/DejaVuSans-outlines.txt`. The test
//! `tests/it/outlines.rs` compares the file with the font.
//!
//! `cargo run -p tesdf-cli --example outlines > crates/tesdf-cli/assets/DejaVuSans-outlines.txt`
use std::error::Error;
use std::fmt::Write as _;

use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{FontRef, GlyphId, MetadataProvider};

const FONT: &[u8] = include_bytes!("../assets/DejaVuSans-subset.ttf");

/// The path of an SVG file.
#[derive(Default)]
struct SvgPath(String);

impl OutlinePen for SvgPath {
    fn move_to(&mut self, x: f32, y: f32) {
        let _ = write!(self.0, " M {x} {y}");
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let _ = write!(self.0, " L {x} {y}");
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let _ = write!(self.0, " Q {x1} {y1} {x} {y}");
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let _ = write!(self.0, " C {x1} {y1} {x2} {y2} {x} {y}");
    }

    fn close(&mut self) {
        self.0.push_str(" Z");
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let font = FontRef::new(FONT)?;
    let (size, location) = (Size::unscaled(), LocationRef::default());
    let metrics = font.glyph_metrics(size, location);
    println!("{}", font.metrics(size, location).units_per_em);
    let mut glyphs: Vec<(u32, GlyphId)> = font.charmap().mappings().collect();
    glyphs.push((0, GlyphId::NOTDEF));
    glyphs.sort_unstable();
    for (code, glyph) in glyphs {
        let mut path = SvgPath::default();
        if let Some(outline) = font.outline_glyphs().get(glyph) {
            outline.draw(DrawSettings::unhinted(size, location), &mut path)?;
        }
        println!("{code:x} {}{}", metrics.advance_width(glyph).unwrap_or(0.0), path.0);
    }
    Ok(())
}
