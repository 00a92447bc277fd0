//! One pass: the launches of all stages.
use std::cell::{Cell, OnceCell};

use bytemuck::NoUninit;
use cubecl::prelude::*;
use tesdf::collide::{CollideOptions, ContactsPer};

use super::buffers::{PipelineBuffers, ROW, WORD};
use super::counts::Counts;
use super::pose_arrays::PoseArrays;
use super::scene::instances::Instances;
use super::stages::{Stages, Timing, launch};
use super::{Detector, Pruning};
use crate::GpuError;
use crate::device::Buffer;
use crate::kernels::bodies::clip;
use crate::kernels::counters::{self, COUNTERS, CountersLaunch};
use crate::kernels::pairs::instance_pairs::INSTANCE_ROWS;
use crate::kernels::scene::shape::ShapesLaunch;

pub use crate::kernels::GROUP;

/// Up to this number of bodies, several groups share the large faces of a meshlet.
const FEW_INSTANCES: usize = 512;

/// The parts of a surface that the narrow phase takes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Parts {
    Nodes,
    /// Faces clipped by cells.
    Polygons,
    Faces,
}

/// The parts of a surface that a detection takes.
pub fn parts(options: &CollideOptions) -> Parts {
    match options.mode.contacts_per() {
        None => Parts::Nodes,
        Some(ContactsPer::Cell) => Parts::Polygons,
        Some(ContactsPer::Face | ContactsPer::Minimum) => Parts::Faces,
    }
}

/// The normals of the contacts that a pass finds.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Normals {
    /// Gradients of the signed distance, from which the processor finds the others.
    Gradients,
    /// Of contacts of faces, those that both bodies allow.
    InCones,
}

/// The data that all launches of a pass share.
pub struct Pass<'a> {
    pub detector: &'a Detector,
    pub options: &'a CollideOptions,
    pub instances: &'a Instances,
    counters: Buffer,
    pub stages: Stages<'a>,
    /// Poses and motions of the instances.
    pub placed: Buffer,
    /// Tolerances of the instances, once a stage has needed them.
    pub tolerances: OnceCell<Buffer>,
    /// Bytes that were sent to the device.
    sent: Cell<usize>,
}

impl Detector {
    /// Launches all stages, and reads the counters. Returns them with the poses of the instances on
    /// the device.
    pub(super) fn pass(
        &mut self,
        instances: &Instances,
        given: Option<&PoseArrays<'_>>,
        options: &CollideOptions,
        normals: Normals,
        timing: Timing,
    ) -> Result<(Counts, Buffer), GpuError> {
        let device = self.device.clone();
        if parts(options) == Parts::Polygons {
            self.buffers.add_weights(&device)?;
        }
        if normals == Normals::InCones {
            self.shapes.add_fans()?;
        }
        let counters = device.upload("counters", &[0u32; COUNTERS])?;
        let placed = match given {
            None => device.upload("instances", &instances.rows)?,
            Some(_) => device.empty("instances", instances.ids.len() * INSTANCE_ROWS as usize * ROW)?,
        };
        let sent = counters.bytes() + if given.is_some() { 0 } else { placed.bytes() };
        let pass = Pass {
            detector: self,
            options,
            instances,
            sent: Cell::new(sent),
            counters: counters.clone(),
            placed: placed.clone(),
            tolerances: OnceCell::new(),
            stages: Stages::new(&device, timing),
        };
        if let Some(given) = given {
            pass.place(given)?;
        }
        pass.pairs()?;
        let slabs = pass.slabs();
        let per_meshlet =
            pass.groups_in_slabs(pass.detector.buffers.room.meshlets, 1, slabs, counters::MESHLETS)?;
        pass.bodies(&per_meshlet)?;
        pass.narrow()?;
        if normals == Normals::InCones {
            pass.in_cones()?;
        }
        pass.reduce()?;
        let Pass { sent, stages: Stages { launches, times, .. }, .. } = pass;
        self.report.sent += sent.into_inner();
        self.report.launches = launches.into_inner();
        self.report.stages = times.into_inner();
        let counts = Counts::read(&device, &counters)?;
        self.report.read += COUNTERS * WORD;
        self.check(&counts)?;
        if let Some(given) = given.filter(|_| counts.badly_placed > 0) {
            return Err(given.first_bad(&device, instances)?);
        }
        Ok((counts, placed))
    }

    /// Returns errors that only threads of the device detect.
    fn check(&self, counts: &Counts) -> Result<(), GpuError> {
        if counts.badly_moved > 0 {
            return Err(self.shapes.badly_moved()?);
        }
        if counts.broken_off > 0 {
            return Err(GpuError::Device {
                device: self.device.info().name.clone(),
                doing: "detecting contacts",
                reason: format!(
                    "the driver broke off the loops of {} threads, as Mesa's llvmpipe does after 65,535 iterations: a \
                     face meets too many cells, a contact is at too many faces, or a pair has too many contacts to \
                     reduce. Detect on the processor or on a GPU",
                    counts.broken_off
                ),
            });
        }
        Ok(())
    }
}

impl Pass<'_> {
    /// Uploads data of this pass.
    pub fn upload<T: NoUninit>(&self, name: &'static str, data: &[T]) -> Result<Buffer, GpuError> {
        let buffer = self.detector.device.upload(name, data)?;
        self.sent.set(self.sent.get() + buffer.bytes());
        Ok(buffer)
    }

    pub fn shapes(&self) -> ShapesLaunch {
        self.detector.shapes.argument()
    }

    pub fn buffers(&self) -> &PipelineBuffers {
        &self.detector.buffers
    }

    pub fn counters(&self) -> CountersLaunch {
        CountersLaunch::new(self.counters.words())
    }

    /// Number of groups for the next launch, with `per` elements per group. The device computes it
    /// from the elements that `counter` has counted, but at most `room`, the capacity of the
    /// buffer: see [`groups_for`](counters::groups_for).
    pub fn groups_for(&self, room: u32, per: u32, counter: u32) -> Result<CubeCount, GpuError> {
        self.groups_in_slabs(room, per, 1, counter)
    }

    /// The same groups `slabs` times in z. A stage that takes its element from the position among
    /// all groups finds elements in the first slab alone.
    fn groups_in_slabs(&self, room: u32, per: u32, slabs: u32, counter: u32) -> Result<CubeCount, GpuError> {
        let groups = &self.buffers().groups;
        launch!(
            self.stages,
            "groups",
            CubeCount::Static(1, 1, 1),
            1,
            counters::groups_for(self.counters(), groups.words(), room, per, slabs, counter)
        )?;
        Ok(groups.count())
    }

    /// Groups of threads per meshlet. With many bodies there are enough meshlets to occupy the
    /// device.
    fn slabs(&self) -> u32 {
        let few = self.instances.ids.len() <= FEW_INSTANCES;
        if few && parts(self.options) == Parts::Polygons { clip::GROUPS_PER_MESHLET } else { 1 }
    }

    /// 1 when least signed distances rule out meshlets, faces and cells, and otherwise 0.
    pub fn prune(&self) -> u32 {
        u32::from(self.detector.options.pruning == Pruning::LeastDistance)
    }
}
