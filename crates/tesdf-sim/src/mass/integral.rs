//! Moments of a body, by its parts.
use std::iter::Sum;
use std::ops::Add;

use glam::{DMat3, DVec3};

use super::{MassError, MassProperties};

/// The integrals of 1, x and x xᵀ over a body of density 1, about a reference point.
#[derive(Clone, Copy, Debug)]
pub struct Integral {
    pub volume: f64,
    pub first: DVec3,
    pub second: DMat3,
}

impl Integral {
    const ZERO: Self = Self { volume: 0.0, first: DVec3::ZERO, second: DMat3::ZERO };

    /// Those of a part about the reference point, from its centre and its own second moment about
    /// that.
    pub fn of_part(volume: f64, center: DVec3, own: DMat3) -> Self {
        Self { volume, first: volume * center, second: own + volume * square(center) }
    }

    /// The mass properties, where the reference point is at `middle`.
    pub fn about(self, middle: DVec3) -> Result<MassProperties, MassError> {
        let Self { volume, first, second } = self;
        if !(volume > 0.0 && volume.is_finite()) {
            return Err(MassError::NoVolume { volume });
        }
        let arm = first / volume;
        let second = second - volume * square(arm);
        let trace = second.x_axis.x + second.y_axis.y + second.z_axis.z;
        Ok(MassProperties {
            mass: volume,
            center: middle + arm,
            inertia: DMat3::from_diagonal(DVec3::splat(trace)) - second,
        })
    }
}

impl Sum for Integral {
    fn sum<I: Iterator<Item = Self>>(parts: I) -> Self {
        parts.fold(Self::ZERO, Add::add)
    }
}

impl Add for Integral {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            volume: self.volume + other.volume,
            first: self.first + other.first,
            second: self.second + other.second,
        }
    }
}

/// a aᵀ.
pub fn square(a: DVec3) -> DMat3 {
    DMat3::from_cols(a * a.x, a * a.y, a * a.z)
}
