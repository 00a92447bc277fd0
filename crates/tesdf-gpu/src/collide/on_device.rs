//! Contacts that stay on the device, for a physics engine on the same device. Poses may come from an
//! array there, too.
use glam::{DQuat, DVec3, Vec3};
use tesdf::collide::internal::Ahead;
use tesdf::collide::{
    CollideError, CollideOptions, HiddenOverlap, Instance, InstanceId, Pose, Reduction, Scene, Shape,
    Velocity,
};

use super::contacts::contacts;
use super::on_processor::{has_undetected, with_pairs_on_device};
use super::pass::{GROUP, Normals, Parts, Pass, parts};
use super::scene::instances::Instances;
use super::scene::placed::Placed;
use super::stages::{Stages, Timing, launch};
use super::{Detector, possible, wants_minima};
use crate::GpuError;
use crate::device::{Buffer, Device, DeviceArray, spread};
use crate::kernels::broad::place::{self, GivenLaunch, POSE, UNIT_LENGTH, VELOCITY};
use crate::kernels::field::nearest::FAR;
use crate::kernels::narrow::sorted;
use crate::kernels::narrow::world::{self, WorldContactsLaunch};

/// Poses and velocities of all instances of a scene, on the device. Row *i* is that of the *i*-th
/// instance in the order of ids.
#[derive(Clone, Copy)]
pub struct GivenPoses<'a> {
    /// `[N, 7]`: x y z of the translation in the world's unit, and the unit quaternion qx qy qz qw,
    /// whose length may be off by 1e-5.
    pub poses: &'a DeviceArray<f32>,
    /// `[N, 6]`: velocity of the instance's origin, and angular velocity in radians, both in the
    /// world frame. `None`: all are at rest. Only the [speculative
    /// time](CollideOptions::speculative_time) uses it.
    pub velocities: Option<&'a DeviceArray<f32>>,
}

/// Contacts on the device, in the world's frame and unit, in the order of
/// [`detect`](Detector::detect) by world, pair of instances, and order of the pair. Faces have the
/// order of the asset there.
#[derive(Clone)]
pub struct DeviceContacts {
    /// Number of contacts, *N*.
    pub count: usize,
    /// `[N, 3]`: witness points on the surface of the first instance.
    pub points_a: DeviceArray<f32>,
    /// `[N, 3]`: the points of the second instance's surface that are closest to these.
    pub points_b: DeviceArray<f32>,
    /// `[N, 3]`: unit normals, from the second instance to the first: those that
    /// [`detect`](Detector::detect) gives. A contact of faces has one that both bodies allow; the
    /// others, and those of bodies whose vertices have moved, have the gradient of the signed
    /// distance of the second instance.
    pub normals: DeviceArray<f32>,
    /// `[N]`: signed distances.
    pub distances: DeviceArray<f32>,
    /// `[N, 2]`: ids of the instance of the surface and of that of the field.
    pub instances: DeviceArray<u32>,
    /// Pairs that overlap without a contact that shows it.
    pub hidden: Vec<HiddenOverlap>,
}

impl DeviceContacts {
    fn empty(device: &Device, count: usize) -> Result<Self, GpuError> {
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

    fn argument(&self) -> WorldContactsLaunch {
        WorldContactsLaunch::new(
            self.points_a.buffer().words(),
            self.points_b.buffer().words(),
            self.normals.buffer().words(),
            self.distances.buffer().words(),
            self.instances.buffer().words(),
        )
    }
}

impl GivenPoses<'_> {
    /// Checks the lengths of the arrays for this number of instances.
    fn check(&self, instances: usize) -> Result<(), GpuError> {
        let check = |array, found: usize, each: u32| {
            let expected = instances * each as usize;
            let text = || format!("{expected}: {each} for each of {instances} instances");
            if found == expected { Ok(()) } else { Err(GpuError::Length { array, found, expected: text() }) }
        };
        check("poses", self.poses.len(), POSE)?;
        self.velocities.map_or(Ok(()), |velocities| check("velocities", velocities.len(), VELOCITY))
    }

