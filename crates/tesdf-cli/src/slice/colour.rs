/// Red, green and blue, each 0 to 255.
pub type Rgb = [u8; 3];

/// Colours outside, from the surface outwards: pale to deep blue with evenly decreasing lightness.
const OUTSIDE: [Rgb; 5] = [[205, 225, 240], [164, 200, 226], [108, 164, 208], [56, 121, 180], [22, 73, 131]];
/// Colours inside, from the surface inwards: pale sand to deep red, with the same lightness at the
/// same depth.
const INSIDE: [Rgb; 5] = [[252, 222, 184], [247, 189, 133], [236, 142, 82], [205, 89, 46], [142, 42, 32]];

/// The colour of a signed distance. The distances `outside` and `inside` get the deepest colours.
pub fn of(signed_distance: f64, outside: f64, inside: f64) -> Rgb {
    let (ramp, depth) = if signed_distance < 0.0 {
        (&INSIDE, -signed_distance / inside)
    } else {
        (&OUTSIDE, signed_distance / outside)
    };
    let t = depth.clamp(0.0, 1.0) * (ramp.len() - 1) as f64;
    let i = (t as usize).min(ramp.len() - 2);
    let t = t - i as f64;
    std::array::from_fn(|c| (f64::from(ramp[i][c]) * (1.0 - t) + f64::from(ramp[i + 1][c]) * t).round() as u8)
}

/// Blends `over` onto `under` with opacity `alpha`.
pub fn blend(under: Rgb, over: Rgb, alpha: f64) -> Rgb {
    std::array::from_fn(|c| (f64::from(under[c]) * (1.0 - alpha) + f64::from(over[c]) * alpha).round() as u8)
}
