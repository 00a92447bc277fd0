use tesdf::glam::DVec3;

/// The half space `normal · x > offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HalfSpace {
    /// Unit normal, pointing into the half space.
    pub normal: DVec3,
    /// Distance of its plane from the origin along the normal, in world units.
    pub offset: f64,
}

impl HalfSpace {
    /// The half space `normal · x > offset` for a normal of any length; `None` when the normal has
    /// no direction.
    pub fn new(normal: DVec3, offset: f64) -> Option<Self> {
        let length = normal.length();
        (length > 0.0 && length.is_finite())
            .then(|| Self { normal: normal / length, offset: offset / length })
    }
}

/// The removed space: the intersection of half spaces. One half space removes a half, two remove a
/// wedge, and none removes nothing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cut(pub Vec<HalfSpace>);

/// The part of a ray in the removed space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CutSpan {
    /// Distance along the ray at which it enters the removed space.
    pub enter: f64,
    /// Distance along the ray at which it leaves the removed space.
    pub leave: f64,
    /// The half space through whose plane the ray leaves.
    pub through: HalfSpace,
}

impl Cut {
    /// The part of the ray with `t >= 0` that lies in all half spaces.
    pub fn span(&self, origin: DVec3, along: DVec3) -> Option<CutSpan> {
        let first = *self.0.first()?;
        let mut span = CutSpan { enter: 0.0, leave: f64::INFINITY, through: first };
        for half in &self.0 {
            let (rise, slope) = (half.normal.dot(origin) - half.offset, half.normal.dot(along));
            let t = -rise / slope;
            if slope > 0.0 {
                span.enter = span.enter.max(t);
            } else if slope < 0.0 && t < span.leave {
                (span.leave, span.through) = (t, *half);
            } else if slope == 0.0 && rise <= 0.0 {
                return None;
            }
        }
        (span.enter < span.leave).then_some(span)
    }

    /// Signed distance to the removed space, negative inside. Outside it is a lower bound; it is
    /// infinite when nothing is removed.
    pub fn signed_distance(&self, p: DVec3) -> f64 {
        let outside = self.0.iter().map(|half| half.offset - half.normal.dot(p)).reduce(f64::max);
        outside.unwrap_or(f64::INFINITY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wedge_is_the_intersection_of_its_half_spaces() {
        let half = |x, y, offset| HalfSpace::new(DVec3::new(x, y, 0.0), offset).unwrap();
        let cut = Cut(vec![half(2.0, 0.0, 2.0), half(0.0, 1.0, 0.0)]);
        assert_eq!(cut.0[0].offset, 1.0);
        let from = |x, y| DVec3::new(x, y, 5.0);
        let span = cut.span(from(3.0, 2.0), -DVec3::X).unwrap();
        assert_eq!((span.enter, span.leave, span.through), (0.0, 2.0, cut.0[0]));
        let span = cut.span(from(0.0, 0.5), DVec3::X).unwrap();
        assert_eq!((span.enter, span.leave), (1.0, f64::INFINITY));
        assert_eq!(cut.span(from(3.0, -1.0), -DVec3::X), None);
        assert_eq!(cut.span(from(0.0, 3.0), DVec3::new(1.0, -4.0, 0.0)), None);
        assert_eq!(Cut::default().span(DVec3::ZERO, DVec3::X), None);
        assert_eq!([cut.signed_distance(from(3.0, 1.0)), cut.signed_distance(from(3.0, -2.0))], [-1.0, 2.0]);
        assert_eq!(HalfSpace::new(DVec3::ZERO, 1.0), None);
    }
}
