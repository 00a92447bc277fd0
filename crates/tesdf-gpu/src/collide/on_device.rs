//! Contacts that stay on the device, for a physics engine on the same device. Poses may come from
//! an array there, too.
use tesdf::collide::internal::Ahead;
use tesdf::collide::{CollideError, CollideOptions, HiddenOverlap, InstanceId, Reduction, Scene, Shape};

use super::contacts::contacts;
use super::device_contacts::DeviceContacts;
use super::on_processor::{finds_all, has_undetected, with_pairs_on_device};
use super::pass::{GROUP, Normals, Parts, Pass, parts};
use super::pose_arrays::PoseArrays;
use super::scene::instances::Instances;
use super::scene::placed::Placed;
use super::stages::{Stages, Timing, launch};
use super::{Detector, DeviceReport, possible, wants_minima};
use crate::GpuError;
use crate::device::{Buffer, spread};
use crate::kernels::query::nearest::FAR;
use crate::kernels::report::order;
use crate::kernels::report::world_contacts;
use crate::kernels::scene::pose_arrays::{self, PoseArraysLaunch};

impl Pass<'_> {
    /// Writes the poses and motions of all instances from the arrays.
    pub(super) fn place(&self, given: &PoseArrays<'_>) -> Result<(), GpuError> {
        let all = self.instances;
        let fixed = self.upload("frames of instances", &all.fixed)?;
        let rows = self.upload("rows of instances", &all.ranks())?;
        let count = all.ids.len() as u32;
        let velocities = given.velocities.unwrap_or(given.poses);
        let argument = PoseArraysLaunch::new(
            given.poses.buffer().words(),
            velocities.buffer().words(),
            fixed.rows(),
            rows.words(),
            count,
            u32::from(given.velocities.is_some()),
            self.options.speculative_time as f32,
        );
        launch!(
            self.stages,
            "poses",
            spread(count.div_ceil(GROUP)),
            GROUP,
            pose_arrays::place(argument, self.counters(), self.placed.rows())
        )
    }
}

/// [`FIXED_ROWS`](pose_arrays::FIXED_ROWS) rows for each instance: what its motion does not change.
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
    /// Where the processor finds contacts (see [`detect`](Self::detect)), poses and contacts are
    /// copied to it and back.
    ///
    /// Everything is rounded to `f32`, points and poses of the world too. The same input gives the
    /// same bytes on the same device.
    ///
    /// # Errors
    /// The errors of [`detect`](Self::detect), and
    /// - [`GpuError::Length`] when an array does not have a row for each instance;
    /// - [`GpuError::Instance`] for a pose that is none, or a velocity that is not finite;
    /// - [`GpuError::Unavailable`] for what only the processor does with contacts of kernels:
    ///   contacts per minimum, and one contact of all faces at a vertex. So contacts per face, which
    ///   are the default, must be reduced.
    pub fn detect_on_device(
        &mut self,
        scene: &Scene,
        given: Option<&PoseArrays<'_>>,
        options: &CollideOptions,
    ) -> Result<DeviceContacts, GpuError> {
        let options = &possible(options)?;
        let reduces = matches!(options.reduction, Reduction::PerPair(_));
        let of_processor = if finds_all(options) {
            None
        } else if wants_minima(options) {
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
            Some(given) if has_undetected(scene) || finds_all(options) => {
                placed = given.placed(&self.device, scene)?;
                (&placed, None)
            }
            given => (scene, given),
        };
        let pairs = self.pairs_on_processor(scene, options)?;
        let found = if finds_all(options) {
            self.report = DeviceReport::default();
            DeviceContacts::empty(&self.device, 0)?
        } else {
            self.leave(scene, given, options)?
        };
        self.report.pairs_on_processor = pairs.len();
        with_pairs_on_device(found, &pairs, scene, options, &self.device)
    }

    /// Finds the contacts between instances whose shapes kernels detect.
    fn leave(
        &mut self,
        scene: &Scene,
        given: Option<&PoseArrays<'_>>,
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
        let stages = Stages::new(&device, Timing::Off);
        launch!(stages, "order", groups(), GROUP, order::begin(order.words(), count))?;
        let mut run = 1u32;
        while run < count {
            let (from, to) = (order.words(), merged.words());
            launch!(stages, "order", groups(), GROUP, order::merge(contacts(), from, to, count, run))?;
            std::mem::swap(&mut order, &mut merged);
            run = run.saturating_mul(2);
        }
        let (poses, ids, out) = (placed.rows(), ids.words(), found.argument());
        launch!(
            stages,
            "contacts in the world",
            groups(),
            GROUP,
            world_contacts::to_world(contacts(), order.words(), poses, ids, out, count)
        )?;
        self.report.launches += stages.launches.get();
        Ok(found)
    }
}
