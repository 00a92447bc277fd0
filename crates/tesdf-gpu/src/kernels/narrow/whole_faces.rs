//! Face-TES with one contact for each face: finds the least signed distance over a whole face by
//! Frank–Wolfe. Each evaluation finds the cell of its point, and the group shares its list.
use cubecl::prelude::*;

use super::super::broad::ordered_pair::OrderedPairs;
use super::super::counters::{self, Counters};
use super::super::field::locate::no_cell;
use super::super::field::shapes::Shapes;
use super::super::middle::items::Polygons;
use super::contacts::Contacts;
use super::exchange::{Variant, exchange};
use super::extremes::{Limits, facing};
use super::faces::{Asked, minimize, no_best, share_list};
use super::near::no_walk;
use super::piece::empty_pool;
use super::taken::memory_of;

/// Finds the contacts of a face per group.
#[cube(launch, create_dummy_kernel)]
pub fn narrow_whole_faces(
    shapes: &Shapes,
    pairs: &OrderedPairs,
    polygons: &Polygons,
    counters: &Counters,
    contacts: &mut Contacts,
    asked: &Asked,
    #[comptime] variant: Variant,
) {
    let mut exchange = exchange(variant);
    let mut best = no_best(variant);
    let mut memory = memory_of(empty_pool(comptime!(variant.counting)), no_walk());
    let number = CUBE_POS as u32;
    let count = counters.within(counters::POLYGONS, polygons.items.room);
    if number < count {
        let item = polygons.items.get(number);
        let pair = pairs.get(item.pair);
        let tolerance = asked.tolerances[pair.b as usize];
        let face = facing(shapes, pairs, pair, item.face, Limits { tolerance, cos_theta: asked.cos_theta });
        let list = share_list(face.field, no_cell(), variant);
        let polygon = polygons.whole(face.part);
        let search =
            minimize(face.field, list, polygon, face.reach, asked.iterations, &mut exchange, &mut best);
        search.count(counters, variant);
        if search.distance <= face.reach {
            // Nothing proves that no point is lower.
            face.report(search.best, false.runtime(), counters, contacts, &mut memory);
        }
        memory.pool.work.add_to(counters);
        counters.tell_if_broken_off(count);
    }
}
