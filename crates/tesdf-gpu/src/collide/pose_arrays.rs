//! Poses of instances that are in an array on the device.
use glam::{DQuat, DVec3, Vec3};
use tesdf::collide::{Instance, InstanceId, Pose, Scene, Velocity};

use super::scene::instances::Instances;
use crate::GpuError;
use crate::device::{Device, DeviceArray};
use crate::kernels::scene::pose_arrays::{POSE, UNIT_LENGTH, VELOCITY};

/// Poses and velocities of all instances of a scene, on the device. Row *i* is that of the *i*-th
/// instance in the order of ids.
#[derive(Clone, Copy)]
pub struct PoseArrays<'a> {
    /// `[N, 7]`: x y z of the translation in the world's unit, and the unit quaternion qx qy qz qw,
    /// whose length may be off by 1e-5.
    pub poses: &'a DeviceArray<f32>,
    /// `[N, 6]`: velocity of the instance's origin, and angular velocity in radians, both in the
    /// world frame. `None`: all are at rest. Only the [speculative
    /// time](tesdf::CollideOptions::speculative_time) uses it.
    pub velocities: Option<&'a DeviceArray<f32>>,
}

impl PoseArrays<'_> {
    /// Checks the lengths of the arrays for this number of instances.
    pub(super) fn check(&self, instances: usize) -> Result<(), GpuError> {
        let check = |array, found: usize, each: u32| {
            let expected = instances * each as usize;
            let text = || format!("{expected}: {each} for each of {instances} instances");
            if found == expected { Ok(()) } else { Err(GpuError::Length { array, found, expected: text() }) }
        };
        check("poses", self.poses.len(), POSE)?;
        self.velocities.map_or(Ok(()), |velocities| check("velocities", velocities.len(), VELOCITY))
    }

    /// The rows of the arrays.
    fn rows(&self, device: &Device) -> Result<Vec<PoseRow>, GpuError> {
        let poses = self.poses.read(device)?;
        let velocities = self.velocities.map(|all| all.read(device)).transpose()?.unwrap_or_default();
        let mut velocities = velocities.as_chunks().0.iter();
        let row = |pose: &[f32; POSE as usize]| PoseRow { pose: *pose, velocity: velocities.next().copied() };
        Ok(poses.as_chunks().0.iter().map(row).collect())
    }

    /// The error of the first instance with a pose or velocity that is none.
    pub(super) fn first_bad(&self, device: &Device, instances: &Instances) -> Result<GpuError, GpuError> {
        let mut ids = instances.ids.clone();
        ids.sort_unstable();
        let rows = self.rows(device)?;
        let bad = ids.iter().zip(&rows).find_map(|(id, row)| row.check(*id).err());
        // The kernel's numbers may be rounded otherwise.
        Ok(bad.unwrap_or_else(|| GpuError::Instance {
            instance: ids.first().map_or(0, |id| id.0 as usize),
            reason: "an array has a pose that is none; normalise the quaternions".into(),
        }))
    }

    /// A scene with its instances where the arrays have them.
    pub(super) fn placed(&self, device: &Device, scene: &Scene) -> Result<Scene, GpuError> {
        let rows = self.rows(device)?;
        let place = |((id, instance), row): ((InstanceId, &Instance), &PoseRow)| {
            row.check(id)?;
            Ok((id, Instance { pose: row.pose(), velocity: row.velocity(), ..*instance }))
        };
        let updates = scene.instances().zip(&rows).map(place).collect::<Result<Vec<_>, GpuError>>()?;
        let mut placed = scene.clone();
        placed.update(&updates)?;
        Ok(placed)
    }
}

/// A row of [`PoseArrays`].
struct PoseRow {
    pose: [f32; POSE as usize],
    velocity: Option<[f32; VELOCITY as usize]>,
}

impl PoseRow {
    fn check(&self, id: InstanceId) -> Result<(), GpuError> {
        let Self { pose, velocity } = self;
        let velocity = velocity.as_ref().map_or(&[][..], |v| v);
        let length = Vec3::from_slice(&pose[3..6]).extend(pose[6]).length();
        let is_pose = pose[..3].iter().all(|x| x.is_finite()) && (length - 1.0).abs() <= UNIT_LENGTH;
        if is_pose && velocity.iter().all(|x| x.is_finite()) {
            return Ok(());
        }
        Err(GpuError::Instance {
            instance: id.0 as usize,
            reason: format!(
                "the arrays place it at {pose:?} with the velocity {velocity:?}; expected finite numbers, and a \
                 quaternion of length 1, up to {UNIT_LENGTH:e}"
            ),
        })
    }

    fn pose(&self) -> Pose {
        let [x, y, z, qx, qy, qz, qw] = self.pose.map(f64::from);
        Pose { translation: DVec3::new(x, y, z), rotation: DQuat::from_xyzw(qx, qy, qz, qw).normalize() }
    }

    fn velocity(&self) -> Velocity {
        let [x, y, z, a, b, c] = self.velocity.unwrap_or_default().map(f64::from);
        Velocity { linear: DVec3::new(x, y, z), angular: DVec3::new(a, b, c) }
    }
}
