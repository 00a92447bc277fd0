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
    /// Those that the foreseen motion leaves nearer than a share of these ways, m, by which free bodies
    /// may differ from it.
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
pub struct Far {
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

impl Far {
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
