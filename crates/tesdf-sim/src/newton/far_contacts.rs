//! The contacts of a detection that nothing brings near in a step: they have no rows. Of the
//! contacts of a nut on its bolt, a fifth can act.
use glam::DVec3;
use nalgebra::Vector6;

use super::integrate::unpack;
use super::rows::Center;

/// A contact may act when its gap is at most this share of the way that its bodies may differ from
/// what is foreseen.
const NEAR: f64 = 0.02;

/// A far contact has closed when its gap is below this, m.
const CLOSED: f64 = 1e-10;

/// Which contacts get rows.
#[derive(Clone, Copy, Debug)]
pub enum Reach<'a> {
    /// All of them.
    All,
    /// Those that the foreseen motion leaves nearer than a share of these ways, m, by which free
    /// bodies may differ from it.
    Near(&'a [f64]),
}

impl Reach<'_> {
    /// The gap, m, up to which a contact between bodies with these centres gets a row.
    pub fn between(self, centers: &[Option<Center>; 2]) -> f64 {
        match self {
            Self::All => f64::INFINITY,
            Self::Near(ways) => NEAR * centers.iter().flatten().map(|center| ways[center.free]).sum::<f64>(),
        }
    }
}

/// The contacts without rows.
#[derive(Clone, Debug, Default)]
pub struct FarContacts {
    contacts: Vec<FarContact>,
    /// The centres of the bodies of each pair.
    pairs: Vec<[Option<Center>; 2]>,
}

#[derive(Clone, Copy, Debug)]
struct FarContact {
    /// Its gap at the end of the step when free bodies have no velocity, m.
    gap: f64,
    normal: DVec3,
    point: DVec3,
    pair: usize,
}

impl FarContacts {
    /// Adds a contact between bodies with these centres. The contacts of a pair come together.
    pub fn push(&mut self, gap: f64, normal: DVec3, point: DVec3, centers: &[Option<Center>; 2]) {
        if self.pairs.last() != Some(centers) {
            self.pairs.push(*centers);
        }
        self.contacts.push(FarContact { gap, normal, point, pair: self.pairs.len() - 1 });
    }

    /// Takes the way of these velocities, which led to the poses of the contacts, out of the gaps.
    pub fn extrapolate(&mut self, velocities: &[Vector6<f64>], h: f64) {
        let Self { contacts, pairs } = self;
        for contact in contacts {
            contact.gap -= h * contact.rate(&pairs[contact.pair], velocities);
        }
    }

    /// Whether these velocities close a contact.
    pub fn closes(&self, velocities: &[Vector6<f64>], h: f64) -> bool {
        let gap =
            |contact: &FarContact| contact.gap + h * contact.rate(&self.pairs[contact.pair], velocities);
        self.contacts.iter().any(|contact| gap(contact) < CLOSED)
    }
}

impl FarContact {
    /// Rate of change of the gap, m/s.
    fn rate(&self, centers: &[Option<Center>; 2], velocities: &[Vector6<f64>]) -> f64 {
        let of_point = |center: &Option<Center>| {
            center.map_or(DVec3::ZERO, |Center { free, place }| {
                let (linear, angular) = unpack(&velocities[free]);
                linear + angular.cross(self.point - place)
            })
        };
        self.normal.dot(of_point(&centers[0]) - of_point(&centers[1]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::newton::integrate::pack;

    const H: f64 = 5e-3;

    /// A contact 1 mm above a body that rises and turns, as seen from a body that stays.
    #[test]
    fn a_far_contact_closes_when_its_row_would() {
        let center = |free: usize, x: f64| Some(Center { free, place: DVec3::new(x, 0.0, 0.0) });
        let mut far = FarContacts::default();
        far.push(1e-3, DVec3::Z, DVec3::new(0.1, 0.0, 0.0), &[center(0, 0.0), center(1, 0.2)]);
        let velocities = |rise: f64, turn: f64| {
            [pack(DVec3::ZERO, DVec3::ZERO), pack(rise * DVec3::Z, DVec3::new(0.0, turn, 0.0))]
        };
        // The point is at -0.1 m of the turning body, so it rises by 0.1 m a rad.
        for (rise, turn, closes) in
            [(0.0, 0.0, false), (0.19, 0.0, false), (0.21, 0.0, true), (0.0, 1.9, false), (0.0, 2.1, true)]
        {
            assert_eq!(far.closes(&velocities(rise, turn), H), closes, "{rise} m/s, {turn} rad/s");
        }
        // Seen at the end of a motion, it was as much farther.
        far.extrapolate(&velocities(0.1, 0.0), H);
        assert!(!far.closes(&velocities(0.29, 0.0), H) && far.closes(&velocities(0.31, 0.0), H));
    }

    #[test]
    fn the_reach_follows_the_ways_of_both_bodies() {
        let center = |free| Some(Center { free, place: DVec3::ZERO });
        let near = Reach::Near(&[1e-3, 3e-3]);
        assert_eq!(near.between(&[center(0), None]), NEAR * 1e-3);
        assert_eq!(near.between(&[center(0), center(1)]), NEAR * 4e-3);
        assert_eq!(Reach::All.between(&[center(0), None]), f64::INFINITY);
    }
}
