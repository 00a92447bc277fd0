use tesdf::glam::Vec3;

/// Red, green and blue in linear light; 1 is white.
pub type Linear = Vec3;

/// Colours of bodies in the order in which they are used: steel, amber, then matching colours.
const PALETTE: [[u8; 3]; 8] = [
    [122, 152, 189],
    [236, 160, 76],
    [112, 178, 146],
    [205, 106, 104],
    [158, 136, 196],
    [214, 196, 106],
    [96, 172, 188],
    [166, 146, 128],
];

/// The colour of the body at index `body`.
pub fn of_body(body: usize) -> Linear {
    linear(PALETTE[body % PALETTE.len()])
}

/// Converts sRGB to linear light.
pub fn linear(rgb: [u8; 3]) -> Linear {
    Vec3::from_array(rgb.map(|c| {
        let c = f32::from(c) / 255.0;
        if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
    }))
}

/// Converts linear light to sRGB.
pub fn srgb(light: Linear) -> [u8; 3] {
    light.to_array().map(|c| {
        let c = c.clamp(0.0, 1.0);
        let c = if c <= 0.0031308 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 };
        (c * 255.0).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_colours_and_srgb_are_inverse() {
        for c in 0..=255 {
            assert_eq!(srgb(linear([c, 255 - c, 7])), [c, 255 - c, 7]);
        }
        assert_eq!(srgb(Vec3::new(-1.0, 9.0, 1.0)), [0, 255, 255]);
    }
}
