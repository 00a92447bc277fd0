use std::time::Instant;

/// Passes that are timed.
pub const PASSES: usize = 5;

/// Seconds of the quickest of [`PASSES`] passes, one after the other, after one that is not counted.
pub fn best_pass(mut pass: impl FnMut()) -> f64 {
    pass();
    let timed = |_| {
        let start = Instant::now();
        pass();
        start.elapsed().as_secs_f64()
    };
    (0..PASSES).map(timed).fold(f64::INFINITY, f64::min)
}
