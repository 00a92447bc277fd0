//! Where, when and how a table was made.
use std::fs;

/// Command, date, processor and load, as lines of Markdown.
pub fn lines() -> String {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let cores = std::thread::available_parallelism().map_or("unknown".into(), |n| n.to_string());
    format!(
        "`tesdf {}`\n\n- {} UTC, tesdf {}\n- {}; {cores} cores, {}\n",
        words.join(" "),
        jiff::Timestamp::now().strftime("%Y-%m-%d %H:%M"),
        env!("CARGO_PKG_VERSION"),
        processor(),
        load(),
    )
}

/// What else the machine had to do in the last minute and quarter of an hour: this process is part of it.
fn load() -> String {
    let text = fs::read_to_string("/proc/loadavg").unwrap_or_default();
    match text.split(' ').collect::<Vec<_>>()[..] {
        [one, _, fifteen, ..] => {
            format!("load at the end {one}, over 15 minutes {fifteen}, this run included")
        }
        _ => "load unknown".into(),
    }
}

fn processor() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find(|l| l.starts_with("model name")).and_then(|l| l.split_once(':'));
    model.map_or("processor unknown".into(), |(_, name)| name.trim().into())
}
