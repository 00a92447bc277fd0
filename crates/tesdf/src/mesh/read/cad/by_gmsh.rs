//! Runs Gmsh on a CAD file.
use std::fs;

use super::surface::Surface;
use super::{CadError, CadOptions};
use crate::base::{Length, Progress};
use crate::input;
use crate::mesh::read::{MeshFormat, Places, RawMesh, ReadError};
use crate::program::{Gmsh, Printed, ProgramError, RunError};

const SCRIPT: &str = "surface.geo";
const RESULT: &str = "surface.msh";
const NAMES: &str = "names.xao";

/// Runs of Gmsh, each with more edges around curves.
const MAX_RUNS: usize = 6;
/// Smallest and largest number of edges around a circle.
const TURN: [f64; 2] = [12.0, 20_000.0];

pub(in crate::mesh::read) fn parse(
    bytes: &[u8],
    format: MeshFormat,
    options: &CadOptions,
) -> Result<RawMesh, ReadError> {
    for (what, found) in [("mesh size", options.mesh_size), ("deviation", options.deviation)] {
        let (Length::OfDiagonal(value) | Length::Absolute(value)) = found;
        if !(value > 0.0 && value.is_finite()) {
            return Err(CadError::Length { what, found }.into());
        }
    }
    let gmsh = Gmsh::new(options.executable.as_deref()).map_err(CadError::Program)?;
    let model = format!("model.{}", format.extension());
    gmsh.write(&model, bytes).map_err(CadError::Program)?;
    let mut turn = first_turn(options.deviation);
    let mut runs = 1;
    let (surface, printed, deviation) = loop {
        let (surface, printed) = run(&gmsh, &model, format, options, turn as u32)?;
        let wanted = options.deviation.resolve(surface.diagonal());
        let measured = surface.deviation();
        if measured <= wanted {
            break (surface, printed, measured);
        }
        if runs == MAX_RUNS || turn >= TURN[1] {
            return Err(CadError::Deviation { measured, wanted, turn: turn as u32 }.into());
        }
        // The distance falls with the square of the length of the edges.
        turn = (turn * (measured / wanted).sqrt().clamp(1.0, 8.0) * 1.2).ceil().min(TURN[1]);
        runs += 1;
    };
    let names = names(&gmsh, surface.volumes.len());
    let mut raw = assemble(&surface, names);
    if format != MeshFormat::Brep {
        // OpenCASCADE converts the unit of the file.
        raw.unit = Some("mm");
    }
    raw.notes.push(format!(
        "Gmsh {} made the triangles, with {turn} edges around a circle; their edges are at most {deviation:.2e} from the \
         curved surface",
        printed.version().unwrap_or("of an unknown version"),
    ));
    Ok(raw)
}

/// Edges around a circle such that the middle of an edge of a circle of an eighth of the diagonal
/// is as far from it as wanted: π² r / (2 n²).
fn first_turn(deviation: Length) -> f64 {
    let share = match deviation {
        Length::OfDiagonal(share) => share,
        // The diagonal is not known yet.
        Length::Absolute(_) => 1e-3,
    };
    (std::f64::consts::PI * (0.125 / (2.0 * share)).sqrt()).ceil().clamp(TURN[0], TURN[1])
}

