//! Output for users and programs: results on stdout, everything else on stderr.
use std::borrow::Cow;
use std::fmt;
use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};

/// Result of a command that completed its work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Exit code 0.
    Good,
    /// Exit code 1: the mesh or file has defects, or the run does not meet its criterion.
    NotGood,
}

/// Why a command could not complete its work, and what to do next. Exit code 2.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// What was found, where, and what was expected.
    pub message: String,
    /// What to do next.
    pub hint: Option<String>,
}

impl Failure {
    /// A failure without a hint.
    pub fn new(message: impl fmt::Display) -> Self {
        Self { message: message.to_string(), hint: None }
    }

    /// Adds a hint.
    pub fn hint(mut self, hint: impl fmt::Display) -> Self {
        self.hint = Some(hint.to_string());
        self
    }
}

/// Maximum number of characters in a line of a message. A longer line is cut in its middle, where a
/// long value is.
const LONGEST: usize = 1200;

/// Makes text from a file safe for a terminal: escapes characters that control the terminal or the
/// direction of text. Line ends stay.
pub fn printable(text: &str) -> Cow<'_, str> {
    let directs =
        |c: char| matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let controls =
        |c: char| c != '\n' && (c.is_control() || directs(c) || matches!(c, '\u{2028}' | '\u{2029}'));
    if !text.contains(controls) {
        return Cow::Borrowed(text);
    }
    let mut clean = String::with_capacity(text.len());
    for c in text.chars() {
        if controls(c) { clean.extend(c.escape_default()) } else { clean.push(c) }
    }
    Cow::Owned(clean)
}

/// Prepares a message for printing: applies [`printable`] and cuts long lines.
pub fn message(text: &str) -> String {
    let cut = |line: &str| {
        let count = line.chars().count();
        if count <= LONGEST {
            return line.to_string();
        }
        let part = |from: usize, length: usize| line.chars().skip(from).take(length).collect::<String>();
        let (head, tail) = (LONGEST * 3 / 4, LONGEST / 4);
        let left_out = count - head - tail;
        format!("{}… ({left_out} characters) …{}", part(0, head), part(count - tail, tail))
    };
    printable(text).split('\n').map(cut).collect::<Vec<_>>().join("\n")
}

fn line(label: &str, colour: &str, text: &str) {
    let text = message(text);
    // An error on stderr is ignored. `anstream` removes the colour when stderr is not a terminal.
    let _ = writeln!(anstream::stderr(), "\x1b[1;{colour}m{label}:\x1b[0m {text}");
}

/// Prints an error of clap: help and version go to stdout. Bad usage goes to stderr, and long
/// arguments in it are cut.
pub fn usage(found: &clap::Error) {
    let plain = found.render().to_string();
    let clean = message(&plain);
    // An error is ignored: stdout or stderr is closed.
    let _ = if clean == plain { found.print() } else { writeln!(io::stderr(), "{clean}") };
}

/// The failure where the system refuses threads.
pub fn no_threads(reason: impl fmt::Display) -> Failure {
    Failure::new(format!("cannot start threads: {reason}"))
        .hint("set the environment variable RAYON_NUM_THREADS to 1; `encode` and `encode-all` have --threads")
}

/// Prints `error:` and `hint:` lines.
pub fn error(failure: &Failure) {
    line("error", "31", &failure.message);
    if let Some(text) = &failure.hint {
        hint(text);
    }
}

/// Prints a `warning:` line.
pub fn warning(text: &str) {
    line("warning", "33", text);
}

/// Prints a `note:` line.
pub fn note(text: &str) {
    line("note", "34", text);
}

/// Prints a `hint:` line.
pub fn hint(text: &str) {
    line("hint", "36", text);
}

/// Whether stdout carries the bytes of an output.
static STDOUT_IS_TAKEN: AtomicBool = AtomicBool::new(false);

/// Sends results to stderr from now on, because stdout carries the bytes of the output (`-o
/// /dev/stdout`).
pub fn leave_stdout_to_the_output() {
    STDOUT_IS_TAKEN.store(true, Ordering::Relaxed);
}

