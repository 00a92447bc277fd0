use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use serde::Deserialize;
use serde_json::Value;
use tesdf::TeSdf;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Deserializer};

use super::asset_cache::AssetCache;
use super::copies::expand;
use super::place;
use super::robots::{self, Expanded};
use super::{BodySection, MAX_BODIES, RobotSection, SceneError, SceneFile};
use crate::RunRecord;
use crate::criterion::{Criteria, CriterionSection};
use crate::robot::{Geometry, Robot, RobotError, RobotFormat};

/// Maximum size of a scene file: a thousand bytes per body.
const MAX_TEXT: usize = 1000 * MAX_BODIES;
/// Maximum number of pairs without contacts, which robots have.
const MAX_EXCLUDED: usize = 1 << 20;

/// A scene file, with the path and text that error messages and relative paths refer to.
#[derive(Clone, Debug)]
pub struct LoadedScene {
    /// The content of the file.
    pub scene: SceneFile,
    /// The path of the file.
    pub path: PathBuf,
    /// Where encoded meshes are kept; `None`, as it is read: nowhere.
    pub assets: Option<AssetCache>,
    /// Assets that are in no file: a body whose `asset` is the path here has this one.
    pub memory: BTreeMap<PathBuf, Arc<TeSdf>>,
    /// Empty when the scene comes from JSON.
    pub(super) text: String,
}

