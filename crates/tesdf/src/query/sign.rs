use glam::DVec3;

use super::ON_SURFACE_F64;
use super::locate::Place;
use crate::TeSdf;
use crate::asset::layout::{Label, SignHint, SignHints};
use crate::base::Side;
use crate::geometry::{Closest, Feature, GeneralizedWinding, signed_crossing};

/// The side that the closest feature implies; `None` when it implies none. `height` is the height
/// of the point over the face.
#[inline]
pub fn hinted_side(hints: SignHints, feature: Feature, height: f64) -> Option<Side> {
    let k = match feature {
        Feature::Face => 0,
        Feature::Edge(k) => 1 + k,
        Feature::Vertex(k) => 4 + k,
    };
    match hints.get(k as usize) {
        SignHint::Winding => None,
        SignHint::Plane => Some(if height < 0.0 { Side::Inside } else { Side::Outside }),
        SignHint::Outside => Some(Side::Outside),
        SignHint::Inside => Some(Side::Inside),
    }
}

/// The side of a face at a point of it that is outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Facing {
    /// The front, to which the normal points.
    Outward,
    /// The back.
    Inward,
    /// Both or none, or not the same all around the point.
    Either,
}

impl Facing {
    /// What the normal of the face is multiplied by to point outward; 0 for
    /// [`Either`](Self::Either).
    pub fn sign(self) -> f64 {
        match self {
            Self::Outward => 1.0,
            Self::Inward => -1.0,
            Self::Either => 0.0,
        }
    }
}

/// Lengths (local frame): the points at which the sides of a face are looked up lie this far beside
/// the point, towards the inside of the face, and this far off the face. Other faces that have the
/// point are then farther away, unless they make an angle below some 1e-3 with it.
const ASIDE: f64 = 1e-5;
const OFF: f64 = 1e-9;

/// The points aside lie towards points at this share of the way from the corners to the centroid.
const INNER: f64 = 0.1;

impl TeSdf {
    /// The side of a point in a crossing cell whose nearest face is known in `f64`. The hint
    /// decides where the distance is large enough that rounding cannot change the nearest feature;
    /// elsewhere the winding number decides.
    #[inline]
    pub(super) fn side_in_cell(&self, local: DVec3, position: u32, closest: &Closest) -> Side {
        if closest.distance < ON_SURFACE_F64 {
            return self.exact_side(local);
        }
        let triangle = self.local_triangle(position as usize);
        let height = triangle.normal.dot(local - triangle.corners[0]);
        hinted_side(self.records[position as usize].hints(), closest.feature, height)
            .unwrap_or_else(|| self.exact_side(local))
    }

    /// The side of all points of a place; `None` when they differ.
    #[inline]
    pub(super) fn side_of_place(&self, place: Place) -> Option<Side> {
        match place {
            Place::Listed { label: Label::Inside, .. } => Some(Side::Inside),
            Place::Listed { label: Label::Outside, .. } => Some(Side::Outside),
            Place::Listed { label: Label::Crossing(_), .. } => None,
            Place::Far(_) | Place::NotOfDomain if self.is_by_rule => None,
            Place::Far(side) => Some(side),
            Place::NotOfDomain => Some(Side::Outside),
        }
    }

    /// The side by winding number. Exact.
    #[cold]
    pub(super) fn exact_side(&self, local: DVec3) -> Side {
        if let Some(rule) = self.sign_rule() {
            return rule.side(local);
        }
        if self.winding_in_cell(local) >= 1 { Side::Inside } else { Side::Outside }
    }

    /// The number by which the sign changes where there is no face, in the local frame; `None`
    /// where it does not.
    pub(crate) fn jump(&self) -> Option<&GeneralizedWinding> {
        self.sign_rule()?.jump()
    }

    /// How far the inside can extend beyond the bounds of the faces, in the local frame.
    pub(crate) fn reach_beyond(&self) -> f64 {
        self.jump().map_or(self.half_thickness, GeneralizedWinding::reach_beyond)
    }

    /// The side of a face that is outside at `at`, a point of the face. Where all faces look
    /// outward, this is known. Otherwise the rule tells it, beside the point in three directions:
    /// at an edge of the face its sides would be those of another face.
    pub(crate) fn facing(&self, face: u32, at: DVec3) -> Facing {
        let Some(rule) = self.sign_rule().filter(|_| !self.faces_look_outward()) else {
            return Facing::Outward;
        };
        let triangle = self.local_triangle(face as usize);
        let at = triangle.closest(at).point;
        let center = triangle.corners.iter().sum::<DVec3>() / 3.0;
        let mut facings = triangle.corners.iter().map(|&corner| {
            let way = corner + INNER * (center - corner) - at;
            let beside = at + way * (ASIDE / way.length().max(ASIDE));
            match [1.0, -1.0].map(|side| rule.side(beside + side * OFF * triangle.normal)) {
                [Side::Outside, Side::Inside] => Facing::Outward,
                [Side::Inside, Side::Outside] => Facing::Inward,
                _ => Facing::Either,
            }
        });
        let first = facings.next().unwrap_or(Facing::Either);
        if first != Facing::Either && facings.all(|facing| facing == first) { first } else { Facing::Either }
    }

    /// The normal of a face at a point of it, so that it points outward; zero where it points
    /// outward on both sides or on none, and for a face without area.
    pub(crate) fn outward_normal(&self, face: u32, at: DVec3) -> DVec3 {
        self.facing(face, at).sign() * self.local_triangle(face as usize).normal
    }

    /// The unit normal of a face, turned round where the back of the face is outside at a point of
    /// it, and nothing else.
    pub(super) fn normal_outward(&self, face: u32, at: DVec3) -> DVec3 {
        let normal = self.face_normal(face);
        if self.facing(face, at) == Facing::Inward { -normal } else { normal }
    }

    /// Winding number in a crossing cell: the number at its centroid plus the crossings on the
    /// segment to it. The list names every face that meets the cell.
    pub(super) fn winding_in_cell(&self, local: DVec3) -> i32 {
        let (centroid, winding, offset) = match self.cell(local) {
            Some((cell, Label::Crossing(winding), offset)) => (cell.centroid(), winding, offset),
            Some((_, Label::Inside, _)) => return 1,
            Some((_, Label::Outside, _)) | None => return 0,
        };
        let corners = |f: u32| self.face_corners(f as usize).map(|p| self.frame.to_local(p));
        let crossings = self.with_list(offset, |faces| {
            faces.ids().iter().map(|&f| signed_crossing(local, centroid, corners(f))).sum::<i32>()
        });
        winding as i32 + crossings
    }
}
