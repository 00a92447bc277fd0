//! Middle phase with one contact for each face: finds the faces that can touch. They need no cells.
use cubecl::prelude::*;

use crate::kernels::counters::{self, Counters};
use crate::kernels::detect::candidates::{Item, Items};
use crate::kernels::detect::ordered_pair::OrderedPairs;
use crate::kernels::pairs::meshlets::{Blocks, meshlet_work};
use crate::kernels::scene::shape::{NONE, Shapes};

/// Writes the faces that can touch. A group takes a meshlet, and a thread takes a face.
#[cube(launch, create_dummy_kernel)]
pub fn whole_faces(
    shapes: &Shapes,
    pairs: &OrderedPairs,
    meshlets: &Blocks,
    counters: &Counters,
    faces: &mut Items,
    prune: u32,
) {
    let item = CUBE_POS as u32;
    if item < counters.within(counters::MESHLETS, meshlets.room) {
        let work = meshlet_work(shapes, pairs, meshlets, item);
        let pair = work.pair;
        if UNIT_POS < work.faces() {
            let face = work.face(UNIT_POS);
            let part = shapes.part(pair, face);
            let center = part.center();
            let reach = pairs.reach_of(pair, part);
            if !work.field.is_beyond(center, part.radius_around(center), reach, prune) {
                counters.append(counters::CANDIDATES);
                let at = counters.append(counters::POLYGONS);
                if at < faces.room {
                    let cell = NONE.runtime();
                    faces.put(at, Item { pair: pair.number, face, cell, number: part.count });
                }
            }
        }
    }
}
