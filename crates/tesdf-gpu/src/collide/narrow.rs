//! Narrow phase: Node-TES, Face-TES or the exact minimum.
use tesdf::collide::{FaceOptions, Mode};

use super::pass::{GROUP, Parts, Pass, parts};
use super::stages::launch;
use super::{Counting, Exchange, Lanes};
use crate::GpuError;
use crate::device::Buffer;
use crate::kernels::counters::{CONTACTS, POLYGONS};
use crate::kernels::narrow::cones::contact;
use crate::kernels::narrow::exact::AskedExactLaunch;
use crate::kernels::narrow::exchange::{LANES, Variant};
use crate::kernels::narrow::faces::AskedLaunch;
use crate::kernels::narrow::{exact, exact_faces, faces, nodes};

impl Pass<'_> {
    pub(super) fn narrow(&mut self) -> Result<(), GpuError> {
        match self.options.mode {
            Mode::Node => self.narrow_nodes(),
            Mode::Face { iterations, .. } => self.narrow_faces(iterations),
            Mode::Exact(_) => self.narrow_exact(),
        }
    }

    /// Gives contacts of faces the normals that both bodies allow.
    pub(super) fn in_cones(&mut self) -> Result<(), GpuError> {
        let per_contact = self.groups_for(self.detector.buffers.room.contacts, GROUP, CONTACTS)?;
        let tolerances = self.tolerances()?;
        let (shapes, buffers) = (&self.detector.shapes, &self.detector.buffers);
        let (pairs, counters, contacts) = (buffers.ordered_pairs(), self.counters(), buffers.contacts());
        let fans = shapes.fans();
        launch!(
            self.stages,
            "normals",
            per_contact,
            GROUP,
            contact::in_cones(shapes.argument(), fans, pairs, tolerances.words(), counters, contacts)
        )
    }

    fn narrow_nodes(&mut self) -> Result<(), GpuError> {
        let (shapes, buffers) = (&self.detector.shapes, &self.detector.buffers);
        let per_node = self.groups_for(buffers.room.polygons, GROUP, POLYGONS)?;
        let (pairs, items, contacts) = (buffers.ordered_pairs(), buffers.items(), buffers.contacts());
        let counters = self.counters();
        launch!(
            self.stages,
            "node narrow phase",
            per_node,
            GROUP,
            nodes::narrow_nodes(shapes.argument(), pairs, items, counters, contacts)
        )
    }

    /// The options of the faces; nodes have none, and use none.
    fn face_options(&self) -> FaceOptions {
        self.options.mode.faces().copied().unwrap_or_default()
    }

    /// Threshold of the cosine filter. Without the filter it is −2, which keeps every contact.
    fn cos_theta(&self) -> f32 {
        self.face_options().cos_theta.map_or(-2.0, |cos| cos as f32)
    }

    /// The tolerances of all instances on the device, which are uploaded once for a pass.
    fn tolerances(&mut self) -> Result<Buffer, GpuError> {
        if let Some(uploaded) = &self.tolerances {
            return Ok(uploaded.clone());
        }
        let tolerances = self.detector.tolerances(self.instances, self.face_options().tolerance);
        let tolerances = self.detector.device.upload("tolerances", &tolerances)?;
        self.sent += tolerances.bytes();
        Ok(self.tolerances.insert(tolerances).clone())
    }

    fn narrow_faces(&mut self, iterations: u32) -> Result<(), GpuError> {
        let (shapes, buffers, with) = (&self.detector.shapes, &self.detector.buffers, &self.detector.options);
        let (per, lanes) = match with.lanes {
            Lanes::Single => (LANES, 1),
            Lanes::Group => (1, LANES),
        };
        let variant = Variant {
            lanes,
            subgroups: with.exchange == Exchange::Device && self.detector.device.has_subgroups_of_32(),
            counting: with.counting == Counting::Operations,
        };
        let per_polygon = self.groups_for(buffers.room.polygons, per, POLYGONS)?;
        let (pairs, counters, contacts) = (buffers.ordered_pairs(), self.counters(), buffers.contacts());
        let asked = AskedLaunch::new(iterations, self.cos_theta());
        let polygons = buffers.polygons();
        launch!(
            self.stages,
            "face narrow phase",
            per_polygon,
            LANES,
            faces::narrow_faces(shapes.argument(), pairs, polygons, counters, contacts, asked, variant)
        )
    }

    fn narrow_exact(&mut self) -> Result<(), GpuError> {
        let (shapes, buffers) = (&self.detector.shapes, &self.detector.buffers);
        let per_polygon = self.groups_for(buffers.room.polygons, 1, POLYGONS)?;
        let tolerances = self.tolerances()?;
        let (pairs, counters, contacts) = (buffers.ordered_pairs(), self.counters(), buffers.contacts());
        let asked = AskedExactLaunch::new(tolerances.words(), self.cos_theta());
        let counting = self.detector.options.counting == Counting::Operations;
        if parts(self.options) == Parts::Faces {
            let faces = buffers.whole_faces();
            return launch!(
                self.stages,
                "exact narrow phase",
                per_polygon,
                LANES,
                exact_faces::narrow_exact_faces(
                    shapes.argument(),
                    pairs,
                    faces,
                    counters,
                    contacts,
                    asked,
                    counting
                )
            );
        }
        let polygons = buffers.polygons();
        launch!(
            self.stages,
            "exact narrow phase",
            per_polygon,
            LANES,
            exact::narrow_exact(shapes.argument(), pairs, polygons, counters, contacts, asked, counting)
        )
    }
}
