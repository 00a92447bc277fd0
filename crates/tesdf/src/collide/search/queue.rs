//! The queue of a best-first search.
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::ControlFlow;

/// Items with bounds. The least bound comes first; among equal bounds, the item that was added
/// first.
///
/// Items lie in an arena, and the heap orders their indices: items of some hundred bytes took a
/// quarter of the time of a search when the heap moved them.
pub struct Queue<T> {
    heap: BinaryHeap<Entry>,
    items: Vec<Option<T>>,
    /// Indices of the arena without an item.
    vacant: Vec<usize>,
    added: u64,
}

struct Entry {
    bound: f64,
    serial: u64,
    index: usize,
}

impl<T> Queue<T> {
    pub fn new() -> Self {
        Self { heap: BinaryHeap::new(), items: Vec::new(), vacant: Vec::new(), added: 0 }
    }

    pub fn push(&mut self, bound: f64, item: T) {
        let index = match self.vacant.pop() {
            Some(index) => {
                self.items[index] = Some(item);
                index
            }
            None => {
                self.items.push(Some(item));
                self.items.len() - 1
            }
        };
        self.added += 1;
        self.heap.push(Entry { bound, serial: self.added, index });
    }

    /// Takes the first item, with its bound.
    pub fn pop(&mut self) -> Option<(f64, T)> {
        let Entry { bound, index, .. } = self.heap.pop()?;
        self.vacant.push(index);
        self.items[index].take().map(|item| (bound, item))
    }

    /// A best-first search. Takes item after item and has it replaced by its parts, which `expand`
    /// adds, until `expand` ends the search with a result. `None` when no item is left.
    pub fn search<R>(&mut self, mut expand: impl FnMut(&mut Self, f64, T) -> ControlFlow<R>) -> Option<R> {
        while let Some((bound, item)) = self.pop() {
            if let ControlFlow::Break(result) = expand(self, bound, item) {
                return Some(result);
            }
        }
        None
    }

    /// The bound of the first item.
    pub fn least(&self) -> Option<f64> {
        self.heap.peek().map(|entry| entry.bound)
    }

    pub fn len(&self) -> usize {
        self.heap.len()
    }

    /// The items that are left, not sorted.
    pub fn into_items(self) -> impl Iterator<Item = T> {
        self.items.into_iter().flatten()
    }
}

impl PartialEq for Entry {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Entry {}
impl PartialOrd for Entry {
    #[inline]
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Entry {
    #[inline]
    fn cmp(&self, other: &Self) -> Ordering {
        // The heap returns its greatest element first.
        other.bound.total_cmp(&self.bound).then(other.serial.cmp(&self.serial))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_bounds_come_in_the_order_in_which_they_were_added() {
        let mut queue = Queue::new();
        for (k, bound) in [1.0, 0.0, 1.0, f64::NEG_INFINITY, 0.0].into_iter().enumerate() {
            queue.push(bound, k);
        }
        assert_eq!((queue.len(), queue.least()), (5, Some(f64::NEG_INFINITY)));
        let items: Vec<usize> = std::iter::from_fn(|| queue.pop()).map(|(_, item)| item).collect();
        assert_eq!(items, [3, 1, 4, 0, 2]);
    }

    #[test]
    fn an_item_takes_the_place_of_one_that_was_taken() {
        let mut queue = Queue::new();
        queue.push(0.0, 8u32);
        // Each number is replaced by its two halves, the search ends at the first odd one.
        let odd = queue.search(|queue, bound, number| {
            if number % 2 == 1 {
                return ControlFlow::Break((bound, number));
            }
            queue.push(bound + 1.0, number / 2);
            queue.push(bound + 2.0, number / 2);
            ControlFlow::Continue(())
        });
        assert_eq!(odd, Some((3.0, 1)));
        assert_eq!((queue.added, queue.len(), queue.items.len()), (13, 6, 7));
        assert_eq!(queue.into_items().count(), 6);
    }
}
