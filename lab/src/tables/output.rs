//! Formats tables as text.
use crate::on_grid::BandReport;
use std::path::PathBuf;

use serde::Serialize;
use tesdf::save::Destination;

use super::{Format, OutputArgs};
use tesdf_cli::terminal::output;
use tesdf_cli::terminal::report::{self, Failure};

/// A table: the names of its columns, and its rows as text.
pub struct Text {
    pub columns: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

impl Text {
    /// Formats the table as Markdown. The first `left` columns are aligned left.
    pub fn markdown(&self, left: usize) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let rules: Vec<&str> =
            (0..self.columns.len()).map(|i| if i < left { "---" } else { "---:" }).collect();
        let rows: String = self.rows.iter().map(|row| line(row)).collect();
        format!("{}|{}|\n{rows}", line(&self.columns), rules.join("|"))
    }

    fn csv(&self) -> Result<Vec<u8>, Failure> {
        let failed = |e: &dyn std::fmt::Display| Failure::new(format!("cannot write CSV: {e}"));
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer.write_record(&self.columns).map_err(|e| failed(&e))?;
        for row in &self.rows {
            writer.write_record(row).map_err(|e| failed(&e))?;
        }
        writer.into_inner().map_err(|e| failed(&e))
    }
}

/// A file in the output folder, which is created if necessary; `None` without such a folder.
///
/// # Errors
/// The file cannot be written, or is one of the inputs.
pub fn open_in_folder(
    args: &OutputArgs,
    name: &str,
    inputs: &[PathBuf],
) -> Result<Option<Destination>, Failure> {
    let Some(folder) = &args.output else { return Ok(None) };
    std::fs::create_dir_all(folder)
        .map_err(|e| Failure::new(format!("cannot make the folder {}: {e}", folder.display())))?;
    output::open(&folder.join(name), inputs, args.consent).map(Some)
}

/// The destination of a table.
pub enum Sink {
    Stdout(Format),
    /// JSON, CSV and Markdown files.
    Files([Destination; 3]),
}

impl Sink {
    /// The destination in the arguments. Its folder is created if necessary. `inputs` are files
    /// that must not be replaced.
    ///
    /// # Errors
    /// A file cannot be written, or is one of the inputs.
    pub fn open(args: &OutputArgs, name: &str, inputs: &[PathBuf]) -> Result<Self, Failure> {
        let open = |extension| open_in_folder(args, &format!("{name}.{extension}"), inputs);
        match (open("json")?, open("csv")?, open("md")?) {
            (Some(json), Some(csv), Some(md)) => Ok(Self::Files([json, csv, md])),
            _ => Ok(Self::Stdout(args.format)),
        }
    }

    /// Prints a table in the chosen format, or writes it in all formats. Markdown is printed as
    /// given; CSV and JSON have all figures.
    ///
    /// # Errors
    /// Stdout or a file cannot be written.
    pub fn print<T: Serialize>(&self, json: &T, csv: &Text, markdown: &str) -> Result<(), Failure> {
        let files = match self {
            Self::Stdout(Format::Json) => return report::json(json),
            Self::Stdout(Format::Csv) => return report::result(&csv.csv()?),
            Self::Stdout(Format::Md) => return report::text(markdown),
            Self::Files(files) => files,
        };
        let mut text =
            serde_json::to_vec_pretty(json).map_err(|e| Failure::new(format!("cannot write JSON: {e}")))?;
        text.push(b'\n');
        for (file, bytes) in files.iter().zip([text, csv.csv()?, markdown.as_bytes().to_vec()]) {
            output::write(file, &bytes)?;
        }
        Ok(())
    }
}

/// Formats a number with at most three significant digits.
pub fn short(value: f64) -> String {
    let magnitude = value.abs().log10().floor();
    match magnitude {
        _ if value == 0.0 => "0".into(),
        m if (-3.0..3.0).contains(&m) => {
            let decimals = (2.0 - m).max(0.0) as usize;
            let text = format!("{value:.decimals$}");
            match text.contains('.') {
                true => text.trim_end_matches('0').trim_end_matches('.').into(),
                false => text,
            }
        }
        _ => format!("{value:.1e}"),
    }
}

/// Formats a band, rounded down, so that only a band over the whole solid is 1.
pub fn band(value: f64) -> String {
    short((value * 1e3).floor() / 1e3)
}

/// The largest error in percent, or `0` if it is within the tolerance for exactness.
pub fn error(report: &BandReport) -> Option<String> {
    match report.max_error <= report.exact {
        true => Some("0".into()),
        false => report.max_error_percent.map(short),
    }
}

/// Formats ε of the sampled encoder.
pub fn threshold(epsilon: f64) -> String {
    if epsilon == 0.0 { "0".into() } else { format!("{epsilon:e}") }
}

/// Replaces a missing figure by a dash.
pub fn or_dash(value: Option<String>) -> String {
    value.unwrap_or_else(|| "–".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_three_significant_digits() {
        let texts = [0.0, 1.0, 0.105, 35.71, 123.0, 0.007, 1.23456e-9, 8.9].map(short);
        assert_eq!([0.9999, 1.0, 0.1059].map(band), ["0.999", "1", "0.105"]);
        assert_eq!(texts, ["0", "1", "0.105", "35.7", "123", "0.007", "1.2e-9", "8.9"]);
    }
}
