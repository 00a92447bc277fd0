//! Markdown tables on stdout. Each line is printed at once, so a long run shows its results so far.
use std::io::{self, Write};

use super::Failure;

/// Prints a line and flushes stdout.
pub fn line(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    writeln!(out, "{text}")
        .and_then(|()| out.flush())
        .map_err(|e| format!("cannot write to stdout: {e}").into())
}

/// Prints the head of a table. The first `text` columns are aligned left, the others right.
pub fn head(columns: &[&str], text: usize) -> Result<(), Failure> {
    line(&format!("| {} |", columns.join(" | ")))?;
    let rules: Vec<&str> = (0..columns.len()).map(|i| if i < text { "---" } else { "---:" }).collect();
    line(&format!("|{}|", rules.join("|")))
}

/// Prints a row of the table.
pub fn row(cells: &[String]) -> Result<(), Failure> {
    line(&format!("| {} |", cells.join(" | ")))
}

/// Formats bytes as megabytes of 10^6 bytes.
pub fn mb(bytes: usize) -> String {
    format!("{:.3}", bytes as f64 / 1e6)
}

/// Formats a fraction in percent.
pub fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}
