//! tesdf for browsers and node: a layer of classes over the library, compiled to WebAssembly.
//!
//! Everything runs on the calling thread, so a page calls [`Solid::encode`] in a worker. The bytes of
//! assets, contacts and distances are those of all other platforms. Lengths are in the mesh's unit; a pose
//! is `x y z qx qy qz qw`. What fails is thrown as an `Error` that says what to do next.
#![warn(missing_docs)]
mod contacts;
mod progress;
mod types;

use std::sync::Arc;

use js_sys::Function;
use tesdf::base::Inside;
use tesdf::glam::DVec3;
use tesdf::mesh::{MeshFormat, RepairMode, check as check_mesh, read_bytes};
use tesdf::{Encoder, Preset, SolidMesh, TeSdf, TriangleMesh};
use tesdf_parts::{Bolt, Nut, Resolution, Size};
use wasm_bindgen::prelude::*;

pub use contacts::{Clearance, Contacts, clearance, contacts};

/// The message of an error, with those of its causes that it does not repeat.
fn thrown(error: impl std::error::Error) -> JsError {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        let more = cause.to_string();
        if !text.contains(&more) {
            text = format!("{text}: {more}");
        }
        source = cause.source();
    }
    JsError::new(&text)
}

/// A triangle mesh that has an inside.
#[wasm_bindgen]
pub struct Solid {
    solid: SolidMesh,
    changed: bool,
}

fn read(bytes: &[u8], name: &str) -> Result<TriangleMesh, JsError> {
    Ok(read_bytes(bytes, MeshFormat::of_path(name).map_err(thrown)?).map_err(thrown)?.mesh)
}

/// What is wrong with a mesh file: its defects with ids and places, and whether it can be encoded. The
/// name of the file gives the format: STL, OBJ, PLY, OFF, GLB, glTF with embedded data, or 3MF.
#[wasm_bindgen(unchecked_return_type = "CheckReport")]
pub fn check(bytes: &[u8], name: &str) -> Result<JsValue, JsError> {
    let report = check_mesh(&read(bytes, name)?);
    let text = serde_json::to_string(&report).map_err(thrown)?;
    js_sys::JSON::parse(&text).map_err(|_| JsError::new("the report is not JSON; please report this"))
}

#[wasm_bindgen]
impl Solid {
    /// Reads a mesh file. With `repair`, a mesh without a well-defined inside is mended.
    #[wasm_bindgen(constructor)]
    pub fn new(bytes: &[u8], name: &str, repair: Option<bool>) -> Result<Solid, JsError> {
        let repair = if repair.unwrap_or(false) { RepairMode::Auto } else { RepairMode::Never };
        let found = SolidMesh::with_repair(read(bytes, name)?, Inside::default(), repair);
        let (solid, changes) = found.map_err(thrown)?;
        Ok(Self { solid, changed: changes.is_some() })
    }

    /// A hexagon head bolt of ISO 4014, in metres: a size such as `M16`, its length, the distance by which
    /// its thread is smaller in radius, and the number of segments of a turn.
    pub fn bolt(size: &str, length: f64, clearance: f64, segments: usize) -> Result<Solid, JsError> {
        let bolt = Bolt { length, clearance, ..Bolt::iso_4014(size.parse::<Size>().map_err(thrown)?) };
        let thread_length = Bolt::longest_thread(&bolt.thread, length);
        let bolt = Bolt { thread_length, ..bolt };
        let solid = bolt.mesh(Resolution::Segments(segments)).map_err(thrown)?;
        Ok(Self { solid, changed: false })
    }

    /// A hexagon nut of ISO 4032, in metres, likewise.
    pub fn nut(size: &str, clearance: f64, segments: usize) -> Result<Solid, JsError> {
        let nut = Nut { clearance, ..Nut::iso_4032(size.parse::<Size>().map_err(thrown)?) };
        let solid = nut.mesh(Resolution::Segments(segments)).map_err(thrown)?;
        Ok(Self { solid, changed: false })
    }

    /// The number of faces.
    #[wasm_bindgen(getter, js_name = faceCount)]
    pub fn face_count(&self) -> usize {
        self.solid.mesh().faces().len()
    }

    /// Whether a repair changed the mesh.
    #[wasm_bindgen(getter)]
    pub fn changed(&self) -> bool {
        self.changed
    }

