//! Commands that take several files.
use std::path::{Path, PathBuf};

use serde::Serialize;
use tesdf::glam::DMat3;
use tesdf_sim::MassProperties;

use crate::terminal::report::{self, Failure, Outcome};

/// What a command found of one file.
pub struct Found {
    /// Whether it is good.
    pub outcome: Outcome,
    /// Its result: text, or one JSON object.
    pub result: String,
    /// What to do next.
    pub hint: Option<String>,
}

/// Prints what `one` finds of each file. JSON of one file is an object, and that of several a list of
/// them. A file that cannot be read does not stop the others: its error goes to stderr, and in JSON
/// it has `error` in place of a result.
///
/// # Errors
/// Files cannot be read, or stdout cannot be written.
pub fn each(
    files: &[PathBuf],
    json: bool,
    one: impl Fn(&Path) -> Result<Found, Failure>,
) -> Result<Outcome, Failure> {
    if let [file] = files {
        let found = one(file)?;
        print(&found.result, json)?;
        found.hint.iter().for_each(|hint| report::hint(hint));
        return Ok(found.outcome);
    }
    let (mut worst, mut failed, mut list) = (Outcome::Good, 0, Vec::new());
    for (k, file) in files.iter().enumerate() {
        match one(file) {
            Ok(Found { outcome, result, hint }) => {
                if outcome == Outcome::NotGood {
                    worst = Outcome::NotGood;
                }
                if json {
                    list.push(result);
                } else {
                    print(&format!("{}{result}", if k > 0 { "\n" } else { "" }), false)?;
                }
                hint.iter().for_each(|hint| report::hint(hint));
            }
            Err(failure) => {
                failed += 1;
                report::error(&failure);
                let (file, error) = (file.display().to_string(), failure.message);
                list.push(report::to_json(&Unread { file, error })?);
            }
        }
    }
    if json {
        let indented = |one: &String| format!("  {}", one.trim_end().replace('\n', "\n  "));
        let all: Vec<_> = list.iter().map(indented).collect();
        print(&format!("[\n{}\n]\n", all.join(",\n")), true)?;
    }
    match failed {
        0 => Ok(worst),
        _ => Err(Failure::new(format!("{failed} of {} files cannot be read", files.len()))),
    }
}

/// The JSON of a file that cannot be read.
#[derive(Serialize)]
struct Unread {
    file: String,
    error: String,
}

fn print(result: &str, json: bool) -> Result<(), Failure> {
    match json {
        true => report::result(result.as_bytes()),
        false => report::text(result),
    }
}

/// The solid that faces enclose, each place as often as the faces wind around it, with the density
/// 1 in the mesh's unit.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Solid {
    volume: f64,
    center_of_mass: [f64; 3],
    /// About the centre of mass, along the axes of the mesh: xx, yy, zz, xy, xz, yz.
    inertia: [f64; 6],
}

impl Solid {
    /// That of properties of density 1.
    pub fn of(MassProperties { mass, center, inertia }: MassProperties) -> Self {
        let DMat3 { x_axis: x, y_axis: y, z_axis: z } = inertia;
        let inertia = [x.x, y.y, z.z, x.y, x.z, y.z];
        Self { volume: mass, center_of_mass: center.to_array(), inertia }
    }

    /// Its rows in a table of text. `unit` follows a space.
    pub fn rows(&self, unit: &str) -> [(&'static str, String); 3] {
        let numbers = |of: &[f64]| of.iter().map(|x| format!("{x:.6e}")).collect::<Vec<_>>().join(" ");
        let power = |k: u32| if unit.is_empty() { String::new() } else { format!("{unit}^{k}") };
        [
            ("volume", format!("{:.6e}{}", self.volume, power(3))),
            ("centre of mass", format!("{}{unit}", numbers(&self.center_of_mass))),
            ("inertia", format!("{}{} (xx yy zz xy xz yz, density 1)", numbers(&self.inertia), power(5))),
        ]
    }
}
