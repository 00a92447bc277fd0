//! `tesdf encode MESH --split -o FOLDER`: an asset for each object of a file.
use crate::terminal::report::{self, Failure, Outcome};
use tesdf::base::unit;
use tesdf::mesh::{NamedMesh, split};

use super::Args;
use crate::encode_all::file_names;
use crate::encode_all::meshes::{Content, Details, Mesh, Part};

/// Reads the file once, and encodes its objects.
pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let path = &args.mesh;
    let loaded = args.cad.read(path)?;
    let load = &loaded.report;
    load.notes.iter().for_each(|note| report::warning(note));
    let conflict = unit::conflict(load.unit.as_deref(), args.choices.unit.as_deref());
    conflict.iter().for_each(|found| report::warning(found));
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let parts = split(&loaded);
    // Components have numbers, which say little without the name of the file.
    let names: Vec<String> = match loaded.parts.len() {
        0 | 1 if parts.len() == 1 => vec![stem.clone().into_owned()],
        0 | 1 => parts.iter().map(|part| format!("{stem}-{}", part.name)).collect(),
        _ => parts.iter().map(|part| part.name.clone()).collect(),
    };
    let assets = file_names::unique(names.iter().map(String::as_str), &stem);
    let meshes = parts.into_iter().zip(names).zip(assets).map(|((part, name), asset)| {
        let NamedMesh { mesh, .. } = part;
        Mesh {
            name: format!("{file}#{}", asset.strip_suffix(".tesdf").unwrap_or(&asset)),
            path: path.clone(),
            // The larger ones first.
            bytes: mesh.faces().len() as u64,
            content: Content::Part(Box::new(Part { asset, mesh, load: load.clone() })),
            entry: Details { part: Some(name), ..Details::default() },
            ..Mesh::default()
        }
    });
    args.batch(meshes.collect())?.run(args.consent)
}
