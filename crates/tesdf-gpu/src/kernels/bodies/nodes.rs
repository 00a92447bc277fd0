//! Middle phase of the mode `node`: finds the cells of nodes.
use cubecl::prelude::*;

use crate::kernels::counters::{self, CANDIDATES, Counters};
use crate::kernels::detect::candidates::{Item, Items};
use crate::kernels::detect::ordered_pair::OrderedPairs;
use crate::kernels::geometry::vector::V3;
use crate::kernels::pairs::meshlets::{Blocks, meshlet_work};
use crate::kernels::scene::shape::{BAND, Field, FieldExpand, NONE, Shapes};

/// The cell of a node, and whether it can touch.
#[derive(CubeType, CubeTypeMut, Clone, Copy)]
#[expand(derive(Clone, Copy))]
struct Located {
    cell: u32,
    kept: bool,
}

#[cube]
impl Field<'_> {
    fn locate_node(self, p: V3, reach: f32, prune: u32) -> Located {
        let mut found = Located { cell: NONE.runtime(), kept: true };
        if self.is_mesh() {
            let cell = self.locate(p);
            found.cell = cell.number;
            found.kept = (!cell.is_out() || reach >= self.number(BAND))
                && (prune == 0u32 || self.cell_bound(cell.number) <= reach);
        }
        found
    }
}

/// Writes the nodes that can touch, with their cells. A group takes a meshlet. A thread takes a
/// face, with the corners that no earlier face has.
#[cube(launch, create_dummy_kernel)]
pub fn nodes(
    shapes: &Shapes,
    pairs: &OrderedPairs,
    meshlets: &Blocks,
    counters: &Counters,
    nodes: &mut Items,
    prune: u32,
) {
    let item = CUBE_POS as u32;
    if item < counters.within(counters::MESHLETS, meshlets.room) {
        let work = meshlet_work(shapes, pairs, meshlets, item);
        let pair = work.pair;
        if UNIT_POS < work.faces() {
            let face = work.face(UNIT_POS);
            let part = shapes.part(pair, face);
            let mut k = 0u32;
            while k < 3u32 {
                if (part.owned >> k) & 1u32 == 1u32 {
                    counters.append(CANDIDATES);
                    let p = part.corner(k);
                    let node = work.field.locate_node(p, pairs.reach_around(pair, p, pair.radius), prune);
                    if node.kept {
                        let at = counters.append(counters::POLYGONS);
                        if at < nodes.room {
                            nodes.put(at, Item { pair: pair.number, face, cell: node.cell, number: k });
                        }
                    }
                }
                k += 1u32;
            }
        }
    }
}
