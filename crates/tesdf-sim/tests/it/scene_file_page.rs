//! `docs/scene-file.md` lists the keys of a scene file that the types have, each with its type and
//! its default.
//!
//! The types tell these themselves: a table is refused for an unknown key with the names of its
//! keys, a value of another type with the type that was expected, and a table that lacks a key with
//! the name of the key. What was left out is in the scene that is read, with its default.
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::Deserialize;
use serde_json::Value;
use tesdf_sim::criterion::Criteria;
use tesdf_sim::scene_file::{LoadedScene, SceneFile};

use crate::support::run;

/// Type and default of each key, by its path, such as `bodies.shape.box.half_extents`.
type Keys = BTreeMap<String, (String, Fallback)>;

/// What holds where a key is left out.
#[derive(Debug, PartialEq)]
enum Fallback {
    /// The scene is refused.
    Required,
    /// A value.
    Value(Value),
    /// No value.
    Nothing,
}

/// A scene in a table, so that each of its places is within an inline table.
#[derive(Deserialize)]
struct Document {
    scene: SceneFile,
}

/// What can stand at a place.
enum Kind {
    /// A value of this type.
    Value(&'static str),
    /// An array of this length.
    Array(usize),
    List,
    /// A table with these keys.
    Table(Vec<String>),
    /// A table with any keys.
    Map,
    /// The name of one of these variants, or a table with one of them as its only key.
    Choice(Vec<String>),
    /// Nothing but the name of a variant.
    Name,
}

/// A place in a scene: the text before and after it, and where its value is in the scene as JSON.
struct Place {
    before: String,
    after: String,
    pointer: String,
}

impl Place {
    fn root() -> Self {
        Self { before: "scene = ".into(), after: String::new(), pointer: String::new() }
    }

    /// The value of `key` in a table that has the entries `others`, too.
    fn key(&self, key: &str, others: &BTreeMap<String, String>) -> Self {
        let others = others.iter().filter(|&(other, _)| other != key);
        let others: String = others.map(|(key, value)| format!("{key} = {value}, ")).collect();
        Self {
            before: format!("{}{{ {others}{key} = ", self.before),
            after: format!(" }}{}", self.after),
            pointer: format!("{}/{key}", self.pointer),
        }
    }

    /// The first entry of a list or an array.
    fn entry(&self) -> Self {
        Self {
            before: format!("{}[", self.before),
            after: format!("]{}", self.after),
            pointer: format!("{}/0", self.pointer),
        }
    }

    fn read(&self, value: &str) -> Result<SceneFile, String> {
        let document = toml::from_str(&format!("{}{value}{}", self.before, self.after));
        document.map(|document: Document| document.scene).map_err(|e| {
            let of_criterion = |name| e.message().strip_prefix(name)?.strip_prefix(": ");
            Criteria::standard().names().find_map(of_criterion).unwrap_or(e.message()).to_string()
        })
    }

    fn kind(&self) -> Kind {
        // A map of numbers takes any key, and other maps refuse the value alone.
        let Err(message) = self.read("{ \"?\" = 0 }") else { return Kind::Map };
        if message.starts_with("invalid type: integer `0`, expected ") {
            return Kind::Map;
        }
        let names = || code_spans(&message).skip(1).map(String::from).collect();
        if message.starts_with("unknown field `?`") {
            return Kind::Table(names());
        }
        if let Some(names) = message.strip_prefix("there is no criterion ?; expected one of ") {
            return Kind::Table(names.split(", ").map(String::from).collect());
        }
        if message.starts_with("unknown variant `?`") {
            return Kind::Choice(names());
        }
        // Of a variant.
        if let Some(keys) = message.strip_prefix("unexpected keys in table: ?, available keys: ") {
            return Kind::Table(keys.split(", ").map(String::from).collect());
        }
        if message == "expected empty table" {
            return Kind::Name;
        }
        match message.strip_prefix("invalid type: map, expected ") {
            Some("f64") => Kind::Value("number"),
            Some("u32" | "usize") => Kind::Value("integer"),
            Some("a boolean") => Kind::Value("boolean"),
            Some("a string") => Kind::Value("string"),
            Some("path string") => Kind::Value("path"),
            Some("a sequence") => Kind::List,
            Some(array) if array.starts_with("an array of length ") => {
                Kind::Array(array.rsplit(' ').next().unwrap().parse().unwrap())
            }
            _ => panic!("{}: {message}", self.pointer),
        }
    }

    /// A value that is read at this place.
    fn sample(&self) -> String {
        match self.kind() {
            Kind::Value("boolean") => "true".into(),
            Kind::Value("string" | "path") => "\"a\"".into(),
            Kind::Value(_) => "1".into(),
            Kind::List => "[]".into(),
            Kind::Array(length) => format!("[{}]", vec![self.entry().sample(); length].join(", ")),
            Kind::Table(keys) => table(&self.required(&keys)),
            Kind::Map => "{}".into(),
            Kind::Choice(names) => {
                let place = self.key(&names[0], &BTreeMap::new());
                match place.kind() {
                    Kind::Name => format!("\"{}\"", names[0]),
                    _ => format!("{{ {} = {} }}", names[0], place.sample()),
                }
            }
            Kind::Name => unreachable!("the name of a variant has no value"),
        }
    }

