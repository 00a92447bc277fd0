//! Narrow phase: Node-TES, Face-TES or the exact minimum.
use tesdf::collide::{FaceOptions, Mode};

use super::pass::{GROUP, Parts, Pass, parts};
use super::stages::launch;
use super::{Counting, Exchange, Lanes};
use crate::GpuError;
use crate::device::Buffer;
use crate::kernels::cones::contact;
use crate::kernels::counters::{CONTACTS, POLYGONS};
use crate::kernels::narrow::exact::AskedExactLaunch;
use crate::kernels::narrow::exchange::{LANES, Variant};
use crate::kernels::narrow::frank_wolfe::AskedLaunch;
use crate::kernels::narrow::{exact, exact_faces, frank_wolfe, nodes};

impl Pass<'_> {
    pub(super) fn narrow(&self) -> Result<(), GpuError> {
        match self.options.mode {
            Mode::Node => self.narrow_nodes(),
            Mode::Face { iterations, .. } => self.narrow_faces(iterations),
            Mode::Exact(_) => self.narrow_exact(),
        }
    }

    /// Gives contacts of faces the normals that both bodies allow.
    pub(super) fn in_cones(&self) -> Result<(), GpuError> {
        let buffers = self.buffers();
        let per_contact = self.groups_for(buffers.room.contacts, GROUP, CONTACTS)?;
        let (tolerances, fans) = (self.tolerances()?, self.detector.shapes.fans());
        let (pairs, counters, contacts) = (buffers.ordered_pairs(), self.counters(), buffers.contacts());
        launch!(
            self.stages,
            "normals",
            per_contact,
            GROUP,
            contact::in_cones(self.shapes(), fans, pairs, tolerances.words(), counters, contacts)
        )
    }

    fn narrow_nodes(&self) -> Result<(), GpuError> {
        let buffers = self.buffers();
        let per_node = self.groups_for(buffers.room.polygons, GROUP, POLYGONS)?;
        let (pairs, items, contacts) = (buffers.ordered_pairs(), buffers.items(), buffers.contacts());
        launch!(
            self.stages,
            "node narrow phase",
            per_node,
            GROUP,
            nodes::narrow_nodes(self.shapes(), pairs, items, self.counters(), contacts)
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
    fn tolerances(&self) -> Result<Buffer, GpuError> {
        if let Some(uploaded) = self.tolerances.get() {
            return Ok(uploaded.clone());
        }
        let tolerances = self.detector.tolerances(self.instances, self.face_options().tolerance);
        let uploaded = self.upload("tolerances", &tolerances)?;
        Ok(self.tolerances.get_or_init(|| uploaded).clone())
    }

    fn narrow_faces(&self, iterations: u32) -> Result<(), GpuError> {
        let (buffers, with) = (self.buffers(), &self.detector.options);
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
        let (pairs, polygons, contacts) = (buffers.ordered_pairs(), buffers.polygons(), buffers.contacts());
        let asked = AskedLaunch::new(iterations, self.cos_theta());
        let counters = self.counters();
        launch!(
            self.stages,
            "face narrow phase",
            per_polygon,
            LANES,
            frank_wolfe::narrow_faces(self.shapes(), pairs, polygons, counters, contacts, asked, variant)
        )
    }

    fn narrow_exact(&self) -> Result<(), GpuError> {
        let (buffers, shapes, counters) = (self.buffers(), self.shapes(), self.counters());
        let per_polygon = self.groups_for(buffers.room.polygons, 1, POLYGONS)?;
        let tolerances = self.tolerances()?;
        let (pairs, contacts) = (buffers.ordered_pairs(), buffers.contacts());
        let asked = AskedExactLaunch::new(tolerances.words(), self.cos_theta());
        let counting = self.detector.options.counting == Counting::Operations;
        if parts(self.options) == Parts::Faces {
            let faces = buffers.whole_faces();
            return launch!(
                self.stages,
                "exact narrow phase",
                per_polygon,
                LANES,
                exact_faces::narrow_exact_faces(shapes, pairs, faces, counters, contacts, asked, counting)
            );
        }
        let polygons = buffers.polygons();
        launch!(
            self.stages,
            "exact narrow phase",
            per_polygon,
            LANES,
            exact::narrow_exact(shapes, pairs, polygons, counters, contacts, asked, counting)
        )
    }
}
