//! Reads glTF 2.0, as JSON and as GLB.
//!
//! `gltf-json` (of the `gltf` crate) parses and validates the JSON, and names the path at fault.
//! This module reads the container and the accessors: `gltf` 1.4.1 subtracts 12 from the length in
//! the GLB header without a check, and its accessor iterators do not say which bytes are missing.
//!
//! The reader takes triangles, strips and fans of the default scene with the transforms of the
//! nodes, and takes the names of the nodes. Without a default scene it takes the first scene, else
//! all root nodes, else all meshes. Buffers may be in the file, in `data:` URIs, or in files next
//! to it. Nodes that mirror flip their faces, so outward stays outward. Skins and morph targets are
//! not applied.
mod buffers;
mod limits;
mod scene;

use std::path::{Path, PathBuf};

use glam::{DAffine3, DVec3};
use gltf_json as json;
use json::mesh::{Mode, Primitive, Semantic};
use json::validation::{Checked, Error as Defect, Validate};

use super::text::shown;
use super::{MeshFormat, Place, Places, RawMesh, ReadError, sniff};
use buffers::Data;
use scene::Instance;

const EXPORT_AGAIN: &str = "export the file again, or as another format";

pub(super) fn parse(
    bytes: &[u8],
    format: MeshFormat,
    folder: Option<&Path>,
    hasher: &mut blake3::Hasher,
) -> Result<RawMesh, ReadError> {
    let (root, binary) = read_root(bytes, format)?;
    validate(&root, format)?;
    let buffers = buffers::load(&root, binary, format, folder, hasher)?;
    let data = Data { root: &root, buffers: &buffers, format };
    let mut reader =
        Reader { data, raw: RawMesh::new(Places::Elements(Vec::new()), 0), skipped: 0, deformable: false };
    let instances = scene::instances(&root, format)?;
    limits::check(&data, instances.iter().map(|instance| instance.mesh))?;
    instances.into_iter().try_for_each(|instance| reader.mesh(&instance))?;
    // The lengths of glTF are in metres.
    reader.raw.unit = Some("m");
    if reader.skipped > 0 {
        reader.raw.notes.push(format!("{} primitives of points or lines skipped", reader.skipped));
    }
    if reader.deformable || root.nodes.iter().any(|n| n.skin.is_some()) {
        reader.raw.notes.push("skins and morph targets are not applied: the base shape is read".into());
    }
    Ok(reader.raw)
}

/// The files in `folder` or below it that hold the buffers. Empty when the bytes are not glTF.
pub(super) fn external_files(bytes: &[u8], format: MeshFormat, folder: &Path) -> Vec<PathBuf> {
    let root = read_root(bytes, format).map(|(root, _)| root);
    root.map_or_else(|_| Vec::new(), |root| buffers::external_files(&root, folder).collect())
}

/// The JSON, and the binary chunk of a GLB file.
fn read_root(bytes: &[u8], format: MeshFormat) -> Result<(json::Root, Option<&[u8]>), ReadError> {
    let (json, binary) = if bytes.starts_with(b"glTF") {
        split_glb(bytes, format)?
    } else {
        sniff::refuse_other_kinds(bytes, format)?;
        sniff::refuse_binary(bytes, format)?;
        (super::text::without_bom(bytes), None)
    };
    let root = json::deserialize::from_slice(json).map_err(|error| ReadError::Malformed {
        format,
        place: Place::Line(error.line() as u64),
        found: format!("the JSON is not glTF 2.0: {error}"),
        help: EXPORT_AGAIN.into(),
    })?;
    Ok((root, binary))
}

/// Parts of the JSON on which the geometry depends. Faults in other parts (materials, animations)
/// are ignored.
const GEOMETRY: [&str; 8] =
    ["asset", "scene", "scenes", "nodes", "meshes", "accessors", "bufferViews", "buffers"];

/// Prefixes of required extensions that change the look of a mesh but not its shape.
const LOOKS: [&str; 4] = ["KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_"];

