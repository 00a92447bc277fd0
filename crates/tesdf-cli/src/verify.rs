//! `tesdf verify FILE`
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use serde::Serialize;
use tesdf::TeSdf;
use tesdf::asset::{AssetError, Container, layout};
use tesdf::verify::{PrecisionReport, VerifyOptions, VerifyReport, Worst, verify};

use crate::asset_file;
use crate::progress::Progress;
use crate::report::{self, Failure, Outcome, count};

/// Arguments of `tesdf verify`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// A .tesdf file
    pub file: PathBuf,
    /// Number of points that are compared with brute force
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    pub samples: u32,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Report {
    file: String,
    passed: bool,
    /// Whether the structure and every checksum are right; the comparison is made only then.
    intact: bool,
    /// Why the file failed before the comparison.
    error: Option<String>,
    comparison: Option<VerifyReport>,
}

/// Compares a file with its checksums, then its answers with brute force, and prints what was found.
///
/// # Errors
/// The file cannot be read or is not a `.tesdf` file of this version, or stdout cannot be written. A file that is one but is
/// damaged is a result: it is not good.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let file = args.file.display().to_string();
    let asset = match open_intact(&args.file) {
        Ok(asset) => asset,
        Err(e @ (AssetError::Io { .. } | AssetError::NotTesdf { .. } | AssetError::Version { .. })) => {
            return Err(asset_file::failure(&args.file, &e));
        }
        Err(e) => {
            return finish(
                args,
                Report { file, passed: false, intact: false, error: Some(e.to_string()), comparison: None },
            );
        }
    };
    let bar = Progress::new("comparing with brute force");
    let options = VerifyOptions { samples: args.samples as usize, ..VerifyOptions::default() };
    let found = verify(&asset, &options, |share| {
        bar.set(share);
        ControlFlow::Continue(())
    });
    drop(bar);
    let (comparison, error) = match found {
        Ok(found) => (Some(found), None),
        Err(e) => (None, Some(e.to_string())),
    };
    let passed = comparison.as_ref().is_some_and(|c| c.passed);
    finish(args, Report { file, passed, intact: true, error, comparison })
}

/// Opens a file after every byte was compared with the checksums: what opening looks at more closely is then as written.
fn open_intact(path: &Path) -> Result<TeSdf, AssetError> {
    Container::open(path, &layout::SECTIONS)?.verify_checksums()?;
    TeSdf::open(path)
}

fn finish(args: &Args, report: Report) -> Result<Outcome, Failure> {
    if args.json {
        report::json(&report)?;
    } else {
        report::result(text(&report).as_bytes())?;
    }
    Ok(if report.passed { Outcome::Good } else { Outcome::NotGood })
}

fn text(report: &Report) -> String {
    let mut text = match (&report.error, report.intact) {
        (Some(e), false) => format!("failed: {}: {e}\n", report.file),
        (error, _) => {
            let mut text = format!("{}: every byte matches its checksum\n", report.file);
            if let Some(e) = error {
                text += &format!("failed: {e}\n");
            }
            text
        }
    };
    if let Some(found) = &report.comparison {
        text += &format!(
            "{} against {} each, winding numbers of {} without any tree ({} differ)\n",
            count(found.samples, "point"),
            count(found.faces, "face"),
            count(found.winding_brute_force, "point"),
            found.winding_disagreements
        );
        found.precisions.iter().for_each(|precision| text += &precision_text(precision));
    }
    text + if report.passed { "passed\n" } else { "not passed\n" }
}

fn precision_text(p: &PrecisionReport) -> String {
    let promised = match p.promise.ulps {
        0.0 => format!("{:e} promised", p.promise.of_diagonal),
        ulps => format!("{:e} and {ulps} ulp of the largest coordinate promised", p.promise.of_diagonal),
    };
    let mut text = format!(
        "{}: {}\n  largest error   {:.3e} = {:.2e} of the diagonal; {promised}\n",
        p.precision,
        if p.passed { "as promised" } else { "NOT as promised" },
        p.largest_error,
        p.largest_error_of_diagonal,
    );
    text += &place(p.worst.as_ref().filter(|_| p.largest_error > 0.0));
    text += &format!("  sign mistakes   {}\n", p.sign_mistakes);
    text += &place(p.worst_sign.as_ref());
    text += &format!(
        "  gradients       {}, largest angle {:.1e} rad from {:e} of the diagonal on; {:e} promised\n",
        count(p.gradient_mistakes, "mistake"),
        p.largest_gradient_error,
        p.promise.gradient_from,
        p.promise.gradient
    );
    if p.gradient_mistakes > 0 {
        text += &place(p.worst_gradient.as_ref());
    }
    text += "    points                       largest error\n";
    let classes = p.classes.iter().filter(|c| c.points > 0);
    classes.for_each(|c| {
        text += &format!(
            "    {:<20} {:>7}   {:.1e}\n",
            c.class.name(),
            count(c.points, "point"),
            c.largest_error
        );
    });
    text
}

fn place(worst: Option<&Worst>) -> String {
    worst.map_or(String::new(), |w| {
        let [x, y, z] = w.point;
        let Worst { expected, found, face, .. } = w;
        format!(
            "                  at {x:?},{y:?},{z:?} ({}), expected {expected:?}, found {found:?}, face {face} (0-based)\n",
            w.class.name()
        )
    })
}
