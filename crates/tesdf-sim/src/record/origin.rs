//! What determines the bits of a run besides its scene.
use serde::{Deserialize, Serialize};
use serde_json::Value;
use tesdf::TeSdf;
use tesdf::collide::{CollideError, Shape};

use super::{InterruptedRun, RecordError};
use crate::System;
use crate::scene_file::SceneFile;

/// The software and geometry that a run was made with. Runs of equal scenes with equal origins have
/// the same bits.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunOrigin {
    /// Version of `tesdf-sim`.
    pub version: String,
    /// Where contacts are detected: `cpu`, or the name of a GPU device.
    pub device: String,
    /// For each body that is an encoded mesh: the BLAKE3 hash of its vertices, faces, cells and
    /// lists, in hexadecimal. `None` for other bodies.
    pub geometries: Vec<Option<String>>,
}

impl RunOrigin {
    /// The origin of a run of `system` whose contacts are detected on `device`.
    ///
    /// # Errors
    /// Never for a system that was built through its methods.
    pub fn of(system: &System, device: &str) -> Result<Self, CollideError> {
        let geometry = |body: &crate::Body| {
            let instance = system.scene().instance(body.instance)?;
            Ok(match system.scene().shape(instance.shape)? {
                Shape::Mesh(asset) => Some(fingerprint(asset)),
                _ => None,
            })
        };
        Ok(Self {
            version: env!("CARGO_PKG_VERSION").into(),
            device: device.into(),
            geometries: system.bodies().iter().map(geometry).collect::<Result<_, CollideError>>()?,
        })
    }
}

/// A hash of the geometry. The name of the source file is left out, so a mesh may be renamed.
fn fingerprint(asset: &TeSdf) -> String {
    let mut hasher = blake3::Hasher::new();
    // How the detector uses the lists depends on what the certificate proves about them.
    hasher.update(asset.container().metadata().get("certificate").map_or(&[], String::as_bytes));
    for section in asset.sections() {
        hasher.update(section.spec.name.as_bytes());
        hasher.update(&(section.bytes.len() as u64).to_le_bytes());
        hasher.update(section.bytes);
    }
    hasher.finalize().to_hex().to_string()
}

impl InterruptedRun {
    /// Checks that a run resumed with `scene` and `origin` gives the bits of an uninterrupted run.
    /// The paths of geometry files may differ, but not the geometries.
    ///
    /// # Errors
    /// [`RecordError::Differs`] or [`RecordError::Geometry`] for the first difference.
    pub fn check(&self, scene: &SceneFile, origin: &RunOrigin) -> Result<(), RecordError> {
        let differs = |what: String, found: &Value, expected: &Value| {
            let [found, expected] = [found, expected].map(shown);
            Err(RecordError::Differs { what, found, expected })
        };
        let recorded = without_paths(self.run.record.scene.clone());
        let scene = without_paths(serde_json::to_value(scene).unwrap_or_default());
        if let Some((what, found, expected)) = difference("", &scene, &recorded) {
            return differs(what, found, expected);
        }
        for (name, found, expected) in [
            ("version", &origin.version, &self.origin.version),
            ("device", &origin.device, &self.origin.device),
        ] {
            if found != expected {
                return differs(name.into(), &found.as_str().into(), &expected.as_str().into());
            }
        }
        let geometries = origin.geometries.iter().zip(&self.origin.geometries).zip(&self.run.record.bodies);
        for ((found, expected), body) in geometries {
            if found != expected {
                return Err(RecordError::Geometry { body: body.clone() });
            }
        }
        Ok(())
    }
}

fn without_paths(mut scene: Value) -> Value {
    for body in scene.get_mut("bodies").and_then(Value::as_array_mut).into_iter().flatten() {
        for key in ["asset", "mesh"] {
            body.as_object_mut().and_then(|body| body.remove(key));
        }
    }
    scene
}

/// The first place where the values differ, with both values.
fn difference<'a>(at: &str, a: &'a Value, b: &'a Value) -> Option<(String, &'a Value, &'a Value)> {
    match (a, b) {
        (Value::Object(a), Value::Object(b)) if a.keys().eq(b.keys()) => {
            a.iter().zip(b.values()).find_map(|((key, a), b)| {
                difference(&if at.is_empty() { key.clone() } else { format!("{at}.{key}") }, a, b)
            })
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            a.iter().zip(b).enumerate().find_map(|(k, (a, b))| difference(&format!("{at}[{k}]"), a, b))
        }
        _ => (a != b).then(|| (at.to_string(), a, b)),
    }
}

/// Messages cut values after this number of characters.
const SHOWN: usize = 80;

fn shown(value: &Value) -> String {
    let text = value.to_string();
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}
