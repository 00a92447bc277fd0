use glam::DVec3;

/// Depth of the deepest cell. Three levels halve the edges, so 66 levels reach `side / 2^22`.
pub const MAX_DEPTH: u32 = 66;

/// The axes of the unit cube, in the order in which each of the six Kuhn tetrahedra walks along
/// them.
///
/// Root `r` has the corners `0, e_i, e_i + e_j, (1, 1, 1)` with `(i, j, k) = ROOTS[r]`. It contains
/// the points with `x_i ≥ x_j ≥ x_k`.
pub const ROOTS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// The root, by whether `x ≥ y`, `x ≥ z`, `y ≥ z` (bits 2, 1, 0). Two of the eight combinations are
/// impossible.
const ROOT_OF_ORDER: [usize; 8] = [5, 3, 5, 2, 4, 4, 1, 0];

/// A cell: a tetrahedron of the bisection forest.
///
/// ```text
///   k = 3: bisect edge 0–3      child 0: c0 c1 c2 m     child 1: c1 c2 c3 m
///   k = 2: bisect edge 0–2      child 0: c0 c1 m  c3    child 1: c1 c2 m  c3
///   k = 1: bisect edge 0–1      child 0: c0 m  c2 c3    child 1: c1 m  c2 c3
/// ```
///
/// `k` goes through 3, 2, 1 again and again (Maubach 1995, *Local bisection refinement for
/// n-simplicial grids*). The cells of one depth have at most three shapes, up to congruence, so no
/// refinement makes slivers. Corners are exact: every coordinate is a dyadic fraction of the cube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// The corners, in the order that the bisection needs.
    pub corners: [DVec3; 4],
    /// Number of bisections from the root.
    pub depth: u32,
}

impl Cell {
    /// The root tetrahedron `root` (0–5) of the cube `[origin, origin + side]³`.
    pub fn root(origin: DVec3, side: f64, root: usize) -> Self {
        let [i, j, _] = ROOTS[root];
        let mut corners = [DVec3::ZERO, DVec3::ZERO, DVec3::ZERO, DVec3::ONE];
        corners[1][i] = 1.0;
        corners[2][i] = 1.0;
        corners[2][j] = 1.0;
        Self { corners: corners.map(|c| origin + side * c), depth: 0 }
    }

    /// The corner that the refinement edge joins to corner 0.
    fn k(&self) -> usize {
        3 - (self.depth % 3) as usize
    }

    /// The midpoint of the refinement edge. It is the only new corner of both children.
    pub fn midpoint(&self) -> DVec3 {
        0.5 * (self.corners[0] + self.corners[self.k()])
    }

    /// For each corner of child `side` (0 or 1) where it comes from: the number of a corner of this
    /// cell, or 4 for its midpoint.
    pub fn child_corners(&self, side: usize) -> [usize; 4] {
        match (self.k(), side) {
            (3, 0) => [0, 1, 2, 4],
            (3, _) => [1, 2, 3, 4],
            (2, 0) => [0, 1, 4, 3],
            (2, _) => [1, 2, 4, 3],
            (_, 0) => [0, 4, 2, 3],
            _ => [1, 4, 2, 3],
        }
    }

    /// Child 0 or 1.
    pub fn child(&self, side: usize) -> Self {
        let midpoint = self.midpoint();
        let corner = |from: usize| if from == 4 { midpoint } else { self.corners[from] };
        Self { corners: self.child_corners(side).map(corner), depth: self.depth + 1 }
    }

    /// The barycentric coordinates, in child `side`, of a point with the coordinates `lambda` in a
    /// cell whose refinement edge ends at corner `k`. It is the floating-point form of
    /// [`Barycentric::descend`].
    #[inline(always)]
    pub fn lambda_of_child(lambda: [f64; 4], k: usize, side: usize) -> [f64; 4] {
        let [a, l1, l2, l3] = lambda;
        let b = lambda[k];
        let (kept, middle) = if side == 0 { (a - b, 2.0 * b) } else { (b - a, 2.0 * a) };
        match (k, side) {
            (3, 0) => [kept, l1, l2, middle],
            (3, _) => [l1, l2, kept, middle],
            (2, 0) => [kept, l1, middle, l3],
            (2, _) => [l1, kept, middle, l3],
            _ => [kept, middle, l2, l3],
        }
    }

