//! `tesdf verify --prove FILE`: the proof.
use std::sync::atomic::AtomicBool;

use tesdf::TeSdf;
use tesdf::verify::{Fault, ProveError, ProveOptions, ProveReport, Tally, Verdict, prove};

use super::{Args, show_progress, uninterrupted};
use crate::terminal::progress::Bar;
use crate::terminal::report::{Failure, count};

/// Proves the claims of the file's certificate.
///
/// # Errors
/// Ctrl-C was pressed. A file that cannot be proved is a result.
pub fn run(
    args: &Args,
    asset: &TeSdf,
    interrupted: &AtomicBool,
) -> Result<Result<ProveReport, ProveError>, Failure> {
    let bar = Bar::new("proving cell by cell");
    let mut options = ProveOptions::default();
    if let Some(pieces) = args.pieces {
        options.pieces = pieces.get();
    }
    let found = prove(asset, &options, |share| show_progress(&bar, share, interrupted));
    uninterrupted(interrupted)?;
    Ok(found)
}

/// The result as text.
pub fn text(report: &ProveReport) -> String {
    let of = if report.certified {
        "the certificate's"
    } else {
        "of the certified encoder; the file certifies nothing"
    };
    let mut text = format!(
        "proof: {}\n  delta           {:.3e} = {:.2e} of the diagonal, {of}\n",
        if report.proved { "everything is proved" } else { "NOT everything is proved" },
        report.delta,
        report.delta_of_diagonal,
    );
    if let Some(within) = report.within {
        text += &format!("  only within     {within:e} of the surface, because lists are truncated\n");
    }
    text += &tally("distances", "list", &report.distances);
    text += &tally("signs", "label", &report.signs);
    text += &tally("face tree", "tree", &report.face_tree);
    text += &format!(
        "  pieces          {}, at most {} per cell\n",
        count(report.pieces as usize, "piece"),
        report.most_pieces
    );
    if let Some(most) = report.nearer_by {
        let share = most * report.delta_of_diagonal / report.delta;
        text += &format!(
            "  nearer by       {most:.3e} = {share:.2e} of the diagonal at most: what missing faces were found to be\n"
        );
    }
    report.faults.iter().for_each(|fault| text += &fault_text(fault));
    let tallies = [report.distances, report.signs, report.face_tree];
    for (verdict, name) in [(Verdict::Refuted, "refuted"), (Verdict::Undecided, "undecided")] {
        let of = |t: &Tally| if verdict == Verdict::Refuted { t.refuted } else { t.undecided };
        let all: usize = tallies.iter().map(of).sum();
        let listed = report.faults.iter().filter(|f| f.verdict == verdict).count();
        if all > listed {
            text += &format!("  {name}: {} more\n", all - listed);
        }
    }
    if report.out_of_pieces > 0 {
        let lists = count(report.out_of_pieces, "list");
        text += &format!("  undecided does not mean wrong: a larger --pieces may decide {lists}\n");
    }
    text
}

fn tally(name: &str, what: &str, t: &Tally) -> String {
    let Tally { claims, proved, refuted, undecided } = *t;
    format!(
        "  {name:<15} {proved} of {} proved, {refuted} refuted, {undecided} undecided\n",
        count(claims, what)
    )
}

fn fault_text(fault: &Fault) -> String {
    let verdict = match fault.verdict {
        Verdict::Refuted => "refuted",
        Verdict::Undecided => "undecided",
    };
    let mut text = format!("  {verdict}: ");
    if let Some(cell) = fault.cell {
        text += &format!("cell {cell}: ");
    }
    text += &fault.reason;
    if let Some(face) = fault.face {
        text += &format!("; face {face} (0-based)");
    }
    if let Some([x, y, z]) = fault.point {
        text += &format!("; at {x:?},{y:?},{z:?}");
    }
    if let (Some(list), Some(face), Some(by)) = (fault.list_distance, fault.face_distance, fault.nearer_by) {
        text += &format!("; the list is at {list:?}, the face at {face:?}: nearer by {by:.3e}");
    }
    text + "\n"
}
