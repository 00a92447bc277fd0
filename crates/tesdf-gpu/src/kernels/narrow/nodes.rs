//! Node-TES: the signed distance at a node.
use cubecl::prelude::*;

use crate::kernels::counters::{Counters, POLYGONS};
use crate::kernels::detect::candidates::Items;
use crate::kernels::detect::ordered_pair::OrderedPairs;
use crate::kernels::report::contact::{CONVERGED, Contacts, Touch};
use crate::kernels::scene::shape::Shapes;

/// Writes the contact of a node per thread.
#[cube(launch, create_dummy_kernel)]
pub fn narrow_nodes(
    shapes: &Shapes,
    pairs: &OrderedPairs,
    nodes: &Items,
    counters: &Counters,
    contacts: &mut Contacts,
) {
    let number = ABSOLUTE_POS as u32;
    if number < counters.within(POLYGONS, nodes.room) {
        let item = nodes.get(number);
        let pair = pairs.get(item.pair);
        let point = shapes.part(pair, item.face).corner(item.number);
        let field = shapes.field(pair.shape_b);
        let cell = field.cell(item.cell);
        let v = field.value_in_cell(cell, point);
        if v.distance <= pairs.reach_around(pair, point, pair.radius) {
            let corner = item.number + CONVERGED;
            let touch = Touch { face: item.face, cell: cell.name(), corner, point, cosine: 0.0f32.runtime() };
            contacts.append(counters, pair, touch, v);
        }
    }
}