fn run(
    gmsh: &Gmsh,
    model: &str,
    format: MeshFormat,
    options: &CadOptions,
    turn: u32,
) -> Result<(Surface, Printed), ReadError> {
    let size = match options.mesh_size {
        Length::Absolute(size) => format!("{size:e}"),
        Length::OfDiagonal(share) => format!(
            "{share:e} * Sqrt((General.MaxX - General.MinX)^2 + (General.MaxY - General.MinY)^2 + \
             (General.MaxZ - General.MinZ)^2)"
        ),
    };
    // OpenCASCADE converts IGES to millimetres by itself. Its faces have curves of their own, so
    // seams stay open: of a ball and a ring, Gmsh 4.15 loses the walls of the ring with
    // `Coherence`, and the ball with `Geometry.OCCSewFaces`.
    let unit = match format {
        MeshFormat::Step => "Geometry.OCCTargetUnit = \"MM\";\n",
        _ => "",
    };
    let script = format!(
        "SetFactory(\"OpenCASCADE\");\nGeneral.NumThreads = 1;\nGeometry.OCCImportLabels = 1;\n\
         {unit}Merge \"{model}\";\nSave \"{NAMES}\";\nBoundingBox;\n\
         Mesh.MeshSizeMax = {size};\nMesh.MeshSizeFromCurvature = {turn};\nMesh.SaveAll = 1;\n\
         Mesh.MshFileVersion = 4.1;\nMesh.Binary = 0;\n"
    );
    gmsh.write(SCRIPT, script).map_err(CadError::Program)?;
    let arguments = [SCRIPT, "-2", "-order", "2", "-o", RESULT, "-nt", "1", "-v", "4"];
    let printed = gmsh.run(&arguments, options.time_limit, &Progress::default()).map_err(|e| match e {
        RunError::Program(error) => CadError::Program(error),
        RunError::TimeLimit => CadError::TimeLimit(options.time_limit),
        // Nobody can cancel this run.
        RunError::Cancelled => CadError::Failed("it was cancelled".into()),
    })?;
    let result = gmsh.path(RESULT);
    if let Some(said) = printed.first_error() {
        return Err(CadError::Failed(said).into());
    }
    if !result.exists() {
        return Err(CadError::Failed(gmsh.why_no_result(&printed).map_err(CadError::Program)?).into());
    }
    let folder = |e| CadError::Program(ProgramError::Folder(e));
    let bytes = input::read(&result).map_err(folder)?;
    let surface = Surface::read(&bytes)?;
    // The next run must not find this file.
    fs::remove_file(&result).map_err(folder)?;
    Ok((surface, printed))
}

/// The names of the volumes, in the order of their numbers. Gmsh writes them into XAO files alone.
/// Empty when they cannot be read: names are not worth an error.
fn names(gmsh: &Gmsh, volumes: usize) -> Vec<String> {
    let Ok(text) = input::read_to_string(gmsh.path(NAMES)) else { return Vec::new() };
    let Ok(document) = roxmltree::Document::parse(&text) else { return Vec::new() };
    let solids = document.descendants().filter(|node| node.has_tag_name("solid"));
    let names: Vec<String> = solids
        .map(|node| {
            // A path through the assembly: `Shapes/robot/arm`.
            let path = node.attribute("name").unwrap_or_default();
            path.rsplit('/').next().unwrap_or_default().trim().to_owned()
        })
        .collect();
    if names.len() == volumes { names } else { Vec::new() }
}

fn assemble(surface: &Surface, names: Vec<String>) -> RawMesh {
    let mut raw = RawMesh::new(Places::Elements(Vec::new()), 0);
    // The middles of edges are left out.
    let mut ids = vec![None; surface.positions.len()];
    let mut owned = vec![false; surface.faces.len()];
    let mut names = names.into_iter();
    let mut add = |raw: &mut RawMesh, face: usize, element: String| {
        // A face that two solids share bounds the second one from its other side.
        let reversed = std::mem::replace(&mut owned[face], true);
        if let Places::Elements(parts) = &mut raw.places {
            parts.push((0, raw.ends.len(), element));
        }
        for &[a, b, c] in &surface.faces[face].triangles {
            let corners = if reversed { [a, c, b] } else { [a, b, c] };
            for corner in corners {
                let id = *ids[corner as usize].get_or_insert_with(|| {
                    raw.positions.push(surface.positions[corner as usize]);
                    raw.positions.len() as u64 - 1
                });
                raw.corners.push(id);
            }
            raw.end_face(0);
        }
    };
    for volume in &surface.volumes {
        let name = names.next().filter(|name| !name.is_empty());
        let name = name.unwrap_or_else(|| format!("solid {}", volume.tag));
        raw.begin_part(name);
        for &face in &volume.faces {
            let element = format!("solid {}, surface {}", volume.tag, surface.faces[face].tag);
            add(&mut raw, face, element);
        }
    }
    if surface.volumes.is_empty() {
        for (face, of) in surface.faces.iter().enumerate() {
            add(&mut raw, face, format!("surface {}", of.tag));
        }
        raw.notes.push("the file has no solid; its surfaces were read".into());
    }
    let free = owned.iter().filter(|owned| !**owned).count();
    if free > 0 {
        raw.notes.push(format!("{free} surfaces bound no solid; they were left out"));
    }
    raw
}
