use glam::DVec3;

use super::{Barycentric, Cell};
use crate::geometry::Aabb;

/// The cube that the six roots fill, in the local frame.
///
/// Its origin and its side are multiples of 2^-20. So all corners of all cells are exact in `f64`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DomainCube {
    origin: DVec3,
    side: f64,
    /// 1 / `side`.
    inverse: f64,
}

const GRAIN: f64 = 1.0 / (1 << 20) as f64;

impl DomainCube {
    /// The least such cube around `bounds` (local frame). It has the same centre.
    pub fn around(bounds: Aabb) -> Self {
        let up = |x: f64, grain: f64| (x / grain).ceil() * grain;
        let side = up(bounds.extent().max_element() + 4.0 * GRAIN, 1024.0 * GRAIN);
        let origin = bounds.center() - 0.5 * side;
        Self::new(origin.map(|x| (x / GRAIN).floor() * GRAIN), side)
    }

    /// A cube with a given origin and side, as stored in an asset.
    pub fn new(origin: DVec3, side: f64) -> Self {
        Self { origin, side, inverse: 1.0 / side }
    }

    /// The least corner, in the local frame.
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// Edge length, in the local frame.
    pub fn side(&self) -> f64 {
        self.side
    }

    /// Centre, in the local frame.
    pub fn middle(&self) -> DVec3 {
        self.origin + 0.5 * self.side
    }

    /// Root tetrahedron number `root`, from 0 to 5.
    pub fn root(&self, root: usize) -> Cell {
        Cell::root(self.origin, self.side, root)
    }

    /// The cell of depth `3 · level` of a point of the local frame, and the coordinates of the
    /// point in it; see [`Barycentric::in_grid`]. The error is at most 2^-51 of the side, which the
    /// padding of the cells covers.
    #[inline]
    pub fn locate(&self, p: DVec3, level: u32) -> Option<(usize, Barycentric)> {
        Barycentric::in_grid((p - self.origin) * self.inverse, level)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cube_contains_its_bounds() {
        for size in [0.3, 0.57735, 1.0] {
            let bounds = Aabb { min: DVec3::splat(-0.1), max: DVec3::new(0.1, size, 0.01) };
            let cube = DomainCube::around(bounds);
            assert!(bounds.min.cmpge(cube.origin()).all());
            assert!(bounds.max.cmple(cube.origin() + cube.side()).all());
        }
    }
}