fn validate(root: &json::Root, format: MeshFormat) -> Result<(), ReadError> {
    let unknown = |name: &&String| !LOOKS.iter().any(|prefix| name.starts_with(prefix));
    if let Some(name) = root.extensions_required.iter().find(unknown) {
        let help = "export the file without it, uncompressed";
        return Err(fault(
            format,
            "extensionsRequired",
            format!("the extension {} is not read", shown(name.as_bytes())),
            help,
        ));
    }
    // `gltf-json` 1.4.1 looks this accessor up before it checks the index.
    for (m, mesh) in root.meshes.iter().enumerate() {
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let accessor = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
            if let Some(index) = accessor.map(|a| a.value()).filter(|&a| a >= root.accessors.len()) {
                let element = format!("meshes[{m}].primitives[{p}].attributes.POSITION");
                let found = format!("accessor {index} of {}", root.accessors.len());
                return Err(fault(format, element, found, "expected an accessor that exists"));
            }
        }
    }
    let mut first = None;
    root.validate(root, json::Path::new, &mut |path, defect| {
        let path = path().to_string();
        let part = path.split(['[', '.', ' ']).next().unwrap_or_default();
        // Many exporters leave out the required bounds. Values without bytes are refused where they
        // are needed.
        let is_bound = path.ends_with(".min") || path.ends_with(".max");
        let is_view = defect == Defect::Missing && path.ends_with("].bufferView");
        if first.is_none() && GEOMETRY.contains(&part) && !is_bound && !is_view {
            first = Some((path, defect));
        }
    });
    match first {
        None => Ok(()),
        Some((path, defect)) => Err(fault(format, path, defect.to_string(), EXPORT_AGAIN)),
    }
}

fn fault(
    format: MeshFormat,
    element: impl Into<String>,
    found: impl Into<String>,
    help: impl Into<String>,
) -> ReadError {
    ReadError::Malformed {
        format,
        place: Place::Element(element.into()),
        found: found.into(),
        help: help.into(),
    }
}

/// The JSON chunk and the binary chunk.
fn split_glb(bytes: &[u8], format: MeshFormat) -> Result<(&[u8], Option<&[u8]>), ReadError> {
    let error = |at: usize, found: String, help: &str| ReadError::Malformed {
        format,
        place: Place::Byte(at as u64),
        found,
        help: help.into(),
    };
    let word = |at: usize| {
        let word = bytes.get(at..at + 4).and_then(|w| w.try_into().ok()).map(u32::from_le_bytes);
        word.ok_or_else(|| error(at, format!("the file ends at byte {}", bytes.len()), "is it cut short?"))
    };
    let version = word(4)?;
    if version != 2 {
        return Err(error(4, format!("version {version}"), "expected 2: convert the file to glTF 2.0"));
    }
    let length = word(8)?;
    if u64::from(length) != bytes.len() as u64 {
        let found = format!("the header says {length} bytes, but the file has {}", bytes.len());
        return Err(error(8, found, "is it cut short?"));
    }
    let mut chunks = Vec::new();
    let mut at = 12;
    while at < bytes.len() {
        let size = word(at)?;
        let kind = word(at + 4)?.to_le_bytes();
        let start = at + 8;
        let Some(chunk) = bytes[start..].get(..size as usize) else {
            let found = format!("a chunk of {size} bytes, {} left in the file", bytes.len() - start);
            return Err(error(at, found, "is it cut short?"));
        };
        chunks.push((kind, chunk));
        at = start + size as usize;
    }
    match chunks[..] {
        [(kind, json), ..] if &kind == b"JSON" => {
            let binary = chunks.get(1).filter(|(kind, _)| kind == b"BIN\0").map(|(_, chunk)| *chunk);
            Ok((json, binary))
        }
        _ => Err(error(12, "no JSON chunk".into(), "expected it first")),
    }
}

struct Reader<'a> {
    data: Data<'a>,
    raw: RawMesh,
    skipped: usize,
    deformable: bool,
}

