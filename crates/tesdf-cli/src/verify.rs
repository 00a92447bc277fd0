//! `tesdf verify FILE`: checks a file against its checksums and its distances against brute force.
mod proof;

use std::num::NonZeroU64;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use serde::Serialize;
use tesdf::TeSdf;
use tesdf::asset::AssetError;
use tesdf::verify::{PrecisionReport, ProveReport, VerifyError, VerifyOptions, VerifyReport, Worst, verify};

use crate::terminal::asset_file;
use crate::terminal::interrupt;
use crate::terminal::parse;
use crate::terminal::progress::Bar;
use crate::terminal::report::{self, Failure, Outcome, count};

/// Arguments of `tesdf verify`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// A .tesdf file
    #[arg(value_parser = parse::input())]
    pub file: PathBuf,
    /// Number of points at which the file is compared with brute force
    ///
    /// A file that certifies nothing, such as an imported one, is also compared at four points
    /// inside each of its cells, but at no more than four times N in all. If an answer is wrong by
    /// more than rounding, it does not pass. Only --prove tells of all points.
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(1..))]
    pub samples: u32,
    /// Also prove, cell by cell and by independent code, that the lists, the signs and the face
    /// tree are right
    ///
    /// It proves two claims for every cell. First, at no point of the cell is a face outside of the
    /// cell's list closer than the list by more than the δ of the certificate. Second, the sign is
    /// right in the whole cell. The proof shares the layout of the file, the corners of the cells
    /// and exact predicates with the encoder, but neither its rules nor its trees. It does not
    /// cover single precision, the search for a point's cell, and the sign hints of faces; the
    /// comparison with brute force tests these. A cell is proved, refuted (with a point where the
    /// list is wrong) or undecided. The exit code is 0 only if all cells are proved.
    #[arg(long)]
    pub prove: bool,
    /// Maximum number of pieces into which --prove divides a cell before the cell is undecided
    /// [default: 1048576]
    #[arg(long, value_name = "N", requires = "prove")]
    pub pieces: Option<NonZeroU64>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// The output of `--json`.
#[derive(Serialize)]
struct Report {
    file: String,
    passed: bool,
    /// Whether the structure and every checksum are right. Only then is the file compared with
    /// brute force.
    intact: bool,
    /// Why the file failed before the comparison.
    error: Option<String>,
    comparison: Option<VerifyReport>,
    /// The result of `--prove`.
    prove: Option<ProveReport>,
}

/// Checks the checksums of a file, compares its answers with brute force, and prints the result.
///
/// # Errors
/// The file cannot be read or is not a `.tesdf` file of this version, or stdout cannot be written.
/// A damaged `.tesdf` file is not an error but a result, with exit code 1.
pub fn run(args: &Args) -> Result<Outcome, Failure> {
    let file = args.file.display().to_string();
    let asset = match asset_file::open_intact(&args.file) {
        Ok(asset) => asset,
        Err(
            e @ (AssetError::Io { .. }
            | AssetError::Memory { .. }
            | AssetError::NotTesdf { .. }
            | AssetError::Version { .. }),
        ) => {
            return Err(asset_file::failure(&args.file, &e));
        }
        Err(e) => {
            return finish(
                args,
                Report {
                    file,
                    passed: false,
                    intact: false,
                    error: Some(e.to_string()),
                    comparison: None,
                    prove: None,
                },
            );
        }
    };
    let interrupted = interrupt::flag();
    let (comparison, mut error) = match compare(args, &asset, interrupted)? {
        Ok(found) => (Some(found), None),
        Err(e) => (None, Some(e.to_string())),
    };
    let mut passed = comparison.as_ref().is_some_and(|c| c.passed);
    let mut prove = None;
    if args.prove {
        match proof::run(args, &asset, interrupted)? {
            Ok(found) => {
                passed &= found.proved;
                prove = Some(found);
            }
            Err(e) => {
                passed = false;
                error = error.or(Some(e.to_string()));
            }
        }
    }
    finish(args, Report { file, passed, intact: true, error, comparison, prove })
}

