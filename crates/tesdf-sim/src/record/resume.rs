//! Whether an interrupted run can be resumed.
use serde_json::Value;

use super::{InterruptedRun, RecordError, RunOrigin};
use crate::scene_file::SceneFile;

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