/// Writes a result to stdout, or to stderr when stdout carries the bytes of the output.
///
/// # Errors
/// The result cannot be written. A closed pipe (`| head`) is not an error.
pub fn result(bytes: &[u8]) -> Result<(), Failure> {
    let (name, out): (_, &mut dyn Write) = match STDOUT_IS_TAKEN.load(Ordering::Relaxed) {
        true => ("stderr", &mut io::stderr()),
        false => ("stdout", &mut io::stdout()),
    };
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::new(format!("cannot write to {name}: {e}")))
        }
        _ => Ok(()),
    }
}

/// Writes a text result to stdout.
///
/// # Errors
/// The same errors as [`result`].
pub fn text(text: &str) -> Result<(), Failure> {
    result(printable(text).as_bytes())
}

/// Writes `value` to stdout as indented JSON.
///
/// # Errors
/// The same errors as [`result`].
pub fn json(value: &impl serde::Serialize) -> Result<(), Failure> {
    result((to_json(value)? + "\n").as_bytes())
}

/// `value` as indented JSON.
///
/// # Errors
/// It has none.
pub fn to_json(value: &impl serde::Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(value).map_err(|e| Failure::new(format!("cannot write JSON: {e}")))
}

/// Writes names and values to stdout in two columns.
///
/// # Errors
/// The same errors as [`result`].
pub fn table<N: AsRef<str>, V: fmt::Display>(rows: &[(N, V)]) -> Result<(), Failure> {
    text(&columns(rows))
}

/// Names and values in two columns.
pub fn columns<N: AsRef<str>, V: fmt::Display>(rows: &[(N, V)]) -> String {
    let width = rows.iter().map(|(name, _)| name.as_ref().chars().count()).max().unwrap_or(0);
    // A value from a file may contain line ends, which would look like new rows.
    let row =
        |name: &str, value: &V| format!("{name:<width$}  {value}").trim_end().replace('\n', "\\n") + "\n";
    rows.iter().map(|(name, value)| row(name.as_ref(), value)).collect()
}

/// A number with its noun: `1 face`, `2 faces`.
pub fn count(number: usize, word: &str) -> String {
    let plural = match word.strip_suffix("ex") {
        Some(stem) => format!("{stem}ices"),
        None => format!("{word}s"),
    };
    format!("{number} {}", if number == 1 { word } else { &plural })
}

/// Formats a point for users.
pub fn point(p: tesdf::glam::DVec3) -> String {
    format!("{:.6e} {:.6e} {:.6e}", p.x, p.y, p.z)
}

/// Formats a number of bytes for users, in powers of 1000.
pub fn size(bytes: usize) -> String {
    match bytes as f64 {
        b if b < 1e3 => count(bytes, "byte"),
        b if b < 1e6 => format!("{:.2} kB", b / 1e3),
        b if b < 1e9 => format!("{:.3} MB", b / 1e6),
        b => format!("{:.3} GB", b / 1e9),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_are_escaped() {
        let hostile = "a\u{1b}[31mb\u{7}\r\u{9b}0m\u{202e}txt\u{0}é\n…";
        let clean = printable(hostile);
        assert_eq!(clean, "a\\u{1b}[31mb\\u{7}\\r\\u{9b}0m\\u{202e}txt\\u{0}é\n…");
        assert!(matches!(printable("µm, 3 × 4\n"), Cow::Borrowed(_)));
    }

    #[test]
    fn long_lines_are_cut_in_their_middle() {
        let long = format!("field {} is unknown\nexpected another", "é".repeat(100_000));
        let cut = message(&long);
        assert!(
            cut.len() < 4000
                && cut.starts_with("field éé")
                && cut.ends_with("é is unknown\nexpected another")
        );
        assert!(cut.contains("98817 characters"), "{cut}");
        assert_eq!(message("short"), "short");
    }

    #[test]
    fn counted_nouns_are_singular_or_plural() {
        assert_eq!(
            [count(1, "vertex"), count(2, "vertex"), count(0, "face")],
            ["1 vertex", "2 vertices", "0 faces"]
        );
        assert_eq!([size(1), size(1500), size(2_345_678)], ["1 byte", "1.50 kB", "2.346 MB"]);
    }
}