    /// The rows of the arrays.
    fn rows(&self, device: &Device) -> Result<Vec<GivenRow>, GpuError> {
        let poses = self.poses.read(device)?;
        let velocities = self.velocities.map(|all| all.read(device)).transpose()?.unwrap_or_default();
        let mut velocities = velocities.as_chunks().0.iter();
        let row =
            |pose: &[f32; POSE as usize]| GivenRow { pose: *pose, velocity: velocities.next().copied() };
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
    fn placed(&self, device: &Device, scene: &Scene) -> Result<Scene, GpuError> {
        let rows = self.rows(device)?;
        let place = |((id, instance), row): ((InstanceId, &Instance), &GivenRow)| {
            row.check(id)?;
            Ok((id, Instance { pose: row.pose(), velocity: row.velocity(), ..*instance }))
        };
        let updates = scene.instances().zip(&rows).map(place).collect::<Result<Vec<_>, GpuError>>()?;
        let mut placed = scene.clone();
        placed.update(&updates)?;
        Ok(placed)
    }
}

/// A row of [`GivenPoses`].
struct GivenRow {
    pose: [f32; POSE as usize],
    velocity: Option<[f32; VELOCITY as usize]>,
}

impl GivenRow {
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

impl Pass<'_> {
    /// Writes the poses and motions of all instances from the arrays.
    pub(super) fn place(&mut self, given: &GivenPoses<'_>) -> Result<(), GpuError> {
        let (device, all) = (&self.detector.device, self.instances);
        let fixed = device.upload("frames of instances", &all.fixed)?;
        let rows = device.upload("rows of instances", &all.ranks())?;
        self.sent += fixed.bytes() + rows.bytes();
        let count = all.ids.len() as u32;
        let velocities = given.velocities.unwrap_or(given.poses);
        let argument = GivenLaunch::new(
            given.poses.buffer().words(),
            velocities.buffer().words(),
            fixed.rows(),
            rows.words(),
            count,
            u32::from(given.velocities.is_some()),
            self.options.speculative_time as f32,
        );
        let (counters, placed) = (self.counters(), self.placed.clone());
        launch!(
            self.stages,
            "poses",
            spread(count.div_ceil(GROUP)),
            GROUP,
            place::place(argument, counters, placed.rows())
        )
    }
}

/// [`FIXED_ROWS`](place::FIXED_ROWS) rows for each instance: what its motion does not change.
///
/// # Errors
/// An instance is missing.
pub fn fixed_rows(scene: &Scene, instances: &Instances) -> Result<Vec<[f32; 4]>, CollideError> {
    let of_each = |(&id, at): (&InstanceId, &Placed)| {
        let instance = scene.instance(id)?;
        let reach = Ahead::new(instance, scene.shape(instance.shape)?, 0.0).reach;
        let origin = instance.pose.to_body(at.origin);
        Ok([origin.extend(at.unit).as_vec4().to_array(), [reach.min(FAR.into()) as f32, 0.0, 0.0, 0.0]])
    };
    let rows = instances.ids.iter().zip(&instances.placed).map(of_each);
    Ok(rows.collect::<Result<Vec<_>, CollideError>>()?.into_flattened())
}

impl Detector {
    /// Finds contacts as [`detect`](Self::detect), and leaves them on the device. With `given`
    /// poses, the instances of the scene are there instead of at their own poses. Only counters are
    /// read back. The arrays are complete when the call returns, so every stream may read them.
    ///
    /// Where a scene has shapes whose contacts the processor finds (see [`detect`](Self::detect)),
    /// poses and contacts are copied to it and back.
    ///
    /// Everything is rounded to `f32`, points and poses of the world too. The same input gives the
    /// same bytes on the same device.
    ///
    /// # Errors
    /// The errors of [`detect`](Self::detect), and
    /// - [`GpuError::Length`] when an array does not have a row for each instance;
    /// - [`GpuError::Instance`] for a pose that is none, or a velocity that is not finite;
    /// - [`GpuError::Unavailable`] for what only the processor does: contacts per minimum, and
    ///   one contact of all faces at a vertex.
    pub fn detect_on_device(
        &mut self,
        scene: &Scene,
        given: Option<&GivenPoses<'_>>,
        options: &CollideOptions,
    ) -> Result<DeviceContacts, GpuError> {
        let options = &possible(options)?;
        let reduces = matches!(options.reduction, Reduction::PerPair(_));
        let of_processor = if wants_minima(options) {
            Some(("contacts per minimum", "ask for contacts per cell, or reduced contacts per face"))
        } else if parts(options) == Parts::Faces && !reduces {
            Some((
                "one contact of all faces at a vertex",
                "reduce the contacts, or ask for contacts per cell",
            ))
        } else {
            None
        };
        if let Some((what, instead)) = of_processor {
            return Err(GpuError::Unavailable { what: format!("leaving {what} there"), instead });
        }
        if let Some(given) = given {
            given.check(scene.instances().len())?;
        }
        let placed;
        let (scene, given) = match given {
            // The processor needs them.
            Some(given) if has_undetected(scene) => {
                placed = given.placed(&self.device, scene)?;
                (&placed, None)
            }
            given => (scene, given),
        };
        let (divided, pairs) = self.divide(scene, options)?;
        let found = self.leave(&divided.on_device, given, options)?;
        self.report.pairs_on_processor = pairs.len();
        with_pairs_on_device(found, &pairs, scene, options, &self.device)
    }

