//! A node or leaf of the face tree of a surface, and whether it can touch a field.
use glam::DVec3;

use crate::asset::layout::TreeChild;
use crate::collide::bodies::field::FieldBody;
use crate::collide::bodies::reach::Reach;

/// A node or leaf of the face tree.
#[derive(Clone, Copy, Debug)]
pub struct Branch {
    /// The node or leaf.
    pub child: TreeChild,
    /// Centre of a ball that contains it, in the field's frame.
    pub center: DVec3,
    /// Radius of the ball.
    pub radius: f64,
}

impl Branch {
    /// Whether none of its points can be within its contact distance of the solid.
    pub fn is_beyond(&self, field: &FieldBody, reach: &Reach) -> bool {
        field.is_beyond(self.center, self.radius, reach.around(self.center, self.radius))
    }

    /// Lower bound of the distances that its contacts report; `None` where it can have none.
    pub fn least_contact(&self, field: &FieldBody, reach: &Reach) -> Option<f64> {
        field.least_contact(self.center, self.radius, reach.around(self.center, self.radius))
    }
}
