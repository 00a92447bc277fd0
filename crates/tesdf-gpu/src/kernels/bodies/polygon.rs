//! A polygon in weights of a face's corners, cut by linear functions.
//!
//! Mirrors `collide/bodies/polygon.rs` of `tesdf`.
use cubecl::prelude::*;
use tesdf::collide::internal;

use crate::kernels::geometry::vector::V3;

/// Capacity for the vertices of a polygon while it is cut.
pub const ROOM: usize = internal::MAX_VERTICES;

/// A polygon while it is cut. Each vertex is given by its weights of the second and the third
/// corner of a face.
#[derive(CubeType)]
pub struct Cut {
    pub s: Array<f32>,
    pub t: Array<f32>,
    /// Number of vertices.
    pub count: u32,
}

/// A piece of a face: its corners as weights of the second and the third corner of the face.
#[derive(CubeType, CubeTypeMut, Clone, Copy, Debug, PartialEq)]
#[expand(derive(Clone, Copy))]
pub struct Quarter {
    pub a_s: f32,
    pub a_t: f32,
    pub b_s: f32,
    pub b_t: f32,
    pub c_s: f32,
    pub c_t: f32,
}

/// The whole face.
#[cube]
pub fn whole() -> Quarter {
    Quarter { a_s: 0.0f32, a_t: 0.0f32, b_s: 1.0f32, b_t: 0.0f32, c_s: 0.0f32, c_t: 1.0f32 }
}

#[cube]
impl Quarter {
    /// A quarter of this piece: 0 to 2 at the corner with this number, 3 in the center.
    pub fn quarter(self, which: u32) -> Quarter {
        let (ab_s, ab_t) = (0.5f32 * (self.a_s + self.b_s), 0.5f32 * (self.a_t + self.b_t));
        let (bc_s, bc_t) = (0.5f32 * (self.b_s + self.c_s), 0.5f32 * (self.b_t + self.c_t));
        let (ca_s, ca_t) = (0.5f32 * (self.c_s + self.a_s), 0.5f32 * (self.c_t + self.a_t));
        let at_a = which == 0u32;
        let at_b = which == 1u32;
        let at_c = which == 2u32;
        Quarter {
            a_s: select(at_a, self.a_s, select(at_c, ca_s, ab_s)),
            a_t: select(at_a, self.a_t, select(at_c, ca_t, ab_t)),
            b_s: select(at_b, self.b_s, select(at_a, ab_s, bc_s)),
            b_t: select(at_b, self.b_t, select(at_a, ab_t, bc_t)),
            c_s: select(at_c, self.c_s, select(at_b, bc_s, ca_s)),
            c_t: select(at_c, self.c_t, select(at_b, bc_t, ca_t)),
        }
    }

    /// Twice the area of the piece, in weights.
    pub fn area(self) -> f32 {
        ((self.b_s - self.a_s) * (self.c_t - self.a_t) - (self.b_t - self.a_t) * (self.c_s - self.a_s)).abs()
    }
}

/// The piece at the end of a path of quarters. A path has two bits per level, with the last level
/// in the lowest bits.
#[cube]
pub fn quarter_at(path: u32, levels: u32) -> Quarter {
    let mut found = whole();
    let mut level = 0u32;
    while level < levels {
        found = found.quarter((path >> (2u32 * (levels - 1u32 - level))) & 3u32);
        level += 1u32;
    }
    found
}

/// An empty polygon.
#[cube]
pub fn no_polygon() -> Cut {
    Cut { s: Array::<f32>::new(ROOM), t: Array::<f32>::new(ROOM), count: 0u32 }
}

#[cube]
impl Cut {
    /// Starts with a piece of a face that has `count` corners.
    pub fn start(&mut self, part: Quarter, count: u32) {
        self.put(0u32, part.a_s, part.a_t);
        self.put(1u32, part.b_s, part.b_t);
        self.put(2u32, part.c_s, part.c_t);
        self.count = count;
    }

    /// Sets a vertex.
    pub fn put(&mut self, at: u32, s: f32, t: f32) {
        self.s[at as usize] = s;
        self.t[at as usize] = t;
    }

    /// Cuts by a linear function, given by its values at the corners of the face. `keep` 1 keeps
    /// the part above zero, and −1 the part below.
    pub fn cut(&mut self, heights: V3, keep: f32) {
        // Skip the cut when the whole face is on the kept side, as most faces are.
        if (heights * keep).least() < 0.0f32 || keep < 0.0f32 {
            self.cut_across(heights, keep);
        }
    }

    fn cut_across(&mut self, corners: V3, keep: f32) {
        let n = self.count;
        let mut above = false;
        let mut below = false;
        let mut heights = Array::<f32>::new(ROOM);
        let mut old_s = Array::<f32>::new(ROOM);
        let mut old_t = Array::<f32>::new(ROOM);
        let mut i = 0u32;
        while i < n {
            let (x, y) = (self.s[i as usize], self.t[i as usize]);
            let h = keep * (corners.x + x * (corners.y - corners.x) + y * (corners.z - corners.x));
            heights[i as usize] = h;
            old_s[i as usize] = x;
            old_t[i as usize] = y;
            above = above || h > 0.0f32;
            below = below || h < 0.0f32;
            i += 1u32;
        }
        // A polygon that only touches the plane is not cut. It belongs to the part above.
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
                    self.put(count, old_s[i as usize], old_t[i as usize]);
                    count += 1u32;
                }
                // A segment has no edge from its end back to its start.
                let is_edge = n > 2u32 || i == 0u32;
                let crosses = (h > 0.0f32 && next < 0.0f32) || (h < 0.0f32 && next > 0.0f32);
                if is_edge && crosses && count < comptime!(ROOM as u32) {
                    let w = h / (h - next);
                    let s = old_s[i as usize] + w * (old_s[j as usize] - old_s[i as usize]);
                    let t = old_t[i as usize] + w * (old_t[j as usize] - old_t[i as usize]);
                    self.put(count, s, t);
                    count += 1u32;
                }
                i += 1u32;
            }
        }
        self.count = count;
    }

    /// Twice the area of a convex polygon, in weights.
    pub fn area(&self) -> f32 {
        let mut area = 0.0f32;
        let mut k = 2u32;
        while k < self.count {
            let x = self.s[(k - 1u32) as usize] - self.s[0];
            let y = self.t[(k - 1u32) as usize] - self.t[0];
            area += (x * (self.t[k as usize] - self.t[0]) - y * (self.s[k as usize] - self.s[0])).abs();
            k += 1u32;
        }
        area
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Four quarters cover a face, and each of the first three has its corner.
    #[test]
    fn quarters_cover_a_face() {
        for path in 0..64 {
            let part = quarter_at(path, 3);
            let quarters = [0, 1, 2, 3].map(|which| part.quarter(which));
            assert_eq!(quarters.map(Quarter::area), [0.25 * part.area(); 4]);
            assert_eq!((quarters[0].a_s, quarters[1].b_t, quarters[2].c_s), (part.a_s, part.b_t, part.c_s));
            assert_eq!(quarters[3], quarter_at(4 * path + 3, 4));
        }
        assert_eq!(quarter_at(0, 0), whole());
    }
}
