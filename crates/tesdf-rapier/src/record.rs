//! What was detected during a step, for the engine.
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tesdf::collide::{CollideError, Contact};

/// What the dispatcher found since it was last cleared; shared by the dispatcher and the engine.
#[derive(Clone, Debug, Default)]
pub struct Record(Arc<Mutex<Found>>);

#[derive(Debug, Default)]
pub struct Found {
    /// In the frame of the first shape of their pair, which is instance 0; a manifold's `user_data` is the place of its contact.
    pub contacts: Vec<Contact>,
    /// The first error; contacts of that pair are missing.
    pub error: Option<CollideError>,
    /// Time spent on detection.
    pub time: Duration,
}

impl Record {
    pub fn lock(&self) -> MutexGuard<'_, Found> {
        // Nothing is left half done by a panic: entries are pushed whole.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
