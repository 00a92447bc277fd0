//! The heading of a table: when, where and how it was made.
use std::fs;
use std::path::Path;

/// The command of this process, with quotes where a shell needs them.
pub fn command() -> String {
    let quoted = |word: String| {
        if word.is_empty() || word.contains(char::is_whitespace) { format!("'{word}'") } else { word }
    };
    let mut words = std::env::args();
    let program = words.next().unwrap_or_default();
    let name = Path::new(&program).file_name().unwrap_or_default().to_string_lossy().into_owned();
    std::iter::once(name).chain(words.map(quoted)).collect::<Vec<_>>().join(" ")
}

/// Date and time (UTC) and the version of tesdf.
pub fn version_and_date() -> String {
    let now = jiff::Timestamp::now().strftime("%Y-%m-%d %H:%M");
    format!("{now} UTC, tesdf {}", env!("CARGO_PKG_VERSION"))
}

/// The model of the processor, and its number of cores.
pub fn processor() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = text.lines().find(|l| l.starts_with("model name")).and_then(|l| l.split_once(':'));
    let model = model.map_or("processor unknown", |(_, name)| name.trim());
    let cores = std::thread::available_parallelism().map_or("unknown".into(), |n| n.to_string());
    format!("{model}; {cores} cores")
}

/// The mean number of running processes over the last minute and over the last 15 minutes. `None`
/// where the system does not report it.
pub fn load() -> Option<[String; 2]> {
    let text = fs::read_to_string("/proc/loadavg").ok()?;
    let mut words = text.split(' ');
    let (one, _, fifteen) = (words.next()?, words.next()?, words.next()?);
    Some([one.into(), fifteen.into()])
}

/// Command, date, processor and load, as lines of Markdown.
pub fn lines() -> String {
    let load = match load() {
        Some([one, fifteen]) => {
            format!("load at the end {one}, over 15 minutes {fifteen}, this run included")
        }
        None => "load unknown".into(),
    };
    format!("`{}`\n\n- {}\n- {}, {load}\n", command(), version_and_date(), processor())
}
