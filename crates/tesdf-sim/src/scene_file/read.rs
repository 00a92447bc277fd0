use std::path::{Path, PathBuf};

use tesdf::collide::Pose;
use tesdf::glam::{DQuat, DVec3};
use toml::Spanned;
use toml::de::DeTable;

use super::copies::expand;
use super::{BodySection, MAX_BODIES, SceneError, SceneFile};
use crate::RunRecord;
use crate::plan::scripts;

/// Maximum size of a scene file: a thousand bytes per body.
const MAX_TEXT: usize = 1000 * MAX_BODIES;

/// A scene file, with the path and text that error messages and relative paths refer to.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// The content of the file.
    pub scene: SceneFile,
    /// The path of the file.
    pub path: PathBuf,
    /// Empty when the scene comes from JSON.
    pub(super) text: String,
}

impl LoadedScene {
    /// Reads a scene file.
    ///
    /// # Errors
    /// [`SceneError::Read`] or [`SceneError::Parse`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SceneError> {
        let path = path.as_ref();
        let text = tesdf::input::read_to_string(path)
            .map_err(|source| SceneError::Read { path: path.to_path_buf(), source })?;
        Self::parse(text, path)
    }

    /// As [`read`](Self::read), but from `text`. Paths in it are relative to the folder of `path`.
    ///
    /// # Errors
    /// [`SceneError::Parse`].
    pub fn parse(text: String, path: impl AsRef<Path>) -> Result<Self, SceneError> {
        Self::parse_at(text, path.as_ref())
    }

    fn parse_at(text: String, path: &Path) -> Result<Self, SceneError> {
        if text.len() > MAX_TEXT {
            let message = format!("{} bytes; expected a scene of at most {MAX_TEXT}", text.len());
            return Err(SceneError::Parse { path: path.to_path_buf(), message });
        }
        let scene = toml::from_str(&text).map_err(|e| SceneError::Parse {
            path: path.to_path_buf(),
            message: e.to_string().trim_end().to_string(),
        })?;
        Self { scene, path: path.to_path_buf(), text }.expanded()
    }

    /// The scene with each copy of a body as a body of its own, and scripts in place of a plan.
    fn expanded(self) -> Result<Self, SceneError> {
        self.with_copies()?.with_scripts()
    }

    fn with_scripts(mut self) -> Result<Self, SceneError> {
        let Some(plan) = self.scene.plan.take() else { return Ok(self) };
        let scripts = scripts(&plan, self.scene.duration, |name| self.start(name))
            .map_err(|e| self.value("plan", e))?;
        self.scene.scripts.extend(scripts);
        Ok(self)
    }

    /// Where a body starts.
    fn start(&self, name: &str) -> Result<Pose, String> {
        let mut bodies = self.scene.bodies.iter().map(Spanned::get_ref);
        let body = bodies.find(|body| body.name == name);
        let body = body.ok_or_else(|| format!("there is no body {name}; give the name of a body"))?;
        let (translation, rotation) = (DVec3::from_array(body.translation), DQuat::from_array(body.rotation));
        Pose::new(translation, rotation).map_err(|e| format!("body {name}: {e}"))
    }

    fn with_copies(mut self) -> Result<Self, SceneError> {
        match expand(std::mem::take(&mut self.scene.bodies)) {
            Ok(bodies) => Ok(Self { scene: SceneFile { bodies, ..self.scene }, ..self }),
            Err((body, reason)) => Err(self.error_at(&body, reason)),
        }
    }

    /// The scene that is stored in a run, where `run` is the path of the run file. Errors
    /// name no line, because the run does not keep the text of the scene file.
    ///
    /// # Errors
    /// [`SceneError::Parse`] when the run holds no scene.
    pub fn of_run(record: &RunRecord, run: impl AsRef<Path>) -> Result<Self, SceneError> {
        Self::of_record(record, run.as_ref())
    }

    fn of_record(record: &RunRecord, run: &Path) -> Result<Self, SceneError> {
        let path =
            run.file_name().map_or_else(|| run.to_path_buf(), |name| Path::new(&record.folder).join(name));
        Self::parse_json(record.scene.clone(), path).map_err(|e| match e {
            SceneError::Parse { message, .. } => {
                SceneError::Parse { path: run.to_path_buf(), message: format!("the scene in it: {message}") }
            }
            e => e,
        })
    }

    /// A scene with the keys of a scene file. Paths in it are relative to the folder of `path`, and
    /// errors name `path`.
    ///
    /// # Errors
    /// [`SceneError::Parse`] when a key or a value is not that of a scene file.
    pub fn of_json(scene: serde_json::Value, path: impl AsRef<Path>) -> Result<Self, SceneError> {
        Self::parse_json(scene, path.as_ref().to_path_buf())
    }

    fn parse_json(mut json: serde_json::Value, path: PathBuf) -> Result<Self, SceneError> {
        let refuse = |message: String| SceneError::Parse { path: path.clone(), message };
        // `Spanned` can only be read from TOML.
        let bodies = match json.get_mut("bodies").map(serde_json::Value::take) {
            Some(serde_json::Value::Array(bodies)) => bodies,
            found => {
                return Err(refuse(format!("bodies: {}; expected a list of bodies", kind(found.as_ref()))));
            }
        };
        let read = |(k, body): (usize, serde_json::Value)| {
            let body: BodySection =
                serde_json::from_value(body).map_err(|e| refuse(format!("bodies: entry {k}: {e}")))?;
            Ok(Spanned::new(0..0, body))
        };
        let bodies = bodies.into_iter().enumerate().map(read).collect::<Result<_, SceneError>>()?;
        json["bodies"] = serde_json::Value::Array(Vec::new());
        let scene: SceneFile = serde_json::from_value(json).map_err(|e| refuse(e.to_string()))?;
        Self { scene: SceneFile { bodies, ..scene }, path, text: String::new() }.expanded()
    }

    /// Replaces the geometry of a body by a file: an asset when its name ends in `.tesdf`,
    /// otherwise a mesh. `bodies` is its name; `link*` stands for all bodies whose names begin with
    /// `link`, as copies do. A relative path is relative to the scene's folder. Returns `false`
    /// when the scene has no such body.
    #[must_use]
    pub fn replace_geometry(&mut self, bodies: &str, file: impl Into<PathBuf>) -> bool {
        let file = file.into();
        let is_asset = file.extension().is_some_and(|e| e == "tesdf");
        let is_named = |name: &str| match bodies.strip_suffix('*') {
            Some(start) => name.starts_with(start),
            None => name == bodies,
        };
        let mut replaced = false;
        for body in self.scene.bodies.iter_mut().map(|body| body.get_mut()).filter(|b| is_named(&b.name)) {
            replaced = true;
            (body.asset, body.mesh, body.shape) = match is_asset {
                true => (Some(file.clone()), None, None),
                false => (None, Some(file.clone()), None),
            };
            if is_asset {
                // An asset has its own, and is repaired already.
                (body.inside, body.thickness, body.surface, body.repair) = (None, None, None, None);
            }
        }
        replaced
    }

    /// All files of the bodies' geometries, including every file of a mesh that has several.
    pub fn geometry_files(&self) -> Vec<PathBuf> {
        let of_body = |body: &Spanned<BodySection>| {
            let BodySection { asset, mesh, .. } = body.get_ref();
            let asset = asset.iter().map(|path| self.resolve(path));
            asset
                .chain(mesh.iter().flat_map(|path| tesdf::mesh::files(self.resolve(path))))
                .collect::<Vec<_>>()
        };
        self.scene.bodies.iter().flat_map(of_body).collect()
    }

    /// Line number, from 1, of a byte of the text.
    pub(super) fn line(&self, byte: usize) -> usize {
        1 + self.text.bytes().take(byte).filter(|&b| b == b'\n').count()
    }

    /// An error of a body of the scene.
    pub(super) fn error_at(&self, body: &Spanned<BodySection>, reason: String) -> SceneError {
        SceneError::Body {
            path: self.path.clone(),
            line: (!self.text.is_empty()).then(|| self.line(body.span().start)),
            name: body.get_ref().name.clone(),
            reason,
        }
    }

    /// Joins the scene's folder and a path of the scene.
    pub(super) fn resolve(&self, path: &Path) -> PathBuf {
        self.path.parent().map_or_else(|| path.to_path_buf(), |folder| folder.join(path))
    }

    pub(super) fn value(&self, key: &str, reason: impl std::fmt::Display) -> SceneError {
        let (path, line) = (self.path.clone(), self.line_of(key));
        SceneError::Value { path, line, key: key.into(), reason: reason.to_string() }
    }

    /// Line of a field, such as `criterion.screw`. A missing field has the line of its section.
    fn line_of(&self, key: &str) -> Option<usize> {
        let document = DeTable::parse(&self.text).ok()?;
        let (mut table, mut line) = (Some(document.get_ref()), None);
        for part in key.split('.') {
            let Some((name, value)) = table.and_then(|t| t.iter().find(|(name, _)| name.get_ref() == part))
            else {
                break;
            };
            (table, line) = (value.get_ref().as_table(), Some(self.line(name.span().start)));
        }
        line
    }
}

/// What a value is, for messages.
fn kind(value: Option<&serde_json::Value>) -> &'static str {
    match value {
        None => "missing",
        Some(serde_json::Value::Null) => "null",
        Some(serde_json::Value::Bool(_)) => "true or false",
        Some(serde_json::Value::Number(_)) => "a number",
        Some(serde_json::Value::String(_)) => "a string",
        Some(serde_json::Value::Array(_)) => "a list",
        Some(serde_json::Value::Object(_)) => "an object",
    }
}