    /// Finds the contacts of a scene without instances that only the processor detects.
    fn leave(
        &mut self,
        scene: &Scene,
        given: Option<&GivenPoses<'_>>,
        options: &CollideOptions,
    ) -> Result<DeviceContacts, GpuError> {
        let normals = if self.has_cones(options) { Normals::InCones } else { Normals::Gradients };
        let (instances, placed) = self.passes(scene, given, options, normals, Timing::Off)?;
        let found = self.in_world(&instances, &placed, options)?;
        let hidden = self.overlaps(&instances)?;
        if hidden.is_empty() {
            self.device.wait()?;
            return Ok(found);
        }
        // Whether contacts show an overlap depends on their distances alone.
        let shapes: Vec<&Shape> =
            self.shape_ids.iter().map(|&id| scene.shape(id)).collect::<Result<_, CollideError>>()?;
        let (words, rows) = self.read_contacts(options)?;
        let (shown, _) = contacts(&shapes, &instances, options.mode, &words, &rows);
        Ok(DeviceContacts { hidden: HiddenOverlap::not_shown(hidden, &shown), ..found })
    }

    /// Sorts the contacts of the last pass, and transforms them to the world.
    fn in_world(
        &mut self,
        instances: &Instances,
        placed: &Buffer,
        options: &CollideOptions,
    ) -> Result<DeviceContacts, GpuError> {
        let device = self.device.clone();
        let ids: Vec<u32> = instances.ids.iter().map(|id| id.0).collect();
        let ids = device.upload("ids of instances", &ids)?;
        self.report.sent += ids.bytes();
        let kept = self.kept(options);
        let (contacts, count) = (|| kept.argument(), kept.count);
        let found = DeviceContacts::empty(&device, count as usize)?;
        if count == 0 {
            return Ok(found);
        }
        let bytes = count as usize * size_of::<u32>();
        let mut order = device.empty("order of contacts", bytes)?;
        let mut merged = device.empty("merged order of contacts", bytes)?;
        let groups = || spread(count.div_ceil(GROUP));
        let mut stages = Stages::new(&device, Timing::Off);
        launch!(stages, "order", groups(), GROUP, sorted::begin(order.words(), count))?;
        let mut run = 1u32;
        while run < count {
            let (from, to) = (order.words(), merged.words());
            launch!(stages, "order", groups(), GROUP, sorted::merge(contacts(), from, to, count, run))?;
            std::mem::swap(&mut order, &mut merged);
            run = run.saturating_mul(2);
        }
        let (poses, ids, out) = (placed.rows(), ids.words(), found.argument());
        launch!(
            stages,
            "contacts in the world",
            groups(),
            GROUP,
            world::to_world(contacts(), order.words(), poses, ids, out, count)
        )?;
        self.report.launches += stages.launches;
        Ok(found)
    }
}