impl Reader<'_> {
    fn mesh(&mut self, instance: &Instance) -> Result<(), ReadError> {
        let root = self.data.root;
        let Instance { mesh, node, pose } = instance;
        let names = [node.and_then(|node| root.nodes[node].name.as_ref()), root.meshes[*mesh].name.as_ref()];
        self.raw.begin_part(names.into_iter().flatten().next().cloned().unwrap_or_default());
        for (i, primitive) in root.meshes[*mesh].primitives.iter().enumerate() {
            self.primitive(primitive, pose, format!("meshes[{mesh}].primitives[{i}]"))?;
        }
        Ok(())
    }

    fn primitive(
        &mut self,
        primitive: &Primitive,
        pose: &DAffine3,
        element: String,
    ) -> Result<(), ReadError> {
        let format = self.data.format;
        let mode = match primitive.mode {
            Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
            _ => {
                self.skipped += 1;
                return Ok(());
            }
        };
        self.deformable |= primitive.targets.is_some();
        let Some(positions) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)) else {
            return Err(fault(
                format,
                element,
                "no POSITION attribute",
                "compressed geometry is not read: export it plain",
            ));
        };
        let positions = self.data.positions(positions.value())?;
        let base = self.raw.positions.len();
        room(&mut self.raw.positions, positions.len(), "vertices", format, &element)?;
        let indices = match primitive.indices {
            Some(accessor) => self.data.indices(accessor.value())?,
            None => (0..positions.len() as u64).collect(),
        };
        if let Some((i, index)) =
            indices.iter().enumerate().find(|(_, index)| **index >= positions.len() as u64)
        {
            let found =
                format!("index {i} (0-based) is {index}, but the primitive has {} vertices", positions.len());
            return Err(fault(format, element, found, "expected a smaller index: export the file again"));
        }
        if mode == Mode::Triangles && !indices.len().is_multiple_of(3) {
            let found = format!("{} corners are not whole triangles", indices.len());
            return Err(fault(format, element, found, "expected a multiple of 3"));
        }
        // A strip or fan has up to three corners per index.
        let corners_per_index = if mode == Mode::Triangles { 1 } else { 3 };
        let more = indices.len().saturating_mul(corners_per_index);
        room(&mut self.raw.corners, more, "corners of faces", format, &element)?;
        let first_face = self.raw.ends.len();
        if let Places::Elements(parts) = &mut self.raw.places {
            parts.push((base, first_face, element));
        }
        // A NaN in one coordinate would spread to the others, but must be reported for that
        // coordinate.
        let placed = |p: &DVec3| if p.is_finite() { pose.transform_point3(*p) } else { *p };
        self.raw.positions.extend(positions.iter().map(placed));
        let mirrored = pose.matrix3.determinant() < 0.0;
        let first_corner = self.raw.corners.len();
        let corners = indices.into_iter().map(|i| i + base as u64);
        match mode {
            Mode::TriangleStrip => {
                let strip: Vec<_> = corners.collect();
                self.raw.push_strip(&strip, 0);
            }
            Mode::TriangleFan => {
                let fan: Vec<_> = corners.collect();
                for pair in fan.get(1..).unwrap_or_default().windows(2) {
                    self.raw.corners.extend([fan[0], pair[0], pair[1]]);
                    self.raw.end_face(0);
                }
            }
            _ => {
                for (i, corner) in corners.enumerate() {
                    self.raw.corners.push(corner);
                    if i % 3 == 2 {
                        self.raw.end_face(0);
                    }
                }
            }
        }
        if mirrored {
            self.raw.corners[first_corner..].chunks_exact_mut(3).for_each(|t| t.swap(1, 2));
        }
        Ok(())
    }
}

/// Reserves memory for `more` elements.
fn room<T>(
    elements: &mut Vec<T>,
    more: usize,
    what: &str,
    format: MeshFormat,
    element: &str,
) -> Result<(), ReadError> {
    elements.try_reserve(more).map_err(|_| {
        let found = format!("no memory is left for {more} more {what}");
        fault(format, element, found, "free memory, or read the file where there is more")
    })
}

/// An f32 of the JSON as the decimal number that was most likely written: a scale of 0.001 should
/// be 0.001 and not 0.0010000000474974513. The shortest decimal that rounds to the f32 is that
/// number whenever it has up to six digits.
fn decimal(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

fn decimals(v: [f32; 3]) -> DVec3 {
    DVec3::from_array(v.map(decimal))
}
