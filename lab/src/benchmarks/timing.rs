use std::time::Instant;

/// Number of timed passes.
pub const PASSES: usize = 5;

/// The time of the fastest of [`PASSES`] passes, s. A pass before them warms up and is not counted.
pub fn best_pass(mut pass: impl FnMut()) -> f64 {
    pass();
    let timed = |_| {
        let start = Instant::now();
        pass();
        start.elapsed().as_secs_f64()
    };
    (0..PASSES).map(timed).fold(f64::INFINITY, f64::min)
}
