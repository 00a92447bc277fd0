//! Going back: to what was kept of a moment, or to the beginning of a run.
use std::sync::Arc;

use tesdf::collide::Contacts;

use super::Newton;
use super::deep::Surfaces;
use super::kept::Kept;
use super::sleep::Sleep;
use crate::forces::Forces;
use crate::{DynamicsError, State, System};

/// All that the next steps of a [`Newton`] depend on: the states, what was set (motors, wrenches,
/// masses, friction, gravity), and what it remembers of the steps before.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Those of the engine, which it shares with its clones alone.
    surfaces: Arc<Surfaces>,
    system: System,
    found: Contacts,
    forces: Forces,
    sleep: Sleep,
    kept: Kept,
}

impl Newton {
    /// What [`restore`](Self::restore) needs to go back to this moment. Meshes are shared, not
    /// copied.
    pub fn snapshot(&self) -> Snapshot {
        let Self { surfaces, system, found, forces, sleep, kept, .. } = self;
        Snapshot {
            surfaces: Arc::clone(surfaces),
            system: system.clone(),
            found: found.clone(),
            forces: forces.clone(),
            sleep: sleep.clone(),
            kept: kept.clone(),
        }
    }

    /// Goes back to a snapshot of this engine or of a clone. The steps from there on have the same
    /// bytes as those after the snapshot.
    ///
    /// # Errors
    /// [`DynamicsError::OtherEngine`].
    pub fn restore(&mut self, snapshot: &Snapshot) -> Result<(), DynamicsError> {
        let Snapshot { surfaces, system, found, forces, sleep, kept } = snapshot;
        if !Arc::ptr_eq(surfaces, &self.surfaces) {
            return Err(DynamicsError::OtherEngine);
        }
        self.system.clone_from(system);
        self.found.clone_from(found);
        self.forces.clone_from(forces);
        self.sleep.clone_from(sleep);
        self.kept.clone_from(kept);
        Ok(())
    }

    /// Begins again with these states: steps have the same bytes as those of a new engine whose
    /// bodies have them. The angles of hinges are counted anew, wrenches are zero, and nothing is
    /// remembered of earlier steps. Motors, masses, friction and gravity stay.
    ///
    /// # Errors
    /// As [`System::reset`].
    pub fn reset(&mut self, states: Vec<State>) -> Result<(), DynamicsError> {
        self.system.reset(states)?;
        self.found = Contacts::default();
        self.forces = Forces::none(self.system.joints().len());
        self.sleep = Sleep::new(self.system.states());
        self.kept.restart();
        Ok(())
    }
}
