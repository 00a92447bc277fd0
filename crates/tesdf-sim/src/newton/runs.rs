//! Sorts what comes in runs.

/// `items` sorted by group and key; equal ones keep their order. Those of a group come together and
/// mostly in order, as contacts do: then each group is read, and only the groups are sorted.
pub fn sort_runs<T: Copy, G: Ord, K: Ord>(
    items: Vec<T>,
    group: impl Fn(&T) -> G,
    key: impl Fn(&T) -> K,
) -> Vec<T> {
    let mut runs: Vec<&[T]> = items.chunk_by(|a, b| group(a) == group(b)).collect();
    runs.sort_by_key(|run| group(&run[0]));
    let mut sorted: Vec<T> = Vec::with_capacity(items.len());
    runs.into_iter().for_each(|run| sorted.extend_from_slice(run));
    for run in sorted.chunk_by_mut(|a, b| group(a) == group(b)) {
        if !run.is_sorted_by_key(&key) {
            run.sort_by_key(&key);
        }
    }
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_in_any_order_are_sorted_as_by_a_stable_sort() {
        for seed in 0..200 {
            let random = &mut fastrand::Rng::with_seed(seed);
            let mut items = Vec::new();
            for _ in 0..random.usize(0..6) {
                let (group, sorted) = (random.u8(0..3), random.bool());
                let mut run: Vec<_> = (0..random.usize(0..9)).map(|_| (group, random.u8(0..5))).collect();
                if sorted {
                    run.sort_unstable();
                }
                items.extend(run);
            }
            let items: Vec<_> = items.into_iter().zip(0..).collect();
            let mut expected = items.clone();
            expected.sort_by_key(|(id, _)| *id);
            assert_eq!(sort_runs(items, |item| item.0.0, |item| item.0.1), expected, "seed {seed}");
        }
    }
}