/// Compares answers with brute force.
fn compare(
    args: &Args,
    asset: &TeSdf,
    interrupted: &AtomicBool,
) -> Result<Result<VerifyReport, VerifyError>, Failure> {
    let bar = Bar::new("comparing with brute force");
    let options = VerifyOptions { samples: args.samples as usize, ..VerifyOptions::default() };
    let found = verify(asset, &options, |share| show_progress(&bar, share, interrupted));
    uninterrupted(interrupted)?;
    Ok(found)
}

/// Shows the completed fraction, and stops the work after Ctrl-C.
fn show_progress(bar: &Bar, share: f64, interrupted: &AtomicBool) -> ControlFlow<()> {
    bar.set(share);
    if interrupted.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
}

fn uninterrupted(interrupted: &AtomicBool) -> Result<(), Failure> {
    match interrupted.load(Ordering::Relaxed) {
        true => Err(Failure::new("interrupted; there is no result")),
        false => Ok(()),
    }
}

fn finish(args: &Args, report: Report) -> Result<Outcome, Failure> {
    if args.json {
        report::json(&report)?;
    } else {
        report::text(&text(&report))?;
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
        if !found.certified {
            text += &format!(
                "the file certifies nothing: {} more inside {} of {} with a list\n",
                count(found.cell_points, "point"),
                found.cells,
                count(found.listed_cells, "cell")
            );
        }
        found.precisions.iter().for_each(|precision| text += &precision_text(precision, found.certified));
    }
    if let Some(found) = &report.prove {
        text += &proof::text(found);
    }
    let is_open = report.comparison.as_ref().is_some_and(|c| !c.certified) && report.prove.is_none();
    text + match (report.passed, is_open) {
        (true, false) => "passed\n",
        (true, true) => "passed at these points; --prove tells of all points\n",
        (false, _) => "not passed\n",
    }
}

fn precision_text(p: &PrecisionReport, certified: bool) -> String {
    let bound = match p.promise.ulps {
        0.0 => format!("{:e}", p.promise.of_diagonal),
        ulps => format!("{:e} and {ulps} ulp of the largest coordinate", p.promise.of_diagonal),
    };
    let compared: usize = p.classes.iter().map(|c| c.points).sum();
    let verdict = match (certified, p.passed) {
        (true, true) if compared == 0 => {
            "signs as promised; no point is so near that its distance is promised"
        }
        (true, true) => "as promised",
        (true, false) => "NOT as promised",
        (false, true) => "nothing is promised; right at these points",
        (false, false) => "nothing is promised; WRONG",
    };
    let mut text = format!("{}: {verdict}\n", p.precision);
    if compared > 0 {
        text += &format!(
            "  largest error   {:.3e} = {:.2e} of the diagonal; {bound} {}\n",
            p.largest_error,
            p.largest_error_of_diagonal,
            if certified { "promised" } else { "allowed" }
        );
        text += &place(p.worst.as_ref().filter(|_| p.largest_error > 0.0));
    }
    if p.distance_mistakes > 0 {
        text +=
            &format!("  distances       wrong at {} of {}\n", p.distance_mistakes, count(compared, "point"));
    }
    if let Some(beyond) = p.largest_error_beyond.filter(|_| certified) {
        let within = p.promise.within.unwrap_or_default();
        text += &format!(
            "  farther out     largest error {beyond:.3e} from {within:e} on, where lists are cut and nothing is promised\n"
        );
    }
    text += &format!("  sign mistakes   {}\n", p.sign_mistakes);
    text += &place(p.worst_sign.as_ref());
    text += &format!(
        "  gradients       {}, largest angle {:.1e} rad from {:e} of the diagonal on; {:e} {}\n",
        count(p.gradient_mistakes, "mistake"),
        p.largest_gradient_error,
        p.promise.gradient_from,
        p.promise.gradient,
        if certified { "promised" } else { "allowed" }
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
