//! Friction and restitution of bodies and of pairs.
use super::{System, not_negative};
use crate::DynamicsError;

impl System {
    /// Sets the coefficient of friction of a body.
    ///
    /// # Errors
    /// [`DynamicsError::NoBody`], or [`DynamicsError::Option`] when it is not a finite number of 0
    /// or more.
    pub fn set_friction(&mut self, body: usize, coefficient: f64) -> Result<(), DynamicsError> {
        self.body(body)?;
        self.bodies[body].friction = not_negative("friction", coefficient)?;
        Ok(())
    }

    /// Sets the coefficient of torsional friction of a body, m.
    ///
    /// # Errors
    /// The same errors as [`set_friction`](Self::set_friction).
    pub fn set_friction_torsional(&mut self, body: usize, coefficient: f64) -> Result<(), DynamicsError> {
        self.body(body)?;
        self.bodies[body].friction_torsional = not_negative("friction_torsional", coefficient)?;
        Ok(())
    }

    /// The coefficient of torsional friction between two bodies, m: that of the pair if one was set,
    /// otherwise the geometric mean of those of the bodies. A contact resists spin about its normal
    /// by a moment of at most this length times the force along the normal.
    pub fn friction_torsional(&self, a: usize, b: usize) -> f64 {
        let of_bodies = || (self.bodies[a].friction_torsional * self.bodies[b].friction_torsional).sqrt();
        self.pair_friction_torsional.get(&(a.min(b), a.max(b))).copied().unwrap_or_else(of_bodies)
    }

    /// Whether a body or a pair has torsional friction.
    pub fn has_friction_torsional(&self) -> bool {
        self.bodies.iter().any(|body| body.friction_torsional > 0.0)
            || self.pair_friction_torsional.values().any(|&coefficient| coefficient > 0.0)
    }

    /// Sets the coefficient of restitution of a body.
    ///
    /// # Errors
    /// [`DynamicsError::NoBody`], or [`DynamicsError::Option`] when it is not a number from 0 to 1.
    pub fn set_restitution(&mut self, body: usize, coefficient: f64) -> Result<(), DynamicsError> {
        self.body(body)?;
        if !(0.0..=1.0).contains(&coefficient) {
            let expected = "a number from 0 to 1";
            return Err(DynamicsError::Option { option: "restitution", found: coefficient, expected });
        }
        self.bodies[body].restitution = coefficient;
        Ok(())
    }

    /// The coefficient of restitution between two bodies: the geometric mean of theirs. It is the
    /// speed at which they part over the speed at which they meet.
    pub fn restitution(&self, a: usize, b: usize) -> f64 {
        (self.bodies[a].restitution * self.bodies[b].restitution).sqrt()
    }

    /// Whether a body has a restitution.
    pub(crate) fn has_restitution(&self) -> bool {
        self.bodies.iter().any(|body| body.restitution > 0.0)
    }

    /// Sets the coefficient of friction between two bodies, in place of the one that follows from
    /// those of the bodies.
    ///
    /// # Errors
    /// The same errors as [`set_friction`](Self::set_friction).
    pub fn set_pair_friction(&mut self, a: usize, b: usize, coefficient: f64) -> Result<(), DynamicsError> {
        self.body(a)?;
        self.body(b)?;
        let coefficient = not_negative("friction", coefficient)?;
        self.pair_friction.insert((a.min(b), a.max(b)), coefficient);
        Ok(())
    }

    /// The coefficient of friction between two bodies: that of the pair if one was set, otherwise
    /// the geometric mean of those of the bodies. So a body of coefficient 0 has no friction with
    /// any other.
    pub fn friction(&self, a: usize, b: usize) -> f64 {
        let of_bodies = || (self.bodies[a].friction * self.bodies[b].friction).sqrt();
        self.pair_friction.get(&(a.min(b), a.max(b))).copied().unwrap_or_else(of_bodies)
    }

    /// Sets the coefficient of torsional friction between two bodies, m, in place of the one that
    /// follows from those of the bodies.
    ///
    /// # Errors
    /// The same errors as [`set_friction`](Self::set_friction).
    pub fn set_pair_friction_torsional(
        &mut self,
        a: usize,
        b: usize,
        coefficient: f64,
    ) -> Result<(), DynamicsError> {
        self.body(a)?;
        self.body(b)?;
        let coefficient = not_negative("friction_torsional", coefficient)?;
        self.pair_friction_torsional.insert((a.min(b), a.max(b)), coefficient);
        Ok(())
    }

    /// Whether pairs of bodies have a coefficient of their own.
    pub fn has_pair_friction(&self) -> bool {
        !self.pair_friction.is_empty()
    }
}