    /// Mean of the corners.
    pub fn centroid(&self) -> DVec3 {
        0.25 * (self.corners[0] + self.corners[1] + self.corners[2] + self.corners[3])
    }

    /// Length of the longest edge.
    pub fn width(&self) -> f64 {
        let c = &self.corners;
        let edges = [(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)];
        edges.into_iter().map(|(i, j)| c[i].distance(c[j])).fold(0.0, f64::max)
    }

    /// Greatest distance of a corner from the centroid. It is the radius of the least ball around
    /// the centroid that contains the cell.
    pub fn radius(&self) -> f64 {
        let center = self.centroid();
        self.corners.iter().map(|c| c.distance(center)).fold(0.0, f64::max)
    }

    /// Volume.
    pub fn volume(&self) -> f64 {
        crate::geometry::tetrahedron_volume(&self.corners)
    }

    /// Whether the inscribed ball has a radius of at least a tenth of the longest edge. This is so
    /// for all cells of the bisection domain.
    pub fn is_fat(&self) -> bool {
        let [a, b, c, d] = self.corners;
        let twice_area = |a: DVec3, b: DVec3, c: DVec3| (b - a).cross(c - a).length();
        let around = twice_area(a, b, c) + twice_area(a, b, d) + twice_area(a, c, d) + twice_area(b, c, d);
        // The radius is three times the volume, over the area of the sides.
        60.0 * self.volume() >= around * self.width()
    }
}

/// A point as fixed-point barycentric coordinates of its cell. They are exact from a cell to its
/// child.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Barycentric {
    lambda: [u64; 4],
}

impl Barycentric {
    /// Fixed-point one: coordinates are whole multiples of `side / 2^52`.
    pub const ONE: u64 = 1 << 52;

    /// The root tetrahedron of a point of the unit cube, and the coordinates of the point in it.
    ///
    /// `None` outside of the closed unit cube, and for NaN.
    #[inline]
    pub fn in_unit_cube(p: DVec3) -> Option<(usize, Self)> {
        Self::in_grid(p, 0)
    }

    /// The cell of depth `3 · level` of a point of the unit cube, and the coordinates of the point
    /// in it.
    ///
    /// Three uniform bisections of the Kuhn cube make eight half cubes. Each is cut like the whole
    /// cube, but mirrored along the axes on which its index is odd. So the cells of depth `3 ·
    /// level` are those of a grid with `2^level` cubes along a side and six cells in each cube:
    /// cell `6 · (x + (y << level) + (z << 2 level)) + root`. `None` as in
    /// [`in_unit_cube`](Self::in_unit_cube).
    #[inline(always)]
    pub fn in_grid(p: DVec3, level: u32) -> Option<(usize, Self)> {
        let inside = p.cmpge(DVec3::ZERO).all() && p.cmple(DVec3::ONE).all();
        if !inside {
            return None;
        }
        let last = (1u64 << level) - 1;
        let mut cube = 0;
        let u: [u64; 3] = std::array::from_fn(|axis| {
            // In [1, 2] the bits of a double are a fixed-point number, rounded to nearest, so no
            // conversion is needed.
            let x = (p[axis] + 1.0).to_bits() - 1f64.to_bits();
            let index = (x >> (52 - level)).min(last);
            cube |= (index as usize) << (axis as u32 * level);
            let within = (x << level) - index * Self::ONE;
            if index & 1 == 0 { within } else { Self::ONE - within }
        });
        // Index of the permutation that sorts u in descending order. Equal coordinates are in the
        // order of the axes.
        let (xy, xz, yz) = (u[0] >= u[1], u[0] >= u[2], u[1] >= u[2]);
        let root = ROOT_OF_ORDER[usize::from(xy) << 2 | usize::from(xz) << 1 | usize::from(yz)];
        let [i, j, k] = ROOTS[root];
        let lambda = [Self::ONE - u[i], u[i] - u[j], u[j] - u[k], u[k]];
        Some((6 * cube + root, Self { lambda }))
    }

