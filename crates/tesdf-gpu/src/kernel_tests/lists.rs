//! Lists of cells.
use cubecl::prelude::*;
use tesdf::asset::layout::List;

use super::{device, groups_of, read, upload};
use crate::kernels::GROUP;
use crate::kernels::scene::shape::{
    LISTS, NONE, PALETTE_STARTS, PALETTES, PALETTES_HIGH, Rules, STRIDE, Shapes, ShapesLaunch,
};

/// Reads a list per thread: `counts` gets its number of faces, `faces` the first `room` faces.
#[cube(launch)]
fn read_lists(
    shapes: &Shapes,
    offsets: &[u32],
    counts: &mut [u32],
    faces: &mut [u32],
    room: u32,
    count: u32,
) {
    let index = ABSOLUTE_POS as u32;
    if index < count {
        let field = shapes.field(0u32);
        let list = field.list(offsets[index as usize]);
        counts[index as usize] = list.count;
        let mut i = 0u32;
        while i < list.count.min(room) {
            faces[(index * room + i) as usize] = field.listed(list, i);
            i += 1u32;
        }
    }
}

/// Palettes of random faces, and lists of each kind in their bytes.
struct Lists {
    starts: Vec<u32>,
    low: Vec<u16>,
    high: Vec<u8>,
    bytes: Vec<u8>,
    offsets: Vec<u32>,
}

fn random_lists(random: &mut fastrand::Rng) -> Lists {
    let mut lists =
        Lists { starts: vec![0], low: Vec::new(), high: Vec::new(), bytes: Vec::new(), offsets: Vec::new() };
    let sizes = [1, 3, 256];
    for size in sizes {
        lists.low.extend((0..size).map(|_| random.u16(..)));
        lists.high.extend((0..size).map(|_| random.u8(..)));
        lists.starts.push(lists.low.len() as u32);
    }
    for case in 0..500usize {
        // An odd number of bytes between two lists, so that lists begin at every byte of a word.
        lists.bytes.extend((0..case % 4).map(|_| random.u8(..)));
        lists.offsets.push(lists.bytes.len() as u32);
        let length = [0, 1, 2, 40, 255][random.usize(..5)];
        if case % 3 == 0 {
            // Longer than a palette, in some cases.
            let length = if case == 3 { 70_000 } else { length };
            let faces: Vec<u8> = (0..length).flat_map(|_| random.u32(..1 << 24).to_le_bytes()).collect();
            List::Faces(&faces).encode(&mut lists.bytes);
        } else {
            let palette = random.usize(..sizes.len());
            let slots: Vec<u8> = (0..length).map(|_| random.usize(..sizes[palette]) as u8).collect();
            List::Slots(palette as u16, &slots).encode(&mut lists.bytes);
        }
    }
    lists
}

/// The faces of a list, as [`List`] decodes it.
fn decoded(lists: &Lists, offset: u32, with_high: bool) -> Vec<u32> {
    match List::decode(&lists.bytes, offset).expect("a list") {
        List::Slots(palette, slots) => {
            let start = lists.starts[palette as usize] as usize;
            let high = |at: usize| if with_high { u32::from(lists.high[at]) << 16 } else { 0 };
            slots.iter().map(|&s| start + s as usize).map(|at| u32::from(lists.low[at]) | high(at)).collect()
        }
        List::Faces(bytes) => bytes.as_chunks::<4>().0.iter().map(|face| u32::from_le_bytes(*face)).collect(),
    }
}

/// Empty lists, long lists, lists without a palette, lists at every byte of a word; with and
/// without the high bytes of palettes.
#[test]
fn kernels_decode_lists_as_the_layout_defines_them() {
    const ROOM: u32 = 256;
    let mut random = fastrand::Rng::with_seed(11);
    let lists = random_lists(&mut random);
    let device = device();
    for with_high in [true, false] {
        let mut words = Vec::new();
        let mut bytes_at = |bytes: &[u8]| {
            let at = words.len() as u32;
            let padded: Vec<u8> = bytes.iter().copied().chain([0; 8]).collect();
            words.extend(padded.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word)));
            at
        };
        let mut table = vec![0; STRIDE as usize];
        table[LISTS as usize] = bytes_at(&lists.bytes);
        table[PALETTE_STARTS as usize] = bytes_at(bytemuck::cast_slice(&lists.starts));
        table[PALETTES as usize] = bytes_at(bytemuck::cast_slice(&lists.low));
        table[PALETTES_HIGH as usize] = if with_high { bytes_at(&lists.high) } else { NONE };
        let (table, words) = (upload(&device, &table), upload(&device, &words));
        let rows = upload(&device, &[[0.0f32; 4]]);
        let offsets = upload(&device, &lists.offsets);
        let count = lists.offsets.len();
        let counts = upload(&device, &vec![0u32; count]);
        let faces = upload(&device, &vec![0u32; count * ROOM as usize]);
        read_lists::launch(
            device.client(),
            groups_of(count),
            CubeDim::new_1d(GROUP),
            ShapesLaunch::new(table.words(), words.words(), rows.rows(), Rules::default()),
            offsets.words(),
            counts.words(),
            faces.words(),
            ROOM,
            count as u32,
        );
        let counts: Vec<u32> = read(&device, &counts, count);
        let faces: Vec<u32> = read(&device, &faces, count * ROOM as usize);
        for (list, &offset) in lists.offsets.iter().enumerate() {
            let expected = decoded(&lists, offset, with_high);
            assert_eq!(counts[list] as usize, expected.len(), "list {list}");
            let held = expected.len().min(ROOM as usize);
            assert_eq!(faces[list * ROOM as usize..][..held], expected[..held], "list {list}");
        }
    }
}
