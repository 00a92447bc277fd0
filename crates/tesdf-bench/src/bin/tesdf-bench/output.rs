//! Markdown on stdout, line by line, so that a long run shows what it has.
use std::io::{self, Write};

use crate::Failure;

/// Prints a line at once.
pub fn line(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    writeln!(out, "{text}")
        .and_then(|()| out.flush())
        .map_err(|e| format!("cannot write to stdout: {e}").into())
}

/// Begins a table. The first columns of text, as many as `text`, are aligned left, the others right.
pub fn head(columns: &[&str], text: usize) -> Result<(), Failure> {
    line(&format!("| {} |", columns.join(" | ")))?;
    let rules: Vec<&str> = (0..columns.len()).map(|i| if i < text { "---" } else { "---:" }).collect();
    line(&format!("|{}|", rules.join("|")))
}

/// Prints a row of the table begun last.
pub fn row(cells: &[String]) -> Result<(), Failure> {
    line(&format!("| {} |", cells.join(" | ")))
}

/// Megabytes of 10^6 bytes.
pub fn mb(bytes: usize) -> String {
    format!("{:.3}", bytes as f64 / 1e6)
}

/// A share in percent.
pub fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}
