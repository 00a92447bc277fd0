use std::ops::Range;

use super::bins::Bins;
use super::wrenches::{Wrenches, first_max, first_min};
use crate::collide::report::hull::{Wrench, dot};

/// Number of contacts that represent a bin: the deepest and three extremes.
pub const PER_BIN: usize = 4;

/// The contacts that represent their bins.
pub struct Survivors {
    /// Contacts, bin by bin.
    pub contacts: Vec<usize>,
    /// Where each bin begins in `contacts`, and the end.
    starts: Vec<usize>,
}

impl Survivors {
    /// Of each bin the deepest contact, and three extremes: the contact whose wrench is farthest
    /// from the middle of all wrenches, then twice the contact whose wrench is farthest from those
    /// of the bin that are already in.
    ///
    /// `squares` is memory for a number per contact.
    #[inline(always)]
    pub fn new(wrenches: &Wrenches, bins: &Bins, squares: &mut [f64]) -> Self {
        let (mut contacts, mut starts) = (Vec::new(), vec![0]);
        for bin in bins.iter() {
            let squares = &mut squares[bin.clone()];
            squares.fill(f64::INFINITY);
            shorten(wrenches, &bin, &bins.middle, squares);
            let outermost = first_max(squares);
            squares.fill(f64::INFINITY);
            let mut next = first_min(&wrenches.distances[bin.clone()]);
            for round in 0..PER_BIN {
                contacts.push(bin.start + next);
                shorten(wrenches, &bin, &wrenches.get(bin.start + next), squares);
                next = if round == 0 && squares[outermost] > 0.0 { outermost } else { first_max(squares) };
                // The others are equal to a survivor.
                if squares[next] <= 0.0 {
                    break;
                }
            }
            starts.push(contacts.len());
        }
        Self { contacts, starts }
    }

    /// Bytes of all arrays.
    pub fn bytes(&self) -> usize {
        (self.contacts.capacity() + self.starts.capacity()) * size_of::<usize>()
    }

    /// For each bin, the range of its survivors in `contacts`.
    pub fn iter(&self) -> impl Iterator<Item = Range<usize>> {
        self.starts.windows(2).map(|w| w[0]..w[1])
    }
}

/// Shortens the distances of the contacts `bin` to those from a point. All distances are squares.
#[inline(always)]
fn shorten(wrenches: &Wrenches, bin: &Range<usize>, point: &Wrench, squares: &mut [f64]) {
    let [a, b, c, d, e, f] = wrenches.columns.each_ref().map(|column| &column[bin.clone()]);
    for k in 0..squares.len() {
        let way = [
            a[k] - point[0],
            b[k] - point[1],
            c[k] - point[2],
            d[k] - point[3],
            e[k] - point[4],
            f[k] - point[5],
        ];
        let square = dot(&way, &way);
        squares[k] = if square < squares[k] { square } else { squares[k] };
    }
}