impl LoadedScene {
    /// Reads a scene file.
    ///
    /// # Errors
    /// [`SceneError::Read`], [`SceneError::Parse`], or [`SceneError::Value`] for an unknown criterion.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, SceneError> {
        Self::read_with(path, &Criteria::standard())
    }

    /// As [`read`](Self::read), with `criteria` in place of [`Criteria::standard`].
    ///
    /// # Errors
    /// The same errors as [`read`](Self::read).
    pub fn read_with(path: impl AsRef<Path>, criteria: &Criteria) -> Result<Self, SceneError> {
        let path = path.as_ref();
        if let Ok(Some(_)) = RobotFormat::of_path(path) {
            let message = "a robot description; give it a scene: [[robots]] with file = \"…\", a time_step and a duration";
            return Err(SceneError::Parse { path: path.to_path_buf(), message: message.into() });
        }
        let text = tesdf::input::read_to_string(path)
            .map_err(|source| SceneError::Read { path: path.to_path_buf(), source })?;
        Self::parse_with(text, path, criteria)
    }

    /// As [`read`](Self::read), but from `text`. Paths in it are relative to the folder of `path`.
    ///
    /// # Errors
    /// The same errors as [`read`](Self::read).
    pub fn parse(text: String, path: impl AsRef<Path>) -> Result<Self, SceneError> {
        Self::parse_with(text, path, &Criteria::standard())
    }

    /// As [`parse`](Self::parse), with `criteria` in place of [`Criteria::standard`].
    ///
    /// # Errors
    /// The same errors as [`read`](Self::read).
    pub fn parse_with(text: String, path: impl AsRef<Path>, criteria: &Criteria) -> Result<Self, SceneError> {
        let path = path.as_ref().to_path_buf();
        if text.len() > MAX_TEXT {
            let message = format!("{} bytes; expected a scene of at most {MAX_TEXT}", text.len());
            return Err(SceneError::Parse { path, message });
        }
        let refuse = |mut e: toml::de::Error| {
            e.set_input(Some(&text));
            SceneError::Parse { path: path.clone(), message: e.to_string().trim_end().to_string() }
        };
        let mut document = DeTable::parse(&text).map_err(refuse)?;
        let tables = match document.get_mut().get_mut("criterion").map(Spanned::get_mut) {
            Some(DeValue::Table(tables)) => std::mem::take(tables),
            _ => DeTable::default(),
        };
        let mut scene = SceneFile::deserialize(Deserializer::from(document)).map_err(refuse)?;
        for (name, table) in tables {
            let reader = criteria.reader(name.get_ref()).map_err(|reason| SceneError::Value {
                path: path.clone(),
                line: Some(line(&text, name.span().start)),
                key: "criterion".into(),
                reason,
            })?;
            scene.criterion.insert(reader.name, (reader.toml)(table.into()).map_err(refuse)?);
        }
        if text.contains("pose") {
            // Values are enough to find what is given twice.
            let values: Value = toml::from_str(&text).map_err(refuse)?;
            place::check(&values).map_err(|message| SceneError::Parse { path: path.clone(), message })?;
        }
        Self { scene, path, assets: None, memory: BTreeMap::new(), text }.with_copies()
    }

    /// The scene with each copy of a body as a body of its own, and with the bodies and joints of
    /// its robots.
    fn with_copies(mut self) -> Result<Self, SceneError> {
        place::place_all(&mut self.scene);
        match expand(std::mem::take(&mut self.scene.bodies)) {
            Ok(bodies) => self.scene.bodies = bodies,
            Err((body, reason)) => return Err(self.error_at(&body, reason)),
        }
        let (spans, mut read) = (self.robot_spans(), BTreeMap::new());
        for (k, section) in std::mem::take(&mut self.scene.robots).into_iter().enumerate() {
            let span = spans.get(k).cloned().unwrap_or_default();
            let at = |reason: String| {
                let line = (!self.text.is_empty()).then(|| self.line(span.start));
                let key = format!("robots: {}", section.file.display());
                SceneError::Value { path: self.path.clone(), line, key, reason }
            };
            // A scene of some kilobytes can name a large file any number of times.
            let robot = match read.entry((section.file.clone(), section.packages.clone())) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(new) => new.insert(self.robot(&section).map_err(|e| at(e.to_string()))?),
            };
            let expanded = robots::expand(&section, robot).map_err(at)?;
            let Expanded { bodies, joints, couplings, exclude } = expanded;
            for (found, most, what) in [
                (self.scene.bodies.len() + bodies.len(), MAX_BODIES, "bodies"),
                (self.scene.exclude.len() + exclude.len(), MAX_EXCLUDED, "pairs of bodies without contacts"),
            ] {
                if found > most {
                    let found = format!("with this robot there are {found} {what}");
                    return Err(at(format!("{found}; expected at most {most}: split the scene")));
                }
            }
            self.scene.bodies.extend(bodies.into_iter().map(|body| Spanned::new(span.clone(), body)));
            self.scene.joints.extend(joints);
            self.scene.couplings.extend(couplings);
            self.scene.exclude.extend(exclude);
        }
        Ok(self)
    }

    /// Reads a robot. The paths of its meshes are relative to the scene's folder where they are
    /// below it.
    fn robot(&self, section: &RobotSection) -> Result<Robot, RobotError> {
        let path = self.resolve(&section.file);
        let packages = section.packages.iter().map(|(name, path)| (name.clone(), self.resolve(path)));
        let packages: Vec<_> = packages.collect();
        let mut robot = Robot::read(&path, &packages)?;
        let folder = self.path.parent().unwrap_or(Path::new(""));
        for collision in robot.links.iter_mut().flat_map(|link| &mut link.collisions) {
            if let Geometry::Mesh { file, .. } = &mut collision.geometry {
                *file = match file.strip_prefix(folder) {
                    Ok(below) => below.to_path_buf(),
                    Err(_) => std::path::absolute(&file).unwrap_or_else(|_| file.clone()),
                };
            }
        }
        Ok(robot)
    }

    /// Where the robots are in the text.
    fn robot_spans(&self) -> Vec<std::ops::Range<usize>> {
        let document = DeTable::parse(&self.text).ok();
        let robots = document.as_ref().and_then(|document| document.get_ref().get("robots"));
        let robots = robots.and_then(|robots| robots.get_ref().as_array());
        robots.into_iter().flatten().map(Spanned::span).collect()
    }

    /// The scene that is stored in a run, without its criteria, where `run` is the path of the run
    /// file. Errors name no line, because the run does not keep the text of the scene file.
    ///
    /// # Errors
    /// [`SceneError::Parse`] when the run holds no scene.
    pub fn of_run(record: &RunRecord, run: impl AsRef<Path>) -> Result<Self, SceneError> {
        Self::of_record(record, run.as_ref(), None)
    }

    /// As [`of_run`](Self::of_run), with the criteria, to go on with the run.
    ///
    /// # Errors
    /// The same errors as [`of_run`](Self::of_run), and an unknown criterion.
    pub fn of_run_with(
        record: &RunRecord,
        run: impl AsRef<Path>,
        criteria: &Criteria,
    ) -> Result<Self, SceneError> {
        Self::of_record(record, run.as_ref(), Some(criteria))
    }

    fn of_record(record: &RunRecord, run: &Path, criteria: Option<&Criteria>) -> Result<Self, SceneError> {
        let path =
            run.file_name().map_or_else(|| run.to_path_buf(), |name| Path::new(&record.folder).join(name));
        Self::parse_json(record.scene.clone(), path, criteria).map_err(|e| match e {
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
    pub fn of_json(scene: Value, path: impl AsRef<Path>) -> Result<Self, SceneError> {
        Self::parse_json(scene, path.as_ref().to_path_buf(), Some(&Criteria::standard()))
    }

    /// Without `criteria`, those of the scene are left out.
    fn parse_json(mut json: Value, path: PathBuf, criteria: Option<&Criteria>) -> Result<Self, SceneError> {
        let refuse = |message: String| SceneError::Parse { path: path.clone(), message };
        place::check(&json).map_err(refuse)?;
        let tables = match json.get_mut("criterion") {
            Some(Value::Object(tables)) => std::mem::take(tables),
            _ => serde_json::Map::new(),
        };
        let criterion = criteria.map_or_else(
            || Ok(CriterionSection::default()),
            |criteria| {
                CriterionSection::of_json(tables, criteria).map_err(|e| refuse(format!("criterion: {e}")))
            },
        )?;
        // `Spanned` can only be read from TOML.
        let bodies = match json.get_mut("bodies").map(Value::take) {
            Some(Value::Array(bodies)) => bodies,
            found => {
                return Err(refuse(format!("bodies: {}; expected a list of bodies", kind(found.as_ref()))));
            }
        };
        let read = |(k, body): (usize, Value)| {
            let body: BodySection =
                serde_json::from_value(body).map_err(|e| refuse(format!("bodies: entry {k}: {e}")))?;
            Ok(Spanned::new(0..0, body))
        };
        let bodies = bodies.into_iter().enumerate().map(read).collect::<Result<_, SceneError>>()?;
        json["bodies"] = Value::Array(Vec::new());
        let scene: SceneFile = serde_json::from_value(json).map_err(|e| refuse(e.to_string()))?;
        let scene = SceneFile { bodies, criterion, ..scene };
        Self { scene, path, assets: None, memory: BTreeMap::new(), text: String::new() }.with_copies()
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
            body.parts.clear();
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
            let BodySection { asset, mesh, parts, .. } = body.get_ref();
            let asset = asset.iter().map(|path| self.resolve(path));
            let meshes = mesh.iter().chain(parts.iter().filter_map(|part| part.mesh.as_ref()));
            asset.chain(meshes.flat_map(|path| tesdf::mesh::files(self.resolve(path)))).collect::<Vec<_>>()
        };
        self.scene.bodies.iter().flat_map(of_body).collect()
    }

    /// Line number, from 1, of a byte of the text.
    pub(super) fn line(&self, byte: usize) -> usize {
        line(&self.text, byte)
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

/// Line number, from 1, of a byte of a text.
fn line(text: &str, byte: usize) -> usize {
    1 + text.bytes().take(byte).filter(|&b| b == b'\n').count()
}

/// What a value is, for messages.
fn kind(value: Option<&Value>) -> &'static str {
    match value {
        None => "missing",
        Some(Value::Null) => "null",
        Some(Value::Bool(_)) => "true or false",
        Some(Value::Number(_)) => "a number",
        Some(Value::String(_)) => "a string",
        Some(Value::Array(_)) => "a list",
        Some(Value::Object(_)) => "an object",
    }
}
