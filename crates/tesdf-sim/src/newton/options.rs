use serde::{Deserialize, Serialize};

use crate::DynamicsError;
use crate::system::not_negative;

/// Parameters of the built-in engine.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NewtonOptions {
    /// κ: stiffness of a contact, relative to the stiffness that the inertia of its two bodies
    /// gives within one step, where bodies overlap deeply. Measured on a pile of 128 shafts: 10 is
    /// too soft, and 1000 overshoots. Other contacts do not give way.
    pub stiffness: f64,
    /// β: fraction of a penetration that one step removes.
    pub correction: f64,
    /// Maximum speed at which penetrating bodies are pushed apart, m/s.
    pub correction_speed: f64,
    /// Number of times that contacts are detected again at the predicted pose, at most 8. 2 or 3
    /// give more accuracy where parts turn far in a step: teeth of gears that come into mesh are
    /// then pushed to where they belong, not beyond.
    pub redetections: u32,
    /// Contacts are not detected again once the last time has moved no point of a body by more than
    /// this, m. So `redetections` can be as many as the hardest step needs. With 0 there are always
    /// as many.
    pub settled: f64,
    /// Distance that contacts keep, as a fraction of the smaller body's diagonal. Where edges
    /// cross, the gradient of the distance is their common normal as long as they are apart; below,
    /// it is that of one of the faces, and such a contact is a wall in the way of a nut. Contacts
    /// at rest are not lifted to it.
    pub skin: f64,
    /// Bodies that penetrate deeper than this fraction of the smaller body's diagonal are not
    /// detected again, because linear predictions of a deep overlap add energy. The default is 0.1
    /// mm for a part of 3 cm. Links of a loaded chain that are deeper stay so.
    pub deep: f64,
    /// Contacts are detected as far ahead as the motion of this number of steps can close. With a
    /// fixed distance instead, a peg of 50 µm clearance tunnelled at steps of 5 ms.
    pub speculation: f64,
    /// An island of bodies that have been at rest for this time, s, sleeps until something touches or
    /// drives it. With 0 nothing ever sleeps.
    pub sleep: f64,
}

impl Default for NewtonOptions {
    fn default() -> Self {
        Self {
            stiffness: 100.0,
            correction: 0.5,
            correction_speed: 0.5,
            redetections: 1,
            settled: 0.0,
            skin: 2e-6,
            deep: 3e-3,
            speculation: 1.2,
            sleep: 0.5,
        }
    }
}

impl NewtonOptions {
    /// Checks that every value is in its range.
    ///
    /// # Errors
    /// [`DynamicsError::Option`] names an option that is out of range.
    pub fn validate(&self) -> Result<(), DynamicsError> {
        for (option, found) in [
            ("correction_speed", self.correction_speed),
            ("settled", self.settled),
            ("skin", self.skin),
            ("deep", self.deep),
            ("speculation", self.speculation),
            ("sleep", self.sleep),
        ] {
            not_negative(option, found)?;
        }
        let is_stiff = self.stiffness > 0.0 && self.stiffness.is_finite();
        let checks = [
            ("stiffness", self.stiffness, is_stiff, "a finite number greater than 0"),
            ("correction", self.correction, (0.0..=1.0).contains(&self.correction), "0 to 1"),
            ("redetections", f64::from(self.redetections), self.redetections <= 8, "0 to 8"),
        ];
        match checks.into_iter().find(|&(_, _, good, _)| !good) {
            Some((option, found, _, expected)) => Err(DynamicsError::Option { option, found, expected }),
            None => Ok(()),
        }
    }
}
