//! Reads 3MF: a ZIP archive with a model in XML.
//!
//! The reader takes the meshes that the build items show, with their transforms, through components
//! and through the parts of the production extension. Each mesh is an object with its name. Without
//! build items, it takes all objects that no component shows. Supports are left out. Transforms
//! that mirror flip the faces, so outward stays outward.
//!
//! The archive is read by the crate `zip`, the XML as a stream by `quick-xml`. `lib3mf` 0.1.7 and
//! `threemf2` 0.4.1 unpack a part into one string whatever its size, and their errors name no
//! place.
mod model;
mod package;
mod scene;

use super::{MeshFormat, Place, Places, RawMesh, ReadError, sniff};
use model::{Model, Shape};
use package::Package;

const FORMAT: MeshFormat = MeshFormat::ThreeMf;
const EXPORT_AGAIN: &str = "export the file again, or as another format";

pub(super) fn parse(bytes: &[u8]) -> Result<RawMesh, ReadError> {
    if !bytes.starts_with(b"PK") {
        sniff::refuse_other_kinds(bytes, FORMAT)?;
    }
    let mut package = Package::new(bytes)?;
    let root = package.start()?;
    let mut models: Vec<Model> = Vec::new();
    // Parts in the order in which they are first named. Each is read once.
    let mut wanted = vec![root];
    while let Some(name) = wanted.get(models.len()) {
        let model = model::read(&mut package, name)?;
        for part in model.parts_named() {
            if !wanted.contains(part) {
                wanted.push(part.clone());
            }
        }
        models.push(model);
    }
    let mut raw = RawMesh::new(Places::Elements(Vec::new()), 0);
    raw.unit = Some(models[0].unit);
    let shown = scene::instances(&models, &mut raw.notes)?;
    for instance in shown {
        let object = &models[instance.model].objects[instance.object];
        let Shape::Mesh { positions, triangles } = &object.shape else { continue };
        let element = object.place();
        let mirrored = instance.pose.matrix3.determinant() < 0.0;
        let base = raw.positions.len();
        room(&mut raw.positions, positions.len(), "vertices", &element)?;
        room(&mut raw.corners, 3 * triangles.len(), "corners of faces", &element)?;
        if let Places::Elements(parts) = &mut raw.places {
            parts.push((base, raw.ends.len(), element));
        }
        raw.begin_part(instance.name);
        // A NaN in one coordinate would spread to the others, but must be reported for that
        // coordinate.
        let placed = |p: &glam::DVec3| if p.is_finite() { instance.pose.transform_point3(*p) } else { *p };
        raw.positions.extend(positions.iter().map(placed));
        for &[a, b, c] in triangles {
            let corners = if mirrored { [a, c, b] } else { [a, b, c] };
            raw.corners.extend(corners.map(|corner| base as u64 + u64::from(corner)));
            raw.end_face(0);
        }
    }
    Ok(raw)
}

/// Reserves memory for `more` elements.
fn room<T>(elements: &mut Vec<T>, more: usize, what: &str, element: &str) -> Result<(), ReadError> {
    elements.try_reserve(more).map_err(|_| {
        let found = format!("no memory is left for {more} more {what}");
        fault(element, found, "free memory, or read the file where there is more")
    })
}

fn fault(element: impl Into<String>, found: impl Into<String>, help: impl Into<String>) -> ReadError {
    ReadError::Malformed {
        format: FORMAT,
        place: Place::Element(element.into()),
        found: found.into(),
        help: help.into(),
    }
}
