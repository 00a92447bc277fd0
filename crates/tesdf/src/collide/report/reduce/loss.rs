use std::ops::Range;

use super::bins::Bins;
use super::selection::Selection;
use super::survivors::Survivors;
use super::wrenches::{Wrenches, lanes};
use crate::collide::report::hull::{Combination, LANES, ROUNDING, Simplex, Wrench, dot};

/// Upper bounds of the distances of all contacts of a pair from the hull of the kept wrenches. The
/// hull only grows, so bounds stay valid.
pub struct Loss<'a> {
    pub wrenches: &'a Wrenches,
    pub bins: &'a Bins,
    pub survivors: &'a Survivors,
    /// The squares of the bounds.
    pub squares: Vec<f64>,
}

/// A contact, the point of the hull that is closest to its wrench, and the way from there.
pub struct Projected {
    pub contact: usize,
    pub nearest: Combination,
    pub residual: Wrench,
}

impl Loss<'_> {
    /// The contacts that were found to be farther from the hull than all of `selection`, in which
    /// the survivors begin at `first`. All contacts that are not returned are at most as far as the
    /// farthest contact of those or of `selection`.
    ///
    /// In each bin, the simplices of the points to which its survivors were projected bound the
    /// distances of the others. As long as a bound exceeds the greatest distance so far, the
    /// contact with the greatest bound is projected, and the simplex of its closest point shortens
    /// the other bounds.
    #[inline(always)]
    pub fn beyond(&mut self, selection: &Selection, first: usize) -> Vec<Projected> {
        let hull = selection.hull();
        let limit = selection.square().max(ROUNDING * ROUNDING);
        let (mut greatest, mut beyond) = (limit, Vec::new());
        for (bin, survivors) in self.bins.iter().zip(self.survivors.iter()) {
            let mut simplices = survivors.clone().map(|j| Simplex::new(hull, &selection.nearest(first + j)));
            if self.squares[bin.clone()].iter().all(|&square| square <= greatest) {
                continue;
            }
            if let Some(simplex) = simplices.next() {
                self.shorten_all(&bin, &simplex);
            }
            let mut open: Vec<usize> = bin.filter(|&i| self.squares[i] > greatest).collect();
            while !open.is_empty()
                && let Some(simplex) = simplices.next()
            {
                self.shorten(&open, &simplex);
                open.retain(|&i| self.squares[i] > greatest);
            }
            let mut nearest = selection.nearest(first + survivors.start);
            while let Some(contact) = self.farthest(&open) {
                let residual = nearest.approach(hull, &self.wrenches.get(contact));
                let square = dot(&residual, &residual);
                if square > limit {
                    beyond.push(Projected { contact, nearest, residual });
                }
                greatest = greatest.max(square);
                self.squares[contact] = square;
                self.shorten(&open, &Simplex::new(hull, &nearest));
                open.retain(|&i| self.squares[i] > greatest);
            }
        }
        beyond
    }

    /// Shortens the bounds of a bin.
    #[inline(always)]
    fn shorten_all(&mut self, bin: &Range<usize>, simplex: &Simplex) {
        let columns = self.wrenches.columns.each_ref().map(|column| &column[bin.clone()]);
        for (chunk, squares) in self.squares[bin.clone()].chunks_mut(LANES).enumerate() {
            let new = simplex.squares(&columns.map(|column| lanes(column, chunk * LANES)));
            for (square, new) in squares.iter_mut().zip(new) {
                *square = square.min(new);
            }
        }
    }

    /// Shortens the bounds of the contacts `some`.
    #[inline(always)]
    fn shorten(&mut self, some: &[usize], simplex: &Simplex) {
        for chunk in some.chunks(LANES) {
            let at = |l: usize| chunk[l.min(chunk.len() - 1)];
            let rows = self.wrenches.columns.each_ref().map(|column| std::array::from_fn(|l| column[at(l)]));
            for (&i, square) in chunk.iter().zip(simplex.squares(&rows)) {
                self.squares[i] = self.squares[i].min(square);
            }
        }
    }

    /// Of the contacts `some`, the first with the greatest bound.
    fn farthest(&self, some: &[usize]) -> Option<usize> {
        let longer = |best: usize, i: usize| if self.squares[i] > self.squares[best] { i } else { best };
        some.iter().copied().reduce(longer)
    }
}
