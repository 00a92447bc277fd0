use super::wrenches::{Wrenches, middle, range};
use crate::collide::report::hull::Wrench;

/// Bits of a radix sort's digit.
const DIGIT: u32 = 11;
/// Largest number of bits per coordinate.
const MAX_BITS: u32 = 8;
/// Number of contacts that say how far the boxes are halved.
const SAMPLE: usize = 4096;

/// Contacts grouped by direction and place: their wrenches lie in the same box of the space of
/// wrenches. All boxes have the same size.
pub struct Bins {
    /// Where each bin begins, and the end.
    starts: Vec<usize>,
    /// The middle of the box around all wrenches.
    pub middle: Wrench,
}

impl Bins {
    /// At most `most` bins that hold a contact, and as many as halving all boxes, one coordinate
    /// after the other, gives up to that number. Returns the bins and the order that sorts the
    /// contacts by bin, then by index.
    ///
    /// A key has the bits of the six coordinates in turns, so a box is a prefix of keys. Sorting
    /// brings the contacts of each box together, whatever its size.
    #[inline(always)]
    pub fn new(wrenches: &Wrenches, most: usize) -> (Self, Vec<u32>) {
        let count = wrenches.len();
        let step = count.div_ceil(SAMPLE);
        // The box of a part of the contacts; the outermost boxes take the others, too.
        let of_sample = |column: &Vec<f64>| range(&column.iter().copied().step_by(step).collect::<Vec<_>>());
        let ranges = wrenches.columns.each_ref().map(of_sample);
        let index_bits = usize::BITS - (count - 1).leading_zeros();
        let bits = ((u64::BITS - index_bits) / 6).min(MAX_BITS);
        let mut keys = keys(wrenches, &ranges, bits, index_bits);
        // A part of the contacts has at most as many bins.
        let mut sample: Vec<u64> = keys.iter().step_by(step).copied().collect();
        sample.sort_unstable();
        let (all_bits, least) = (index_bits + 6 * bits, level(&sample, index_bits, most));
        sort(&mut keys, least, all_bits);
        let level = level(&keys, least, most);
        let new = (1..count).filter(|&i| (keys[i - 1] ^ keys[i]) >> level != 0);
        let starts = [0].into_iter().chain(new).chain([count]).collect();
        let order = keys.iter().map(|&key| (key & ((1 << index_bits) - 1)) as u32).collect();
        (Self { starts, middle: ranges.map(middle) }, order)
    }

    /// Bytes of the array.
    pub fn bytes(&self) -> usize {
        self.starts.capacity() * size_of::<usize>()
    }

    /// The contacts of each bin, as ranges of the sorted contacts.
    pub fn iter(&self) -> impl Iterator<Item = std::ops::Range<usize>> {
        self.starts.windows(2).map(|w| w[0]..w[1])
    }
}

/// Bytes that sorting takes for this many contacts.
pub fn sort_bytes(contacts: usize) -> usize {
    2 * contacts * size_of::<u64>()
}

/// The number of low bits, at least `least`, that sorted keys may differ in within a bin.
fn level(keys: &[u64], least: u32, most: usize) -> u32 {
    // Neighbours are parted by all levels below their highest difference.
    let mut parted = [0usize; u64::BITS as usize + 1];
    for pair in keys.windows(2) {
        parted[(u64::BITS - (pair[0] ^ pair[1]).leading_zeros()) as usize] += 1;
    }
    let (mut level, mut count) = (u64::BITS, 1);
    while level > least && count + parted[level as usize] <= most {
        count += parted[level as usize];
        level -= 1;
    }
    level
}

/// Keys of contacts: the place of the wrench in a cube, then the index.
#[inline(always)]
fn keys(wrenches: &Wrenches, ranges: &[(f64, f64); 6], bits: u32, index_bits: u32) -> Vec<u64> {
    let side = ranges.iter().map(|(low, high)| high - low).fold(0.0, f64::max);
    let most = f64::from((1u32 << bits) - 1);
    let scale = if side > 0.0 { (most + 1.0) / side } else { 0.0 };
    // Bit k of a coordinate becomes bit 6 k.
    let spread: [u64; 1 << MAX_BITS] =
        std::array::from_fn(|x| (0..MAX_BITS).map(|k| (x as u64 >> k & 1) << (6 * k)).sum());
    // Adding this rounds to whole numbers, which are then the lowest bits.
    const WHOLE: f64 = (1u64 << 52) as f64;
    let columns = wrenches.columns.each_ref().map(|column| &column[..wrenches.len()]);
    let key = |i: usize| {
        let mut key = 0;
        for c in 0..6 {
            let place = ((columns[c][i] - ranges[c].0) * scale - 0.5).max(0.0).min(most);
            key |= spread[(place + WHOLE).to_bits() as usize & (spread.len() - 1)] << c;
        }
        key << index_bits | i as u64
    };
    (0..wrenches.len()).map(key).collect()
}

/// Sorts by the bits of `from..end`. Keys that are equal there keep their order.
fn sort(keys: &mut Vec<u64>, from: u32, end: u32) {
    let mut other = vec![0; keys.len()];
    for shift in (from..end).step_by(DIGIT as usize) {
        let digit = |key: u64| (key >> shift) as usize & ((1 << DIGIT) - 1);
        let mut starts = [0u32; 1 << DIGIT];
        keys.iter().for_each(|&key| starts[digit(key)] += 1);
        let mut next = 0;
        for start in &mut starts {
            next += std::mem::replace(start, next);
        }
        for &key in keys.iter() {
            let start = &mut starts[digit(key)];
            other[*start as usize] = key;
            *start += 1;
        }
        std::mem::swap(keys, &mut other);
    }
}
