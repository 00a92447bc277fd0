//! The contact distance of each part of a surface: a part that hardly moves against the other body
//! looks less far than its pair.
use glam::DVec3;

use crate::collide::bodies::field::FieldBody;
use crate::collide::pairs::ahead::Approach;

/// The contact distances of the parts of a surface, in the frame of a field.
#[derive(Clone, Copy, Debug)]
pub struct Reach {
    /// That of the pair. No part looks farther.
    pub most: f64,
    approach: Approach,
}

impl Reach {
    /// All lengths are in the world's unit. `most` is the contact distance of the pair, `least`
    /// that of a part that does not move against the body of the field.
    pub fn new(approach: &Approach, field: &FieldBody, most: f64, least: f64) -> Self {
        let unit = field.unit();
        let turned = |v: DVec3| field.rotate_back(v);
        let approach = Approach {
            about: field.to_field(approach.about),
            way: turned(approach.way) / unit,
            turn: turned(approach.turn),
            normal: approach.normal.map(turned),
            rest: (approach.rest + least) / unit,
        };
        Self { most: most / unit, approach }
    }

    /// That of all points within `radius` of a point.
    pub fn around(&self, center: DVec3, radius: f64) -> f64 {
        self.most.min(self.approach.around(center, radius))
    }

    /// That of all points within `radius` of the convex hull of some points.
    pub fn of(&self, points: &[DVec3], radius: f64) -> f64 {
        // The motion is linear in the place, so it is greatest at a corner.
        let each = points.iter().map(|p| self.approach.around(*p, radius));
        self.most.min(each.fold(f64::NEG_INFINITY, f64::max))
    }
}
