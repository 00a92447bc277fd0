//! Tries repairs, and takes the first one that works.
use std::fmt;
use std::str::FromStr;

use super::{
    Draft, RepairError, RepairOptions, RepairReport, Repaired, ShellOrientation, close, closing_tolerance,
    fill::area,
};
use crate::mesh::{TriangleMesh, hairs::hairs};

/// Holes are filled only if the fillings are smaller than this share of the given surface. A
/// surface with larger ones is rather a sheet than a solid with holes: the lid of a half sphere is
/// half as large as the sphere's surface, and that of a flat sheet as large as the sheet.
const LARGEST_FILLING: f64 = 0.75;

/// Whether a mesh is repaired before it is used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RepairMode {
    /// A mesh is used as it is. One without a well-defined inside is refused.
    #[default]
    Never,
    /// [`repair_auto`].
    Auto,
}

impl FromStr for RepairMode {
    type Err = UnknownRepair;

    /// `never` or `auto`.
    fn from_str(text: &str) -> Result<Self, UnknownRepair> {
        match text {
            "never" => Ok(Self::Never),
            "auto" => Ok(Self::Auto),
            _ => Err(UnknownRepair(text.into())),
        }
    }
}

/// A text that names no [`RepairMode`].
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("repair = '{0}'; expected 'auto' or 'never'")]
pub struct UnknownRepair(String);

/// The result of [`repair_auto`].
#[derive(Clone, Debug, PartialEq)]
pub struct AutoRepaired {
    /// The options that worked. [`repair`](super::repair) with them gives the same mesh. `None`
    /// when the mesh is encodable as it is.
    pub options: Option<RepairOptions>,
    /// The repaired mesh, and all changes.
    pub repaired: Repaired,
}

/// Makes a mesh encodable with the least effort that works. `None` when no repair works.
///
/// The attempts, in this order, end with the first that makes the mesh encodable:
/// - no repair, unless faces without area stand out of the surface;
/// - [`RepairOptions::DEFAULT`]: duplicates, T-junctions, and the orientation of faces and shells;
/// - the orientation of shells that meet others ([`ShellOrientation::All`]);
/// - welding with the [`closing_tolerance`];
/// - both;
/// - filling holes as well, with welding and then without.
///
/// Holes are not filled when the fillings would be as large as three quarters of the surface: that
/// is rather a sheet than a solid with holes.
///
/// # Errors
/// [`RepairError`] when a coordinate is out of range. Attempts that fail otherwise are passed over.
pub fn repair_auto(mesh: &TriangleMesh) -> Result<Option<AutoRepaired>, RepairError> {
    let untouched = Draft::of(mesh);
    if untouched.is_closed() {
        let repaired = untouched.check(RepairReport::default())?;
        if repaired.report.encodable {
            let as_it_is = AutoRepaired { options: None, repaired };
            if hairs(mesh.vertices(), mesh.faces()).is_empty() {
                return Ok(Some(as_it_is));
            }
            return Ok(Some(match attempt(mesh, &RepairOptions::DEFAULT) {
                Ok(Attempt::Works(found)) => *found,
                Ok(_) | Err(_) => as_it_is,
            }));
        }
    }
    match attempt(mesh, &RepairOptions::DEFAULT) {
        Ok(Attempt::Works(found)) => return Ok(Some(*found)),
        Err(error @ RepairError::OutOfRange(_)) => return Err(error),
        Ok(_) | Err(_) => {}
    }
    let weld_tolerance = closing_tolerance(mesh);
    let default = RepairOptions::DEFAULT;
    let welded = RepairOptions { weld_tolerance, ..default };
    let all = |options: RepairOptions| RepairOptions { shells: ShellOrientation::All, ..options };
    let filled = |options: RepairOptions| RepairOptions { fill_holes: Some(u32::MAX), ..options };
    let mut attempts = vec![all(default)];
    if weld_tolerance.is_some() {
        attempts.extend([welded, all(welded), filled(welded), filled(all(welded))]);
    }
    attempts.extend([filled(default), filled(all(default))]);
    for options in attempts {
        // An attempt may leave no face. The next one does without its step.
        match attempt(mesh, &options) {
            Ok(Attempt::Works(found)) => return Ok(Some(*found)),
            Ok(Attempt::FillsTooMuch) => return Ok(None),
            Ok(Attempt::Fails) | Err(_) => {}
        }
    }
    Ok(None)
}

/// What came of an attempt.
enum Attempt {
    Works(Box<AutoRepaired>),
    /// The holes are too large, as they are for other options.
    FillsTooMuch,
    Fails,
}

fn attempt(mesh: &TriangleMesh, options: &RepairOptions) -> Result<Attempt, RepairError> {
    let closed = close(mesh, options)?;
    if fills_too_much(mesh, &closed.report) {
        return Ok(Attempt::FillsTooMuch);
    }
    // The rest is long, and a mesh that is not closed does not pass.
    if !closed.draft.is_closed() {
        return Ok(Attempt::Fails);
    }
    let repaired = closed.finish(options)?;
    Ok(match repaired.report.encodable {
        true => Attempt::Works(Box::new(AutoRepaired { options: Some(*options), repaired })),
        false => Attempt::Fails,
    })
}

fn fills_too_much(mesh: &TriangleMesh, report: &RepairReport) -> bool {
    if report.filled_holes.is_empty() {
        return false;
    }
    let surface: f64 = (0..mesh.faces().len()).map(|face| area(mesh.triangle(face))).sum();
    let filled: f64 = report.filled_holes.iter().map(|hole| hole.area).sum();
    filled > LARGEST_FILLING * surface
}

impl fmt::Display for RepairOptions {
    /// The flags of `tesdf repair` that stand for these options, each after a space.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(tolerance) = self.weld_tolerance {
            write!(f, " --weld-tolerance {tolerance:e}")?;
        }
        if self.shells == ShellOrientation::All {
            f.write_str(" --orient")?;
        }
        match self.fill_holes {
            None => Ok(()),
            Some(u32::MAX) => f.write_str(" --fill-holes"),
            Some(edges) => write!(f, " --fill-holes {edges}"),
        }
    }
}
