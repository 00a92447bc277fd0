//! Contacts that stay on the device.
use tesdf::collide::HiddenOverlap;

use crate::GpuError;
use crate::device::{Device, DeviceArray};
use crate::kernels::report::world_contacts::WorldContactsLaunch;

/// Contacts on the device, in the world's frame and unit, in the order of
/// [`detect`](super::Detector::detect) by world, pair of instances, and order of the pair. Faces
/// have the order of the asset there.
#[derive(Clone)]
pub struct DeviceContacts {
    /// Number of contacts, *N*.
    pub count: usize,
    /// `[N, 3]`: witness points on the surface of the first instance.
    pub points_a: DeviceArray<f32>,
    /// `[N, 3]`: the points of the second instance's surface that are closest to these.
    pub points_b: DeviceArray<f32>,
    /// `[N, 3]`: unit normals, from the second instance to the first: those that
    /// [`detect`](super::Detector::detect) gives. A contact of faces has one that both bodies
    /// allow; the others, and those of bodies whose vertices have moved, have the gradient of the
    /// signed distance of the second instance.
    pub normals: DeviceArray<f32>,
    /// `[N]`: signed distances.
    pub distances: DeviceArray<f32>,
    /// `[N, 2]`: ids of the instance of the surface and of that of the field.
    pub instances: DeviceArray<u32>,
    /// Pairs that overlap without a contact that shows it.
    pub hidden: Vec<HiddenOverlap>,
}

impl DeviceContacts {
    pub(super) fn empty(device: &Device, count: usize) -> Result<Self, GpuError> {
        Ok(Self {
            count,
            points_a: DeviceArray::empty(device, 3 * count)?,
            points_b: DeviceArray::empty(device, 3 * count)?,
            normals: DeviceArray::empty(device, 3 * count)?,
            distances: DeviceArray::empty(device, count)?,
            instances: DeviceArray::empty(device, 2 * count)?,
            hidden: Vec::new(),
        })
    }

    pub(super) fn argument(&self) -> WorldContactsLaunch {
        WorldContactsLaunch::new(
            self.points_a.buffer().words(),
            self.points_b.buffer().words(),
            self.normals.buffer().words(),
            self.distances.buffer().words(),
            self.instances.buffer().words(),
        )
    }
}
