//! Sorts contacts on the device, so that the threads that found them do not decide their order.
use cubecl::prelude::*;

use crate::kernels::report::contact::{Contacts, ContactsExpand, compare};

#[cube]
impl Contacts {
    /// Whether a contact comes before another one. Instances are sorted by world and id, and a
    /// contact belongs to its pair of instances, whichever of the two has the surface.
    fn is_before(&self, x: u32, y: u32) -> bool {
        let (p, q) = (self.instances(x), self.instances(y));
        let mut order = compare(0u32, p.a.min(p.b), q.a.min(q.b));
        order = compare(order, p.a.max(p.b), q.a.max(q.b));
        self.compare_names(order, x, y) == 1u32
    }
}

/// Begins a sort: each contact is a run by itself.
#[cube(launch, create_dummy_kernel)]
pub fn begin(order: &mut [u32], count: u32) {
    let i = ABSOLUTE_POS as u32;
    if i < count {
        order[i as usize] = i;
    }
}

/// Merges neighbouring runs of `run` contacts to runs of twice the length. Each thread finds the
/// place of one contact: its own place in its run, and by bisection that in the other run.
#[cube(launch, create_dummy_kernel)]
pub fn merge(contacts: &Contacts, from: &[u32], to: &mut [u32], count: u32, run: u32) {
    let i = ABSOLUTE_POS as u32;
    if i < count {
        let own = from[i as usize];
        let start = i / (2u32 * run) * (2u32 * run);
        let middle = (start + run).min(count);
        let is_first = i < middle;
        let other = select(is_first, middle, start);
        let mut low = other;
        let mut high = select(is_first, (middle + run).min(count), middle);
        while low < high {
            let at = (low + high) / 2u32;
            let before_own = contacts.is_before(from[at as usize], own);
            // Of equal contacts, those of the first run come first.
            let after_own = contacts.is_before(own, from[at as usize]);
            let comes_first = before_own || (!is_first && !after_own);
            low = select(comes_first, at + 1u32, low);
            high = select(comes_first, high, at);
        }
        let place = (i - select(is_first, start, middle)) + (low - other);
        to[(start + place) as usize] = own;
    }
}
