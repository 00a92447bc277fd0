//! A fixed piece of work. The seconds that it takes are the unit of `.ci/budget.tsv`, so that a slower
//! machine has a longer budget. It resembles the checks: branches, sorting, allocation and square roots.
use std::collections::BTreeMap;

fn main() {
    let mut state = 0x9e37_79b9_7f4a_7c15u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state
    };
    let mut sum = 0.0;
    for _ in 0..100 {
        let points: Vec<[f64; 3]> = (0..1500).map(|_| [(); 3].map(|()| next() as f64 / u64::MAX as f64)).collect();
        for a in &points {
            let nearest = points.iter().map(|b| (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>());
            sum += nearest.filter(|&d| d > 0.0).fold(f64::INFINITY, f64::min).sqrt();
        }
        let mut cells: BTreeMap<u64, Vec<u64>> = BTreeMap::new();
        (0..150_000).for_each(|_| cells.entry(next() % 20_000).or_default().push(next()));
        for cell in cells.values_mut() {
            cell.sort_unstable();
            sum += cell.iter().map(|x| (x % 7) as f64).sum::<f64>();
        }
    }
    println!("{sum}");
}
