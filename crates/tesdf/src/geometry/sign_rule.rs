use glam::DVec3;

use super::{GeneralizedWinding, WindingNumber};
use crate::base::{InsideRule, Side};

/// Decides by a rule whether points are inside, over all faces. For assets whose cells do not tell
/// the sign by the winding number alone.
#[derive(Clone, Debug)]
pub struct SignRule {
    rule: InsideRule,
    number: Number,
}

#[derive(Clone, Debug)]
enum Number {
    /// Of a closed mesh: an integer.
    Integer(WindingNumber),
    /// Of an open mesh.
    Real(Box<GeneralizedWinding>),
}

impl SignRule {
    /// The rule for these faces. `position` gives the position of a vertex.
    pub fn new(rule: InsideRule, faces: &[[u32; 3]], position: impl Fn(u32) -> DVec3) -> Self {
        let number = match rule {
            InsideRule::Generalized => match GeneralizedWinding::new(faces, position) {
                winding if winding.is_closed() => Number::Integer(winding.into_faces()),
                winding => Number::Real(Box::new(winding)),
            },
            _ => {
                let triangles = faces.iter().map(|f| f.map(&position)).collect();
                Number::Integer(WindingNumber::of_triangles(triangles))
            }
        };
        Self { rule, number }
    }

    /// Whether a point is inside. Exact for closed meshes; on the surface the answer may be either.
    pub fn is_inside(&self, x: DVec3) -> bool {
        match &self.number {
            Number::Integer(winding) => self.rule.holds(winding.at_perturbed(x)),
            Number::Real(winding) => winding.is_inside(x),
        }
    }

    /// The side of a point.
    pub fn side(&self, x: DVec3) -> Side {
        if self.is_inside(x) { Side::Inside } else { Side::Outside }
    }

    /// The side of all points within `radius` of `x`; `None` when it is not certain that they are
    /// on one side. The sides of faces that come there must not differ.
    pub fn side_within(&self, x: DVec3, radius: f64) -> Option<Side> {
        let inside = match &self.number {
            Number::Integer(_) => self.is_inside(x),
            Number::Real(winding) => winding.side_within(x, radius)?,
        };
        Some(if inside { Side::Inside } else { Side::Outside })
    }

    /// Whether the sign can change where there is no face.
    pub fn jumps(&self) -> bool {
        self.jump().is_some()
    }

    /// The number by which the sign changes where there is no face; `None` where it does not.
    pub fn jump(&self) -> Option<&GeneralizedWinding> {
        match &self.number {
            Number::Real(winding) => Some(winding),
            Number::Integer(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn vertex(k: u32) -> DVec3 {
        [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z][k as usize]
    }

    const CLOSED: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [2, 0, 3], [1, 2, 3]];

    #[test]
    fn closed_meshes_have_one_side_around_a_point() {
        let (inside, outside) = (DVec3::splat(0.1), DVec3::splat(0.5));
        for (rule, inverted) in
            [(InsideRule::Winding, false), (InsideRule::Nonzero, true), (InsideRule::Generalized, true)]
        {
            let rule = |faces: &[[u32; 3]]| SignRule::new(rule, faces, vertex);
            let found = rule(&CLOSED);
            assert_eq!((found.side(inside), found.side(outside)), (Side::Inside, Side::Outside));
            assert_eq!(found.side_within(inside, 0.05), Some(Side::Inside));
            assert_eq!(found.side_within(outside, 0.05), Some(Side::Outside));
            assert!(!found.jumps() && found.jump().is_none());
            assert_eq!(rule(&CLOSED.map(|[a, b, c]| [a, c, b])).is_inside(inside), inverted);
        }
    }

    #[test]
    fn open_meshes_have_a_side_where_it_is_certain() {
        let open = SignRule::new(InsideRule::Generalized, &CLOSED[..3], vertex);
        assert!(open.jumps() && open.jump().is_some());
        assert_eq!(open.side(DVec3::splat(0.1)), Side::Inside);
        assert_eq!(open.side_within(DVec3::splat(0.02), 1e-3), Some(Side::Inside));
        assert_eq!(open.side_within(DVec3::splat(3.0), 0.1), Some(Side::Outside));
        assert_eq!(open.side_within(DVec3::splat(0.3), 0.3), None);
    }
}
