//! The queue of a best-first search.
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Items by a number. The least number comes first; among equal numbers, the item that was added
/// first.
pub struct Queue<T> {
    heap: BinaryHeap<Entry<T>>,
    added: u64,
}

struct Entry<T> {
    key: f64,
    serial: u64,
    item: T,
}

impl<T> Queue<T> {
    pub fn new() -> Self {
        Self { heap: BinaryHeap::new(), added: 0 }
    }

    pub fn push(&mut self, key: f64, item: T) {
        self.added += 1;
        self.heap.push(Entry { key, serial: self.added, item });
    }

    pub fn pop(&mut self) -> Option<T> {
        self.heap.pop().map(|entry| entry.item)
    }

    /// The number of the first item.
    pub fn least(&self) -> Option<f64> {
        self.heap.peek().map(|entry| entry.key)
    }

    pub fn len(&self) -> usize {
        self.heap.len()
    }

    /// The items that are left, not sorted.
    pub fn into_items(self) -> impl Iterator<Item = T> {
        self.heap.into_iter().map(|entry| entry.item)
    }
}

impl<T> PartialEq for Entry<T> {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl<T> Eq for Entry<T> {}
impl<T> PartialOrd for Entry<T> {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl<T> Ord for Entry<T> {
    fn cmp(&self, other: &Self) -> Ordering {
        // The heap returns its greatest element first.
        other.key.total_cmp(&self.key).then(other.serial.cmp(&self.serial))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_numbers_come_in_the_order_in_which_they_were_added() {
        let mut queue = Queue::new();
        for (k, key) in [1.0, 0.0, 1.0, f64::NEG_INFINITY, 0.0].into_iter().enumerate() {
            queue.push(key, k);
        }
        assert_eq!((queue.len(), queue.least()), (5, Some(f64::NEG_INFINITY)));
        let items: Vec<usize> = std::iter::from_fn(|| queue.pop()).collect();
        assert_eq!(items, [3, 1, 4, 0, 2]);
    }
}
