//! `tesdf.PatchTracker`
use std::sync::{Mutex, PoisonError};

use pyo3::prelude::*;
use tesdf::Length;
use tesdf::collide::{self, ContactPatches, PatchOptions};

use crate::contacts::{Columns, contacts_of};
use crate::errors::Error;
use crate::scene::Scene;
use crate::whole;

/// Groups the contacts of each detection into patches: regions in which two bodies touch. Patches
/// and points keep their ids from detection to detection.
///
/// A patch has contacts of one pair of instances whose normals are similar and which are near each
/// other or share a face, and a few points that span it.
///
/// - angle: largest angle, in radians, between the normal of a contact and that of the deepest one
///   of its patch; 0 to pi/2.
/// - link: contacts up to this distance apart belong together, in the world's unit. None is 1/32 of
///   the diagonal of the smaller body.
/// - points: largest number of points of a patch.
#[pyclass(frozen, module = "tesdf")]
pub struct PatchTracker {
    inner: Mutex<collide::PatchTracker>,
}

#[pymethods]
impl PatchTracker {
    #[new]
    #[pyo3(signature = (*, angle = 30f64.to_radians(), link = None, points = 4), text_signature = "(*, angle=0.5235987755982988, link=None, points=4)")]
    fn new(
        py: Python<'_>,
        angle: f64,
        link: Option<f64>,
        #[pyo3(from_py_with = whole::points)] points: usize,
    ) -> PyResult<Self> {
        let link = link.map_or(PatchOptions::default().link, Length::Absolute);
        let tracker = collide::PatchTracker::new(PatchOptions { angle, link, points });
        Ok(Self { inner: Mutex::new(tracker.map_err(|e| Error::Collide(e).raise(py))?) })
    }

    /// The patches of the contacts of a detection: ContactPatches. The scene must have the poses of
    /// the detection.
    ///
    /// contacts: Contacts of Scene.detect, or the contacts of a Simulation with a scene of its
    /// bodies.
    ///
    /// Raises CollideError if the scene lacks an instance of a contact. The tracker is unchanged
    /// then.
    fn update<'py>(
        &self,
        scene: &Bound<'py, Scene>,
        contacts: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let py = scene.py();
        let (scene, contacts) = (scene.get().now(), contacts_of(contacts)?);
        let found =
            py.detach(|| self.inner.lock().unwrap_or_else(PoisonError::into_inner).update(&scene, &contacts));
        patches(py, contacts.len(), &found.map_err(|e| Error::Collide(e).raise(py))?)
    }
}

/// An object of `tesdf.ContactPatches`.
fn patches<'py>(py: Python<'py>, contacts: usize, found: &ContactPatches) -> PyResult<Bound<'py, PyAny>> {
    let of = || found.patches.iter();
    let mut patch_of_contact = vec![0u32; contacts];
    for (row, patch) in (0..).zip(of()) {
        patch.contacts.iter().for_each(|&contact| patch_of_contact[contact] = row);
    }
    let points =
        || (0u32..).zip(of()).flat_map(|(row, patch)| patch.points.iter().map(move |point| (row, point)));
    Columns::new(py)
        .add("id", of().map(|p| p.id))?
        .add("age", of().map(|p| p.age))?
        .add("instance_a", of().map(|p| p.instance_a.0))?
        .add("instance_b", of().map(|p| p.instance_b.0))?
        .add_rows("normal", of().map(|p| p.normal.to_array()))?
        .add("distance", of().map(|p| p.distance))?
        .add("area", of().map(|p| p.area))?
        .add_rows("center", of().map(|p| p.center.to_array()))?
        .add("patch_of_contact", patch_of_contact.into_iter())?
        .add("point_patch", points().map(|(row, _)| row))?
        .add("point_id", points().map(|(_, point)| point.id))?
        .add("point_contact", points().map(|(_, point)| point.contact as u64))?
        .add("ended", found.ended.iter().copied())?
        .build("ContactPatches")
}