    /// Moves to the child of the point, and returns the side of the child, 0 or 1. A point of the
    /// shared face goes to side 0.
    #[inline]
    pub fn descend(&mut self, depth: u32) -> usize {
        match depth % 3 {
            0 => self.descend_k::<3>(),
            1 => self.descend_k::<2>(),
            _ => self.descend_k::<1>(),
        }
    }

    /// The same as [`descend`](Self::descend), for a cell whose refinement edge ends at corner `K`.
    ///
    /// The point is in the half of the refinement edge whose corner has the greater coordinate.
    /// That corner keeps the difference, and the midpoint gets twice the lesser coordinate. The
    /// code has no branches, because no processor could predict which child a point is in.
    #[inline(always)]
    pub fn descend_k<const K: usize>(&mut self) -> usize {
        let [a, l1, l2, l3] = self.lambda;
        let b = self.lambda[K];
        let second = a < b;
        let (kept, middle) = (a.abs_diff(b), 2 * a.min(b));
        let pick = |first: u64, other: u64| if second { other } else { first };
        self.lambda = match K {
            3 => [pick(kept, l1), pick(l1, l2), pick(l2, kept), middle],
            2 => [pick(kept, l1), pick(l1, kept), middle, l3],
            _ => [kept, middle, l2, l3],
        };
        usize::from(second)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn barycentric_of(cell: &Cell, p: DVec3) -> [f64; 4] {
        let volume = |t: [DVec3; 4]| (t[1] - t[0]).cross(t[2] - t[0]).dot(t[3] - t[0]);
        let whole = volume(cell.corners);
        std::array::from_fn(|k| {
            let mut t = cell.corners;
            t[k] = p;
            volume(t) / whole
        })
    }

    proptest! {
        #[test]
        fn descent_keeps_the_barycentric_coordinates_of_the_cell(x in 0.0..=1.0f64, y in 0.0..=1.0f64, z in 0.0..=1.0f64) {
            let p = DVec3::new(x, y, z);
            let (root, mut lambda) = Barycentric::in_unit_cube(p).unwrap();
            let mut cell = Cell::root(DVec3::ZERO, 1.0, root);
            for depth in 0..24 {
                let exact = barycentric_of(&cell, p);
                for k in 0..4 {
                    let fixed = lambda.lambda[k] as f64 / Barycentric::ONE as f64;
                    prop_assert!((fixed - exact[k]).abs() < 1e-8, "depth {} {:?}", depth, exact);
                }
                prop_assert_eq!(lambda.lambda.iter().sum::<u64>(), Barycentric::ONE);
                let side = lambda.descend(depth);
                cell = cell.child(side);
            }
        }
    }

    proptest! {
        #[test]
        fn the_grid_equals_the_descent_from_the_root(x in 0.0..=1.0f64, y in 0.0..=1.0f64, z in 0.0..=1.0f64, level in 0u32..6) {
            let p = DVec3::new(x, y, z);
            let (_, mut stepped) = Barycentric::in_unit_cube(p).unwrap();
            (0..3 * level).for_each(|depth| { stepped.descend(depth); });
            prop_assert_eq!(Barycentric::in_grid(p, level).unwrap().1, stepped);
        }
    }

    #[test]
    fn children_halve_the_volume() {
        let mut cell = Cell::root(DVec3::splat(-1.0), 2.0, 3);
        for depth in 0..MAX_DEPTH {
            let volume = cell.volume();
            for side in 0..2 {
                assert_eq!(cell.child(side).volume(), 0.5 * volume, "depth {depth}");
            }
            cell = cell.child((depth as usize * 7 / 3) % 2);
        }
    }

    #[test]
    fn points_on_shared_faces_and_corners_have_a_root() {
        for i in 0..27 {
            let p = DVec3::new((i % 3) as f64, (i / 3 % 3) as f64, (i / 9) as f64) / 2.0;
            let (root, _) = Barycentric::in_unit_cube(p).unwrap();
            let [a, b, c] = ROOTS[root];
            assert!(p[a] >= p[b] && p[b] >= p[c]);
        }
        assert_eq!(Barycentric::in_unit_cube(DVec3::new(0.5, f64::NAN, 0.5)), None);
        assert_eq!(Barycentric::in_unit_cube(DVec3::new(0.5, 1.1, 0.5)), None);
    }
}
