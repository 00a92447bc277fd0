//! A polygon in the weights of a face's corners, cut by linear functions.
use cubecl::prelude::*;

/// Room for the vertices of a polygon while it is cut.
pub const ROOM: usize = 12;

/// Cuts a polygon of `n` weights by a linear function with values `h0`, `h1`, `h2` at the corners of the face; keeps what is above when
/// `keep` is 1, what is below when it is −1. Returns the number of weights.
#[cube]
pub fn cut(s: &mut Array<f32>, t: &mut Array<f32>, n: u32, h0: f32, h1: f32, h2: f32, keep: f32) -> u32 {
    // Most faces are all on the inner side.
    let mut count = n;
    if (keep * h0).min(keep * h1).min(keep * h2) < 0.0f32 || keep < 0.0f32 {
        count = cut_across(s, t, n, h0, h1, h2, keep);
    }
    count
}

#[cube]
fn cut_across(s: &mut Array<f32>, t: &mut Array<f32>, n: u32, h0: f32, h1: f32, h2: f32, keep: f32) -> u32 {
    let mut above = false;
    let mut below = false;
    let mut heights = Array::<f32>::new(ROOM);
    let mut old_s = Array::<f32>::new(ROOM);
    let mut old_t = Array::<f32>::new(ROOM);
    let mut i = 0u32;
    while i < n {
        let (x, y) = (s[i as usize], t[i as usize]);
        let h = keep * (h0 + x * (h1 - h0) + y * (h2 - h0));
        heights[i as usize] = h;
        old_s[i as usize] = x;
        old_t[i as usize] = y;
        above = above || h > 0.0f32;
        below = below || h < 0.0f32;
        i += 1u32;
    }
    // What only touches the plane is not cut, and belongs above.
    let mut count = select(below && !above, 0u32, n);
    if keep < 0.0f32 && !above {
        count = 0u32;
    }
    if below && above {
        count = 0u32;
        i = 0u32;
        while i < n {
            let j = select(i + 1u32 == n, 0u32, i + 1u32);
            let h = heights[i as usize];
            let next = heights[j as usize];
            if h >= 0.0f32 && count < comptime!(ROOM as u32) {
                s[count as usize] = old_s[i as usize];
                t[count as usize] = old_t[i as usize];
                count += 1u32;
            }
            // A segment has no edge back.
            let is_edge = n > 2u32 || i == 0u32;
            let crosses = (h > 0.0f32 && next < 0.0f32) || (h < 0.0f32 && next > 0.0f32);
            if is_edge && crosses && count < comptime!(ROOM as u32) {
                let w = h / (h - next);
                s[count as usize] = old_s[i as usize] + w * (old_s[j as usize] - old_s[i as usize]);
                t[count as usize] = old_t[i as usize] + w * (old_t[j as usize] - old_t[i as usize]);
                count += 1u32;
            }
            i += 1u32;
        }
    }
    count
}

/// The whole face.
#[cube]
pub fn start(s: &mut Array<f32>, t: &mut Array<f32>) {
    s[0] = 0.0f32;
    t[0] = 0.0f32;
    s[1] = 1.0f32;
    t[1] = 0.0f32;
    s[2] = 0.0f32;
    t[2] = 1.0f32;
}