    /// The keys that a table must have, each with a value. They are exact where the tables around
    /// it are complete.
    fn required(&self, keys: &[String]) -> BTreeMap<String, String> {
        let mut found = BTreeMap::new();
        while let Err(message) = self.read(&table(&found)) {
            let missing = message.strip_prefix("missing field `").and_then(|m| m.strip_suffix('`'));
            let missing = missing.unwrap_or_else(|| panic!("{}: {message}", self.pointer));
            if found.contains_key(missing) || !keys.iter().any(|key| key == missing) {
                break;
            }
            found.insert(missing.to_string(), self.key(missing, &found).sample());
        }
        found
    }

    /// What the page calls the type.
    fn name(&self) -> String {
        let entries = || match self.entry() {
            entry if matches!(entry.kind(), Kind::Array(_)) => format!("({})", entry.name()),
            entry => format!("{}s", entry.name()),
        };
        match self.kind() {
            Kind::Value(name) => name.into(),
            Kind::Table(_) => "table".into(),
            Kind::Map => "table by name".into(),
            Kind::Choice(names) => {
                names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
            }
            Kind::List => format!("list of {}", entries()),
            Kind::Array(length) => format!("{length} {}", entries()),
            Kind::Name => unreachable!("the name of a variant has no type"),
        }
    }

    /// Adds the keys of what stands at this place, whose path is `path`.
    fn collect(&self, path: &str, found: &mut Keys) {
        match self.kind() {
            Kind::Table(keys) => self.collect_table(&keys, path, found),
            Kind::Choice(names) => {
                for name in names {
                    let place = self.key(&name, &BTreeMap::new());
                    let path = format!("{path}.{name}");
                    if let Kind::Value(kind) = place.kind() {
                        found.insert(path, (kind.into(), Fallback::Nothing));
                    } else {
                        place.collect(&path, found);
                    }
                }
            }
            Kind::List => self.entry().collect(path, found),
            Kind::Value(_) | Kind::Array(_) | Kind::Map | Kind::Name => {}
        }
    }

    fn collect_table(&self, keys: &[String], path: &str, found: &mut Keys) {
        let required = self.required(keys);
        let scene = self.read(&table(&required)).unwrap_or_else(|e| panic!("{path}: {e}"));
        let scene = serde_json::to_value(&scene).unwrap();
        let read = scene.pointer(&self.pointer).unwrap();
        for key in keys {
            let place = self.key(key, &required);
            let fallback = match (required.contains_key(key), read.get(key)) {
                (true, _) => Fallback::Required,
                (false, None | Some(Value::Null | Value::Object(_))) => Fallback::Nothing,
                (false, Some(value)) => Fallback::Value(in_floats(value)),
            };
            let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
            found.insert(path.clone(), (place.name(), fallback));
            place.collect(&path, found);
        }
    }
}

fn table(entries: &BTreeMap<String, String>) -> String {
    let entries: Vec<String> = entries.iter().map(|(key, value)| format!("{key} = {value}")).collect();
    format!("{{ {} }}", entries.join(", "))
}

/// The parts of a text between `` ` ``.
fn code_spans(text: &str) -> impl Iterator<Item = &str> {
    text.split('`').skip(1).step_by(2)
}

/// A value in which 1 and 1.0 are the same.
fn in_floats(value: &Value) -> Value {
    match value {
        Value::Number(number) => number.as_f64().into(),
        Value::Array(values) => values.iter().map(in_floats).collect(),
        value => value.clone(),
    }
}

fn page() -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/scene-file.md");
    std::fs::read_to_string(path).unwrap()
}

/// The keys in the tables of the page: below a heading that ends with `` `[[bodies]]` ``, those of
/// `bodies`.
fn listed() -> Keys {
    let page = page();
    let (mut section, mut keys) = (String::new(), Keys::new());
    for line in page.lines() {
        if line.starts_with('#') {
            let name = code_spans(line).next().unwrap_or_default();
            section = name.trim_matches(['[', ']']).to_string();
        }
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let ["", key, kind, _unit, default, meaning, ""] = cells[..] else { continue };
        let Some(key) = code_spans(key).next() else { continue };
        let fallback = match code_spans(default).next() {
            Some(value) => Fallback::Value(value_of(value)),
            None if default == "required" => Fallback::Required,
            None => Fallback::Nothing,
        };
        let path = if section.is_empty() { key.to_string() } else { format!("{section}.{key}") };
        let before = keys.insert(path, (kind.to_string(), fallback));
        assert!(before.is_none(), "{section}.{key} is listed twice");
        assert!(!meaning.is_empty(), "{section}.{key} has no meaning");
    }
    keys
}

fn value_of(text: &str) -> Value {
    let table: BTreeMap<String, Value> = toml::from_str(&format!("value = {text}")).unwrap();
    in_floats(&table["value"])
}

#[test]
fn the_page_of_scene_files_lists_the_keys_of_the_types() {
    let (mut keys, listed) = (Keys::new(), listed());
    Place::root().collect("", &mut keys);
    let paths: BTreeSet<&String> = keys.keys().chain(listed.keys()).collect();
    let wrong: Vec<String> = paths
        .into_iter()
        .filter(|&path| keys.get(path) != listed.get(path))
        .map(|path| format!("{path}: {:?}, and the page has {:?}", keys.get(path), listed.get(path)))
        .collect();
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn the_scene_of_the_page_meets_its_criterion() {
    let page = page();
    let text = page.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let loaded = LoadedScene::parse(text.into(), "page.toml").unwrap();
    let system = loaded.system().unwrap();
    let (_, summary) = run(&loaded, system);
    assert_eq!(summary.passed, Some(true), "{:?}", summary.criteria);
}