    /// The corners of the faces, nine numbers for each.
    pub fn triangles(&self) -> Vec<f32> {
        let mesh = self.solid.mesh();
        flat((0..mesh.faces().len()).map(|face| mesh.triangle(face)))
    }

    /// Encodes the solid with a preset: `default`, `fast`, `compact` or `gpu`. `progress` is called with
    /// the stage and the share of it that is done; the encoding stops when it returns `false`.
    pub fn encode(
        &self,
        preset: Option<String>,
        #[wasm_bindgen(unchecked_param_type = "((stage: Stage, share: number) => boolean | void) | null")]
        progress: Option<Function>,
    ) -> Result<Asset, JsError> {
        let preset = preset.as_deref().unwrap_or("default").parse::<Preset>();
        let preset = preset.map_err(|message| JsError::new(&message))?;
        let asset = progress::watched(progress, |progress| {
            Encoder::new().preset(preset).progress(progress).encode(&self.solid)
        });
        Ok(Asset(Arc::new(asset.map_err(thrown)?)))
    }
}

/// An encoded mesh: the content of a `.tesdf` file.
#[wasm_bindgen]
pub struct Asset(Arc<TeSdf>);

#[wasm_bindgen]
impl Asset {
    /// Opens the bytes of a `.tesdf` file.
    pub fn open(bytes: &[u8]) -> Result<Asset, JsError> {
        Ok(Self(Arc::new(TeSdf::from_bytes(bytes).map_err(thrown)?)))
    }

    /// The bytes of the `.tesdf` file.
    pub fn save(&self) -> Vec<u8> {
        self.0.as_bytes().to_vec()
    }

    /// The number of faces.
    #[wasm_bindgen(getter, js_name = faceCount)]
    pub fn face_count(&self) -> usize {
        self.0.face_count()
    }

    /// The lowest and the highest corner of the bounding box.
    #[wasm_bindgen(getter)]
    pub fn bounds(&self) -> Vec<f64> {
        let bounds = self.0.bounds();
        [bounds.min.to_array(), bounds.max.to_array()].concat()
    }

    /// The corners of the faces, nine numbers for each.
    pub fn triangles(&self) -> Vec<f32> {
        flat((0..self.0.face_count()).map(|face| self.0.face_corners(face)))
    }

    /// The signed distances of points, of which each has three numbers; negative inside.
    #[wasm_bindgen(js_name = signedDistances)]
    pub fn signed_distances(&self, points: &[f64]) -> Result<Vec<f64>, JsError> {
        let (points, rest) = points.as_chunks::<3>();
        if !rest.is_empty() {
            return Err(JsError::new("points must have three numbers each: x, y, z"));
        }
        Ok(points.iter().map(|point| self.0.signed_distance(DVec3::from_array(*point))).collect())
    }

    /// The signed distances in a rectangle of a plane, row by row: `corner` is its first corner, and
    /// `across` and `down` are its sides. Each is asked for in the middle of its pixel.
    pub fn slice(
        &self,
        corner: &[f64],
        across: &[f64],
        down: &[f64],
        columns: usize,
        rows: usize,
    ) -> Result<Vec<f32>, JsError> {
        let [corner, across, down] =
            [vector("corner", corner)?, vector("across", across)?, vector("down", down)?];
        let mut distances = Vec::with_capacity(columns * rows);
        for row in 0..rows {
            for column in 0..columns {
                let [s, t] = [(column, columns), (row, rows)].map(|(k, n)| (k as f64 + 0.5) / n as f64);
                distances.push(self.0.signed_distance(corner + s * across + t * down) as f32);
            }
        }
        Ok(distances)
    }
}

fn vector(name: &str, numbers: &[f64]) -> Result<DVec3, JsError> {
    let numbers: [f64; 3] = numbers
        .try_into()
        .map_err(|_| JsError::new(&format!("{name} has {} numbers; expected x, y, z", numbers.len())))?;
    Ok(DVec3::from_array(numbers))
}

fn flat(triangles: impl Iterator<Item = [DVec3; 3]>) -> Vec<f32> {
    triangles.flatten().flat_map(|corner| corner.as_vec3().to_array()).collect()
}

#[cfg(feature = "golden")]
#[path = "../../tesdf-sim/tests/golden/cases.rs"]
mod cases;

/// The table of `crates/tesdf-sim/tests/golden/hashes.txt`, computed here.
#[cfg(feature = "golden")]
#[wasm_bindgen]
pub fn golden() -> String {
    cases::table()
}
