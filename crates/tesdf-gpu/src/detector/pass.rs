//! One pass: the launches of all stages.
use cubecl::prelude::*;
use tesdf::collide::{CollideOptions, FaceMethod, Mode, Reduction};

use super::buffers::{Products, ROW, WORD};
use super::stages::{Stages, Timing};
use super::{Counting, Detector, Exchange, Lanes, Pruning, reduction};
use crate::GpuError;
use crate::device::spread;
use crate::instances::Instances;
use crate::kernels::{broad, clip, exact, narrow, outside, pairs, products};

impl Detector {
    /// Launches all stages, and reads the counters.
    pub(super) fn pass(
        &mut self,
        instances: &Instances,
        options: &CollideOptions,
        timing: Timing,
    ) -> Result<[u32; products::COUNTERS], GpuError> {
        let device = self.device.clone();
        let client = device.client();
        let rows = device.upload("instances", &instances.rows)?;
        let words = device.upload("words of instances", &instances.words)?;
        let excluded = device.upload("excluded pairs", &instances.excluded)?;
        let counters = device.upload("counters", &[0u32; products::COUNTERS])?;
        self.report.sent += rows.bytes() + words.bytes() + excluded.bytes() + counters.bytes();
        let Products {
            room,
            directions,
            maps,
            blocks,
            meshlets,
            polygons,
            weights,
            contact_words,
            contact_rows,
            groups,
            members,
        } = &self.products;
        let images = &self.images;
        let prune = u32::from(self.options.pruning == Pruning::LeastDistance);
        let mut stages = Stages::new(&device, timing);
        let count = instances.ids.len() as u32;
        let given = match &instances.pairs {
            Some(pairs) => Some((device.upload("pairs", pairs)?, pairs.len() as u32 / 2)),
            None => None,
        };
        let bounds = device.empty("bounds of instances", count as usize * pairs::BOUNDS_ROWS * ROW)?;
        stages.run("instance bounds", || {
            pairs::instance_bounds::launch(
                client,
                spread(count.div_ceil(64)),
                CubeDim::new_1d(64),
                images.argument(),
                rows.rows(),
                words.words(),
                counters.words(),
                bounds.rows(),
                count,
                options.contact_distance as f32,
            );
        })?;
        stages.run("instance pairs", || match &given {
            Some((pairs, count)) => pairs::given_pairs::launch(
                client,
                spread(count.div_ceil(64)),
                CubeDim::new_1d(64),
                images.argument(),
                rows.rows(),
                words.words(),
                pairs.words(),
                counters.words(),
                directions.words(),
                maps.rows(),
                blocks.words(),
                *count,
                options.contact_distance as f32,
                room.directions,
                room.blocks,
            ),
            None => pairs::instance_pairs::launch(
                client,
                spread(count.div_ceil(64)),
                CubeDim::new_1d(64),
                images.argument(),
                rows.rows(),
                bounds.rows(),
                words.words(),
                excluded.words(),
                counters.words(),
                directions.words(),
                maps.rows(),
                blocks.words(),
                count,
                instances.excluded.len() as u32 / 2,
                options.contact_distance as f32,
                room.directions,
                room.blocks,
            ),
        })?;
        let groups_for = |stages: &mut Stages, most: u32, per: u32, product: u32| {
            stages.run("groups", || {
                products::groups_for::launch(
                    client,
                    CubeCount::Static(1, 1, 1),
                    CubeDim::new_1d(1),
                    counters.words(),
                    groups.words(),
                    most,
                    per,
                    product,
                );
            })?;
            Ok::<_, GpuError>(groups.count())
        };
        let per_block = groups_for(&mut stages, room.blocks, 1, products::BLOCKS)?;
        stages.run("meshlets", || {
            broad::meshlets::launch(
                client,
                per_block,
                CubeDim::new_1d(narrow::LANES),
                images.argument(),
                directions.words(),
                maps.rows(),
                blocks.words(),
                counters.words(),
                meshlets.words(),
                room.blocks,
                room.meshlets,
                prune,
            );
        })?;
        let per_meshlet = groups_for(&mut stages, room.meshlets, 1, products::MESHLETS)?;
        match options.mode {
            Mode::Node => {
                stages.run("nodes", || {
                    clip::nodes::launch(
                        client,
                        per_meshlet,
                        CubeDim::new_1d(narrow::LANES),
                        images.argument(),
                        directions.words(),
                        maps.rows(),
                        meshlets.words(),
                        counters.words(),
                        polygons.words(),
                        room.meshlets,
                        room.polygons,
                        prune,
                    );
                })?;
                let per_node = groups_for(&mut stages, room.polygons, 64, products::POLYGONS)?;
                stages.run("node narrow phase", || {
                    narrow::narrow_nodes::launch(
                        client,
                        per_node,
                        CubeDim::new_1d(64),
                        images.argument(),
                        directions.words(),
                        maps.rows(),
                        polygons.words(),
                        counters.words(),
                        contact_words.words(),
                        contact_rows.rows(),
                        room.polygons,
                        room.contacts,
                    );
                })?;
            }
            Mode::Face(method) => {
                stages.run("polygons", || {
                    clip::polygons::launch(
                        client,
                        per_meshlet.clone(),
                        CubeDim::new_1d(narrow::LANES),
                        images.argument(),
                        directions.words(),
                        maps.rows(),
                        meshlets.words(),
                        counters.words(),
                        polygons.words(),
                        weights.rows(),
                        room.meshlets,
                        room.polygons,
                        prune,
                    );
                })?;
                if images.conforming() > 0 {
                    stages.run("outside of domains", || {
                        outside::outside_polygons::launch(
                            client,
                            per_meshlet,
                            CubeDim::new_1d(narrow::LANES),
                            images.argument(),
                            directions.words(),
                            maps.rows(),
                            meshlets.words(),
                            counters.words(),
                            polygons.words(),
                            weights.rows(),
                            room.meshlets,
                            room.polygons,
                            prune,
                        );
                    })?;
                }
                let (per, lanes) = match (self.options.lanes, method) {
                    (Lanes::Single, FaceMethod::FrankWolfe { .. }) => (narrow::LANES, 1),
                    _ => (1, narrow::LANES),
                };
                let per_polygon = groups_for(&mut stages, room.polygons, per, products::POLYGONS)?;
                // Above any cosine: nothing is filtered.
                let cos_theta = options.cos_theta.map_or(-2.0, |cos| cos as f32);
                match method {
                    FaceMethod::FrankWolfe { iterations } => {
                        let planes = self.options.exchange == Exchange::Device && device.has_planes_of_32();
                        stages.run("face narrow phase", || {
                            narrow::narrow_faces::launch(
                                client,
                                per_polygon,
                                CubeDim::new_1d(narrow::LANES),
                                images.argument(),
                                directions.words(),
                                maps.rows(),
                                polygons.words(),
                                weights.rows(),
                                counters.words(),
                                contact_words.words(),
                                contact_rows.rows(),
                                iterations,
                                cos_theta,
                                room.polygons,
                                room.contacts,
                                lanes,
                                planes,
                                self.options.counting == Counting::Operations,
                            );
                        })?;
                    }
                    FaceMethod::Exact { tolerance } => {
                        let tolerances =
                            device.upload("tolerances", &self.tolerances(instances, tolerance))?;
                        self.report.sent += tolerances.bytes();
                        stages.run("exact narrow phase", || {
                            exact::narrow_exact::launch(
                                client,
                                per_polygon,
                                CubeDim::new_1d(narrow::LANES),
                                images.argument(),
                                directions.words(),
                                maps.rows(),
                                polygons.words(),
                                weights.rows(),
                                counters.words(),
                                contact_words.words(),
                                contact_rows.rows(),
                                tolerances.words(),
                                cos_theta,
                                room.polygons,
                                room.contacts,
                            );
                        })?;
                    }
                }
            }
        }
        if let (Reduction::PerPair(most), Some(members)) = (options.reduction, members) {
            reduction::launch(&mut stages, groups_for, client, &self.products, members, &counters, most)?;
        }
        let Stages { launches, times, .. } = stages;
        self.report.launches = launches;
        self.report.stages = times;
        let counts: Vec<u32> = device.read(&counters, products::COUNTERS)?;
        if counts[products::BADLY_MOVED as usize] > 0 {
            return Err(self.images.badly_moved(&device)?);
        }
        if counts[products::BROKEN_OFF as usize] > 0 {
            return Err(GpuError::Device {
                device: device.info().name.clone(),
                doing: "detecting contacts",
                reason: format!(
                    "the driver broke off the loops of {} threads, as Mesa's llvmpipe does after 65,535 iterations: a face meets too many cells, or a pair has \
                     too many contacts to reduce. \
                     Detect on the processor or on a GPU",
                    counts[products::BROKEN_OFF as usize]
                ),
            });
        }
        self.report.read += counts.len() * WORD;
        Ok(std::array::from_fn(|i| counts[i]))
    }
}
