//! `tesdf-bench exactness`: largest errors and sign mistakes against brute force.

use std::ops::ControlFlow;

use tesdf::verify::{PointClass, VerifyOptions, verify};

use crate::input::{Input, MeshesAndPoints};
use crate::{Failure, heading, output};

const COLUMNS: [&str; 11] = [
    "mesh",
    "as promised",
    "faces",
    "error / diagonal, f32",
    "error / promise, f32",
    "sign mistakes, f32",
    "gradient mistakes, f32",
    "error / diagonal, f64",
    "error / promise, f64",
    "sign mistakes, f64",
    "gradient mistakes, f64",
];

pub fn run(args: &MeshesAndPoints) -> Result<(), Failure> {
    heading::print()?;
    let classes = PointClass::ALL.map(PointClass::name).join(", ");
    output::line(&format!(
        "Preset `{}`, {} points for each mesh, seed {}: {classes}. Against all faces of the mesh, without a tree, in f64, \
         and winding numbers. *Promise*: f32 1e-6 × diagonal; f64 1e-12 × diagonal plus 4 ulp of the largest coordinate of \
         mesh and point; signs count beyond that. Errors are the largest of all points; far outside the 4 ulp may be more than \
         1e-12 × diagonal.\n",
        args.preset.name(),
        args.points,
        args.seed
    ))?;
    output::head(&COLUMNS, 2)?;
    let mut broken = Vec::new();
    for path in &args.meshes {
        let input = Input::read(path)?;
        let (asset, _) = input.encode(&args.preset.options())?;
        let options = VerifyOptions { samples: args.points as usize, seed: args.seed };
        let report = verify(&asset, &options, |_| ControlFlow::Continue(()))
            .map_err(|e| format!("{}: {e}", path.display()))?;
        let passed = if report.passed { "yes" } else { "**no**" };
        let mut cells = vec![input.name.clone(), passed.into(), report.faces.to_string()];
        for p in &report.precisions {
            cells.extend([
                format!("{:.1e}", p.largest_error_of_diagonal),
                format!("{:.2}", p.largest_error_of_promise),
                p.sign_mistakes.to_string(),
                p.gradient_mistakes.to_string(),
            ]);
        }
        output::row(&cells)?;
        if !report.passed {
            broken.push(input.name);
        }
    }
    match broken.as_slice() {
        [] => Ok(()),
        names => Err(format!("not as promised: {}", names.join(", ")).into()),
    }
}
