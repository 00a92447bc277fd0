//! What the summary of a run says of the scene's criteria.
use tesdf_sim::Summary;
use tesdf_sim::criterion::{CriterionReport, Rows};

/// The rows of all criteria.
pub fn rows(summary: &Summary) -> Rows {
    summary.criteria.iter().flat_map(of_one).collect()
}

fn of_one(report: &CriterionReport) -> Rows {
    let not_met = report.failures.iter().map(|failure| ("not met", failure.clone()));
    let verdict = if report.failures.is_empty() { "passed" } else { "not passed" };
    report.rows.iter().cloned().chain(not_met).chain([("criterion", verdict.into())]).collect()
}
