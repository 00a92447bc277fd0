//! `tesdf.PatchTracker`
use std::sync::{Mutex, PoisonError};

use pyo3::prelude::*;
use tesdf::Length;
use tesdf::collide::{self, Contact, ContactPatches, FeatureB, FeatureId, InstanceId, PatchOptions};
use tesdf::glam::DVec3;

use crate::contacts::{Column, Columns, NO_CELL};
use crate::errors::{Error, argument};
use crate::scene::Scene;

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
    fn new(py: Python<'_>, angle: f64, link: Option<f64>, points: usize) -> PyResult<Self> {
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

/// The contacts whose columns an object of `tesdf.Contacts` has.
pub fn contacts_of(of: &Bound<'_, PyAny>) -> PyResult<Vec<Contact>> {
    let vectors = |name| Column::<f64>::new(of, name);
    let ids = |name| Column::<u32>::new(of, name);
    let (point_a, point_b, normal) = (vectors("point_a")?, vectors("point_b")?, vectors("normal")?);
    let (face_a, face_b, tet_b) = (ids("face_a")?, ids("face_b")?, ids("tet_b")?);
    let (instance_a, instance_b) = (ids("instance_a")?, ids("instance_b")?);
    let (feature_a, feature_b) = (ids("feature_a")?, ids("feature_b")?);
    let (distance, kind) = (vectors("distance")?, Column::<u8>::new(of, "feature_b_kind")?);
    let converged = Column::<bool>::new(of, "converged")?;
    let (point_a, point_b, normal) = (point_a.rows::<3>()?, point_b.rows::<3>()?, normal.rows::<3>()?);
    let (face_a, face_b, tet_b) = (face_a.each()?, face_b.each()?, tet_b.each()?);
    let (instance_a, instance_b) = (instance_a.each()?, instance_b.each()?);
    let (feature_a, feature_b) = (feature_a.each()?, feature_b.rows::<2>()?);
    let (distance, kind, converged) = (distance.each()?, kind.each()?, converged.each()?);
    let lengths = [point_a.len(), point_b.len(), normal.len(), face_a.len(), face_b.len(), tet_b.len()];
    let more =
        [instance_a.len(), instance_b.len(), feature_a.len(), feature_b.len(), kind.len(), converged.len()];
    if lengths.iter().chain(&more).any(|&length| length != distance.len()) {
        return Err(argument("contacts", "arrays of different lengths", "a row for each contact"));
    }
    let contact = |i: usize| Contact {
        point_a: DVec3::from_array(point_a[i]),
        point_b: DVec3::from_array(point_b[i]),
        normal: DVec3::from_array(normal[i]),
        distance: distance[i],
        face_a: face_a[i],
        face_b: face_b[i],
        tet_b: Some(tet_b[i]).filter(|&cell| cell != NO_CELL),
        instance_a: InstanceId(instance_a[i]),
        instance_b: InstanceId(instance_b[i]),
        feature: FeatureId {
            a: feature_a[i],
            b: match (kind[i], feature_b[i]) {
                (0, [vertex, _]) => FeatureB::Vertex(vertex),
                (1, [low, high]) => FeatureB::Edge(low, high),
                (_, [face, _]) => FeatureB::Face(face),
            },
        },
        converged: converged[i],
    };
    Ok((0..distance.len()).map(contact).collect())
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
