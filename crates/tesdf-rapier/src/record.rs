//! The contacts that the dispatcher found during a step, for the engine.
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tesdf::collide::{CollideError, Contact};

/// Results of the dispatcher since the record was last cleared. The dispatcher and the engine share
/// it.
#[derive(Clone, Debug, Default)]
pub struct Record(Arc<Mutex<Found>>);

#[derive(Debug, Default)]
pub struct Found {
    /// Contacts in the frame of the first shape of their pair, which is instance 0. The `user_data`
    /// of a manifold is the index of its contact.
    pub contacts: Vec<Contact>,
    /// The first error. The contacts of that pair are missing.
    pub error: Option<CollideError>,
    /// Wall time of the detection.
    pub time: Duration,
}

impl Record {
    pub fn lock(&self) -> MutexGuard<'_, Found> {
        // A panic leaves the record valid, because entries are pushed whole.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
