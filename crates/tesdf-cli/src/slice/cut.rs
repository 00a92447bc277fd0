use std::fmt;

use tesdf::glam::{DVec2, DVec3};

/// The axis that is perpendicular to the plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Axis {
    /// The picture shows y to the right and z upwards.
    X,
    /// The picture shows x to the right and z upwards.
    Y,
    /// The picture shows x to the right and y upwards.
    Z,
}

impl Axis {
    /// Indices of the coordinate along the axis, the coordinate to the right, and the coordinate
    /// upwards.
    const fn indices(self) -> (usize, usize, usize) {
        match self {
            Self::X => (0, 1, 2),
            Self::Y => (1, 0, 2),
            Self::Z => (2, 0, 1),
        }
    }

    /// The coordinate along the axis.
    pub fn along(self, p: DVec3) -> f64 {
        p[self.indices().0]
    }

    /// The coordinates to the right and upwards.
    pub fn across(self, p: DVec3) -> DVec2 {
        let (_, right, up) = self.indices();
        DVec2::new(p[right], p[up])
    }

    /// The point at `offset` along the axis and `q` in the plane.
    pub fn point(self, offset: f64, q: DVec2) -> DVec3 {
        let (along, right, up) = self.indices();
        let mut p = DVec3::ZERO;
        (p[along], p[right], p[up]) = (offset, q.x, q.y);
        p
    }
}

impl fmt::Display for Axis {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(["x", "y", "z"][self.indices().0])
    }
}

/// The part of the plane that is drawn, and its title.
#[derive(Clone, Debug)]
pub struct View {
    /// The plane is perpendicular to this axis.
    pub axis: Axis,
    /// Coordinate of the plane along the axis, in the mesh's unit.
    pub offset: f64,
    /// Lower left corner, in the mesh's unit.
    pub min: DVec2,
    /// Upper right corner, in the mesh's unit.
    pub max: DVec2,
    /// Name of the unit, such as `mm`; empty when it is not known.
    pub unit: String,
    /// First line above the picture.
    pub title: String,
}

impl View {
    /// The plane at `offset`, over the box from `min` to `max`, with a margin of 6 % of the
    /// picture's diagonal.
    ///
    /// A narrow view is widened to at least 1 : 2, and a flat view is made higher to at most 4 : 1,
    /// so that there is room for the text.
    pub fn of_box(axis: Axis, offset: f64, min: DVec3, max: DVec3) -> Self {
        let (min, max) = (axis.across(min), axis.across(max));
        let extent = max - min;
        let extent = extent + 0.12 * extent.length();
        let extent = extent.max(DVec2::new(extent.y / 2.0, extent.x / 4.0));
        let centre = 0.5 * (min + max);
        Self {
            axis,
            offset,
            min: centre - 0.5 * extent,
            max: centre + 0.5 * extent,
            unit: String::new(),
            title: String::new(),
        }
    }
}

/// The point where a segment meets the plane. The ends of the segment lie on different sides.
fn cut_segment(axis: Axis, offset: f64, a: DVec3, b: DVec3) -> [f64; 2] {
    // The same ends in either order give the same point, so neighbouring outlines meet.
    let (a, b) = if axis.along(a) < axis.along(b) { (a, b) } else { (b, a) };
    let t = (offset - axis.along(a)) / (axis.along(b) - axis.along(a));
    axis.across(a.lerp(b, t)).to_array()
}

/// The section of a tetrahedron: a triangle or a convex quadrilateral, with its corners in order.
/// `None` when the plane misses the tetrahedron.
///
/// A corner on the plane counts as above the plane.
pub fn cut_tetrahedron(axis: Axis, offset: f64, corners: [DVec3; 4]) -> Option<Vec<[f64; 2]>> {
    let (below, above): (Vec<DVec3>, Vec<DVec3>) = corners.iter().partition(|&&p| axis.along(p) < offset);
    let cut = |a: DVec3, b: DVec3| cut_segment(axis, offset, a, b);
    match (&below[..], &above[..]) {
        ([a], [b, c, d]) | ([b, c, d], [a]) => Some(vec![cut(*a, *b), cut(*a, *c), cut(*a, *d)]),
        // Neighbouring corners of the quadrilateral lie on edges with a common end.
        ([a, b], [c, d]) => Some(vec![cut(*a, *c), cut(*a, *d), cut(*b, *d), cut(*b, *c)]),
        _ => None,
    }
}

/// The section of a triangle. A corner on the plane counts as above the plane.
pub fn cut_triangle(axis: Axis, offset: f64, corners: [DVec3; 3]) -> Option<[[f64; 2]; 2]> {
    let (below, above): (Vec<DVec3>, Vec<DVec3>) = corners.iter().partition(|&&p| axis.along(p) < offset);
    let cut = |a: DVec3, b: DVec3| cut_segment(axis, offset, a, b);
    match (&below[..], &above[..]) {
        ([a], [b, c]) | ([b, c], [a]) => Some([cut(*a, *b), cut(*a, *c)]),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tetrahedron_is_cut_in_a_triangle_or_a_convex_quadrilateral() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        assert_eq!(cut_tetrahedron(Axis::Z, 0.5, corners).unwrap(), [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]]);
        let flat =
            [DVec3::new(0., 0., 0.), DVec3::new(2., 2., 0.), DVec3::new(2., 0., 1.), DVec3::new(0., 2., 1.)];
        let quad = cut_tetrahedron(Axis::Z, 0.5, flat).unwrap();
        let turns = (0..4).map(|i| {
            let [a, b, c] = [0, 1, 2].map(|k| DVec2::from(quad[(i + k) % 4]));
            (b - a).perp_dot(c - b)
        });
        assert!(turns.clone().all(|t| t > 0.0) || turns.clone().all(|t| t < 0.0), "{quad:?}");
        assert_eq!(cut_tetrahedron(Axis::Z, 2.0, corners), None);
        assert_eq!(cut_tetrahedron(Axis::Z, 0.0, corners), None);
    }

    #[test]
    fn coordinates_along_and_across_an_axis_give_the_point() {
        let p = DVec3::new(1.0, 2.0, 3.0);
        for (axis, along, across) in
            [(Axis::X, 1., [2., 3.]), (Axis::Y, 2., [1., 3.]), (Axis::Z, 3., [1., 2.])]
        {
            assert_eq!(axis.along(p), along);
            assert_eq!(axis.across(p).to_array(), across);
            assert_eq!(axis.point(along, axis.across(p)), p);
        }
    }
}
