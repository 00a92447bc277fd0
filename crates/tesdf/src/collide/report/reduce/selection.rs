use crate::collide::report::hull::{Combination, ROUNDING, SLACK, Wrench, dot};

/// Number of wrenches per block. For each block the maximum is kept up to date.
const BLOCK: usize = 64;

/// A set of wrenches, some of which are kept. Each wrench has a residual: the vector to it from a
/// point of the hull of the kept wrenches. The hull only grows, so this point stays in it, and the
/// length of the residual remains an upper bound of the distance.
///
/// Wrenches and residuals have a column for each coordinate.
pub struct Selection {
    wrenches: [Vec<f64>; 6],
    residuals: [Vec<f64>; 6],
    /// Squared lengths of the residuals.
    bounds: Vec<f64>,
    /// The greatest bound of each block.
    greatest: Vec<f64>,
    /// Whether the residual was shortened since it was last the distance.
    shortened: Vec<bool>,
    /// The point of the hull at which the residual was last the distance, and the number of points
    /// that spanned the hull.
    nearest: Vec<(Combination, u32)>,
    /// Kept wrenches, in the order of their selection.
    order: Vec<usize>,
    hull: Vec<Wrench>,
}

impl Selection {
    /// Keeps the first `n` of the wrenches `seeds`, which are different.
    #[inline(always)]
    pub fn new(wrenches: impl ExactSizeIterator<Item = Wrench>, seeds: &[usize], n: usize) -> Self {
        let count = wrenches.len();
        let mut columns: [Vec<f64>; 6] = std::array::from_fn(|_| Vec::with_capacity(count));
        for wrench in wrenches {
            push(&mut columns, &wrench);
        }
        let mut selection = Self {
            wrenches: columns,
            residuals: std::array::from_fn(|_| vec![0.0; count]),
            bounds: vec![f64::INFINITY; count],
            greatest: vec![f64::INFINITY; count.div_ceil(BLOCK)],
            shortened: vec![false; count],
            nearest: vec![(Combination::of(0), 1); count],
            order: Vec::new(),
            hull: Vec::new(),
        };
        seeds.iter().take(n).for_each(|&i| selection.keep(i));
        selection
    }

    /// Keeps the farthest wrench, one by one, until there are `n` or all are in the hull.
    ///
    /// Blum, Har-Peled, Raichel, Sparse approximation via generating point sets, 2016.
    #[inline(always)]
    pub fn grow(&mut self, n: usize) {
        while let Some(i) = self.farthest()
            && self.order.len() < n
        {
            self.keep(i);
        }
    }

    /// Adds a wrench that may be kept, with the closest point of the hull and the way from there.
    pub fn add(&mut self, wrench: Wrench, nearest: Combination, residual: Wrench) {
        push(&mut self.wrenches, &wrench);
        push(&mut self.residuals, &residual);
        self.bounds.push(dot(&residual, &residual));
        self.shortened.push(false);
        self.nearest.push((nearest, self.hull.len() as u32));
        self.greatest.resize(self.bounds.len().div_ceil(BLOCK), 0.0);
        self.update_greatest(self.greatest.len() - 1);
    }

    /// The kept wrenches, in the order of their selection.
    pub fn order(&self) -> &[usize] {
        &self.order
    }

    /// The wrenches that span the hull.
    pub fn hull(&self) -> &[Wrench] {
        &self.hull
    }

    /// The point of the hull to which a wrench was last projected.
    pub fn nearest(&self, i: usize) -> Combination {
        self.nearest[i].0
    }

    /// The square of the greatest distance of a wrench from the hull.
    pub fn square(&self) -> f64 {
        self.greatest.iter().copied().fold(0.0, f64::max)
    }

    /// Bytes of all arrays.
    pub fn bytes(&self) -> usize {
        self.bounds.capacity() * size_of::<(Wrench, Wrench, f64, bool, Combination, u32)>()
            + self.greatest.capacity() * size_of::<f64>()
            + self.order.capacity() * size_of::<usize>()
            + self.hull.capacity() * size_of::<Wrench>()
    }

    /// Adds wrench `i` to the hull. All residuals become shorter where a segment to the new wrench
    /// allows it.
    #[inline(always)]
    fn keep(&mut self, i: usize) {
        let new = self.wrench(i);
        let (is_first, count) = (self.hull.is_empty(), self.bounds.len());
        self.order.push(i);
        self.hull.push(new);
        let wrenches = self.wrenches.each_ref().map(|column| &column[..count]);
        let residuals = self.residuals.each_mut().map(|column| &mut column[..count]);
        let (bounds, shortened) = (&mut self.bounds[..count], &mut self.shortened[..count]);
        for j in 0..count {
            let (mut residual, mut to) = ([0.0; 6], [0.0; 6]);
            for c in 0..6 {
                residual[c] = if is_first { wrenches[c][j] - new[c] } else { residuals[c][j] };
                // From the point of the hull, w − r, to the new wrench.
                to[c] = new[c] - wrenches[c][j] + residual[c];
            }
            let gap = dot(&residual, &to);
            // The test by which a projection ends: otherwise the residual stays the distance.
            let is_shorter = gap > SLACK * bounds[j] && bounds[j] > ROUNDING * ROUNDING;
            let step = (gap / dot(&to, &to).max(f64::MIN_POSITIVE)).min(1.0);
            let step = if is_shorter { step } else { 0.0 };
            for c in 0..6 {
                residual[c] -= step * to[c];
                residuals[c][j] = residual[c];
            }
            bounds[j] = dot(&residual, &residual);
            shortened[j] |= is_shorter;
        }
        for block in 0..self.greatest.len() {
            self.update_greatest(block);
        }
    }

    /// The wrench that is farthest from the hull; `None` when all are in it up to rounding.
    /// Computes all distances that can be the greatest, so that the greatest bound is a distance.
    fn farthest(&mut self) -> Option<usize> {
        loop {
            let block = first_max(&self.greatest);
            let start = block * BLOCK;
            let end = self.bounds.len().min(start + BLOCK);
            let i = start + first_max(&self.bounds[start..end]);
            if self.bounds[i] <= ROUNDING * ROUNDING {
                return None;
            }
            if !self.shortened[i] {
                return Some(i);
            }
            self.shortened[i] = false;
            let wrench = self.wrench(i);
            let (nearest, seen) = &mut self.nearest[i];
            let residual = nearest.approach_again(&self.hull, &wrench, *seen as usize);
            *seen = self.hull.len() as u32;
            let square = dot(&residual, &residual);
            if square < self.bounds[i] {
                self.bounds[i] = square;
                self.residuals.iter_mut().zip(residual).for_each(|(column, x)| column[i] = x);
                self.update_greatest(block);
            }
        }
    }

    fn wrench(&self, i: usize) -> Wrench {
        self.wrenches.each_ref().map(|column| column[i])
    }

    fn update_greatest(&mut self, block: usize) {
        let start = block * BLOCK;
        let end = self.bounds.len().min(start + BLOCK);
        self.greatest[block] = self.bounds[start..end].iter().copied().fold(0.0, f64::max);
    }
}

fn push(columns: &mut [Vec<f64>; 6], row: &Wrench) {
    columns.iter_mut().zip(row).for_each(|(column, &x)| column.push(x));
}

/// Index of the first greatest number.
fn first_max(numbers: &[f64]) -> usize {
    let mut best = (0, f64::NEG_INFINITY);
    for (i, &x) in numbers.iter().enumerate() {
        if x > best.1 {
            best = (i, x);
        }
    }
    best.0
}
