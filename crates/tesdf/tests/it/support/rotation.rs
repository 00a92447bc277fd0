//! Tests of many random cases run a third of them, which the day chooses; so all of them run in three
//! days. `TESDF_TEST_DAY=all` runs all of them in one go, and `TESDF_TEST_DAY=N` those of day `N`.
use std::time::SystemTime;

/// Number of days in which all cases run.
const DAYS: u64 = 3;

/// The day as in `TESDF_TEST_DAY`, or today: days since 1970. `None` for all.
fn day() -> Option<u64> {
    match std::env::var("TESDF_TEST_DAY") {
        Ok(all) if all == "all" => None,
        Ok(day) => Some(day.parse().expect("TESDF_TEST_DAY is a number of days, or `all`")),
        Err(_) => {
            let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).expect("after 1970");
            Some(now.as_secs() / (24 * 60 * 60))
        }
    }
}

/// The cases of the day. A test that fails prints how to repeat it.
pub fn of_the_day<T>(cases: impl IntoIterator<Item = T>) -> Vec<T> {
    let Some(day) = day() else { return cases.into_iter().collect() };
    println!("some cases only; to repeat them: TESDF_TEST_DAY={day}");
    cases.into_iter().skip((day % DAYS) as usize).step_by(DAYS as usize).collect()
}

/// The number of random cases of a day, of which each run has others.
pub fn cases(all: u32) -> u32 {
    // Miri interprets each instruction.
    if cfg!(miri) {
        return 20;
    }
    if day().is_none() { all } else { all.div_ceil(DAYS as u32) }
}

/// What a test must find at least: in all cases, or in those of a day.
pub fn least(of_all: usize, of_a_day: usize) -> usize {
    if day().is_none() { of_all } else { of_a_day }
}
