//! A module of the library uses only the modules before it, no files of a crate use each other in a
//! cycle, and each file of tests belongs to a program.
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// The order of the modules, as in `docs/architecture.md` and in the documentation of the crate.
const ORDER: [&str; 16] = [
    "base", "parallel", "input", "save", "program", "geometry", "sampling", "mesh", "domain", "asset",
    "query", "verify", "encode", "deform", "collide", "inspect",
];
/// The order of the folders and files of `collide`.
const ORDER_OF_COLLIDE: [&str; 12] = [
    "scene",
    "mode",
    "options",
    "pairs",
    "report",
    "bodies",
    "search",
    "cones",
    "clearance",
    "narrow",
    "time_of_impact",
    "detect",
];
/// Shared parts of the unit tests. Every module may use it.
const FOR_TESTS: &str = "testing";

/// Path of a module or an item from the root of the crate.
type Names = Vec<String>;

/// Files of the crate by module, without comments and unit tests, and the re-exports of the
/// modules.
struct Source {
    files: BTreeMap<Names, String>,
    exports: BTreeMap<Names, Names>,
}

impl Source {
    /// The source of a crate, by its folder.
    fn read(krate: &Path) -> Self {
        let mut source = Self { files: BTreeMap::new(), exports: BTreeMap::new() };
        source.add(&krate.join("src"), &Vec::new());
        for (module, code) in &source.files {
            for (at, _) in code.match_indices("pub use ").chain(code.match_indices("pub(crate) use ")) {
                let tree = &code[at..][code[at..].find(" use ").map_or(0, |use_at| use_at + 5)..];
                for names in tree_of(tree, &Vec::new()).0 {
                    let from = match names[0].as_str() {
                        "crate" => names[1..].to_vec(),
                        _ => [module.as_slice(), &names].concat(),
                    };
                    let last = names[names.len() - 1].clone();
                    source.exports.insert([module.as_slice(), &[last]].concat(), from);
                }
            }
        }
        source
    }

    fn add(&mut self, path: &Path, module: &Names) {
        for entry in fs::read_dir(path).expect("a folder of the crate") {
            let path = entry.expect("an entry").path();
            let name = path.file_stem().and_then(|name| name.to_str()).expect("a name").to_owned();
            let inner = match name.as_str() {
                "lib" | "mod" => module.clone(),
                _ => [module.as_slice(), &[name]].concat(),
            };
            if path.is_dir() {
                self.add(&path, &inner);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                self.files.insert(inner, code(&fs::read_to_string(&path).expect("text")));
            }
        }
    }

    /// The module whose file defines an item.
    fn home(&self, item: &[String]) -> Names {
        let known = (0..=item.len()).rev().find(|&n| self.files.contains_key(&item[..n])).unwrap_or(0);
        match item.get(..=known).and_then(|exported| self.exports.get(exported)) {
            Some(from) if from.as_slice() != item => self.home(from),
            _ => item[..known].to_vec(),
        }
    }

    /// The modules that a file uses, except its own parents and children.
    fn used(&self, module: &Names) -> BTreeSet<Names> {
        let homes = paths(&self.files[module], module).into_iter().map(|item| self.home(&item));
        homes.filter(|home| !home.starts_with(module) && !module.starts_with(home)).collect()
    }
}

/// The text without comments and unit tests.
fn code(text: &str) -> String {
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// The items that a file names by a path that begins with `crate`, `self` or `super`.
fn paths(code: &str, module: &Names) -> Vec<Names> {
    let mut items = Vec::new();
    for start in ["crate::", "self::", "super::"] {
        for (at, _) in code.match_indices(start) {
            if code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':') {
                continue;
            }
            let (mut from, mut rest) = (module.clone(), &code[at..]);
            if let Some(below) = rest.strip_prefix("crate::") {
                (from, rest) = (Vec::new(), below);
            }
            rest = rest.strip_prefix("self::").unwrap_or(rest);
            while let Some(below) = rest.strip_prefix("super::") {
                from.pop();
                rest = below;
            }
            items.extend(tree_of(rest, &from).0);
        }
    }
    items
}

/// The items of a use tree below `from`, and the text after the tree.
fn tree_of<'a>(text: &'a str, from: &Names) -> (Vec<Names>, &'a str) {
    if let Some(mut rest) = text.strip_prefix('{') {
        let mut items = Vec::new();
        loop {
            rest = rest.trim_start_matches([' ', '\n', ',']);
            if let Some(after) = rest.strip_prefix('}') {
                return (items, after);
            }
            let (inner, after) = tree_of(rest, from);
            items.extend(inner);
            // An `as` clause is skipped.
            rest = after.trim_start_matches(|c| c != ',' && c != '}');
        }
    }
    let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(text.len());
    let names = [from.as_slice(), &[text[..end].to_owned()]].concat();
    match text[end..].strip_prefix("::") {
        Some(below) if below.starts_with(|c: char| c.is_alphabetic() || c == '_' || c == '{') => {
            tree_of(below, &names)
        }
        _ => (vec![names], &text[end..]),
    }
}

#[test]
fn modules_use_only_earlier_modules() {
    let source = Source::read(Path::new(env!("CARGO_MANIFEST_DIR")));
    let place = |name: &str| ORDER.iter().position(|&other| other == name);
    let room = |module: &Names| {
        let name = module.get(1).filter(|_| module[0] == "collide");
        name.and_then(|name| ORDER_OF_COLLIDE.iter().position(|other| other == name))
    };
    let mut arrows = 0;
    for module in source.files.keys().filter(|module| !module.is_empty() && module[0] != FOR_TESTS) {
        let own = place(&module[0]).unwrap_or_else(|| panic!("{} has a place in the order", module[0]));
        for used in source.used(module).iter().filter(|used| used[0] != FOR_TESTS) {
            assert!(place(&used[0]) <= Some(own), "{} uses {}", module.join("::"), used.join("::"));
            if let (Some(own), Some(used_room)) = (room(module), room(used)) {
                assert!(used_room <= own, "{} uses {}", module.join("::"), used.join("::"));
            }
            arrows += 1;
        }
    }
    assert!(arrows > 300, "{arrows} uses were found");
}

#[test]
fn no_files_use_each_other_in_a_cycle() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let crates =
        fs::read_dir(root.join("crates")).expect("the crates").map(|entry| entry.expect("an entry").path());
    let mut circles = BTreeMap::new();
    for krate in crates.chain([root.join("python")]) {
        let source = Source::read(&krate);
        let mut open: BTreeMap<Names, BTreeSet<Names>> =
            source.files.keys().map(|module| (module.clone(), source.used(module))).collect();
        let mut files = usize::MAX;
        while open.len() < files {
            files = open.len();
            let names: BTreeSet<Names> = open.keys().cloned().collect();
            // A file that uses none of the remaining files, or that none of them uses, is in no cycle.
            open.values_mut().for_each(|used| used.retain(|used| names.contains(used)));
            let used: BTreeSet<Names> = open.values().flatten().cloned().collect();
            open.retain(|name, uses| !uses.is_empty() && used.contains(name));
        }
        if !open.is_empty() {
            circles.insert(krate, open);
        }
    }
    assert!(circles.is_empty(), "{circles:?}");
}

/// Functions of the standard library and of glam whose last bits depend on the platform.
const OF_PLATFORM: [&str; 44] = [
    "acos",
    "acosh",
    "angle_between",
    "angle_to",
    "asin",
    "asinh",
    "atan",
    "atan2",
    "atanh",
    "cbrt",
    "cos",
    "cosh",
    "exp",
    "exp2",
    "exp_m1",
    "from_angle",
    "from_angle_translation",
    "from_axis_angle",
    "from_euler",
    "from_rotation_arc",
    "from_rotation_x",
    "from_rotation_y",
    "from_rotation_z",
    "from_scale_angle_translation",
    "from_scaled_axis",
    "hypot",
    "ln",
    "ln_1p",
    "log",
    "log10",
    "log2",
    "powf",
    "powi",
    "rotate_towards",
    "sin",
    "sin_cos",
    "sinh",
    "slerp",
    "tan",
    "tanh",
    "to_angle",
    "to_axis_angle",
    "to_euler",
    "to_scaled_axis",
];

/// What reaches the bytes of assets, contacts and runs has the same bits on every platform.
#[test]
fn elementary_functions_are_those_of_the_library() {
    let mut uses = 0;
    for krate in ["tesdf", "tesdf-parts", "tesdf-sim"] {
        let source = Source::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(krate));
        let is_for_tests = |name: &String| name == FOR_TESTS || name == "random_tetrahedra";
        for (module, code) in source.files.iter().filter(|(module, _)| !module.iter().any(is_for_tests)) {
            if module.ends_with(&["elementary".to_owned()]) {
                continue;
            }
            uses += code.matches("elementary::").count();
            let code = code.replace("elementary::", "");
            for name in OF_PLATFORM {
                for call in [format!(".{name}("), format!("::{name}")] {
                    let found = code.match_indices(&call).find(|(at, _)| {
                        !code[at + call.len()..].starts_with(|c: char| c.is_alphanumeric() || c == '_')
                    });
                    assert_eq!(
                        found,
                        None,
                        "{krate}: {} has {call}; use base::elementary",
                        module.join("::")
                    );
                }
            }
        }
    }
    assert!(uses > 90, "{uses} uses were found");
}

/// Folders of kernels have the names of folders of the library. A file that has the name of one there
/// mirrors it, and says so at its head.
#[test]
fn kernels_mirror_the_files_whose_names_they_have() {
    let krate = Path::new(env!("CARGO_MANIFEST_DIR"));
    let [library, collide, dynamics] =
        ["src", "src/collide", "../tesdf-sim/src/newton"].map(|folder| krate.join(folder));
    let kernels = krate.join("../tesdf-gpu/src/kernels");
    let (mut open, mut twins) = (vec![kernels.clone()], 0);
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(&folder).expect("a folder of kernels") {
            let path = entry.expect("an entry").path();
            let name = path.strip_prefix(&kernels).expect("of the folder").to_path_buf();
            if path.is_dir() {
                let is_room = [&library, &collide, &dynamics].iter().any(|room| room.join(&name).is_dir());
                assert!(is_room, "{}", name.display());
                open.push(path);
                continue;
            }
            let twin =
                [&collide, &library].map(|room| room.join(&name)).into_iter().find(|twin| twin.exists());
            let twin = twin.filter(|_| name.file_name().is_some_and(|name| name != "mod.rs"));
            let mirrors = twin.map(|twin| twin.strip_prefix(&library).expect("a file").display().to_string());
            let text = fs::read_to_string(&path).expect("text");
            let said = text
                .lines()
                .find_map(|line| line.strip_prefix("//! Mirrors `")?.strip_suffix("` of `tesdf`."));
            assert_eq!(said, mirrors.as_deref(), "{}", name.display());
            twins += usize::from(said.is_some());
        }
    }
    assert!(twins > 20, "{twins} files mirror others");
}

/// A file that no test program names would not be compiled, and nothing would say so.
#[test]
fn every_test_file_belongs_to_a_program() {
    let names = |folder: &Path| -> Vec<String> {
        let entries =
            fs::read_dir(folder).expect("a folder of tests").map(|entry| entry.expect("an entry").path());
        let code = entries.filter(|path| path.is_dir() || path.extension().is_some_and(|end| end == "rs"));
        code.map(|path| path.file_stem().expect("a name").to_string_lossy().into_owned()).collect()
    };
    let mut modules = 0;
    for entry in fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("..")).expect("the crates") {
        let krate = entry.expect("a crate").path();
        let (tests, it) = (krate.join("tests"), krate.join("tests/it"));
        if !tests.exists() {
            continue;
        }
        let manifest = fs::read_to_string(krate.join("Cargo.toml")).expect("a manifest");
        for name in names(&tests).iter().filter(|name| tests.join(format!("{name}.rs")).exists()) {
            let path = format!("path = \"tests/{name}.rs\"");
            assert!(manifest.contains(&path), "{}: {path} is not there", krate.display());
        }
        assert!(manifest.contains("path = \"tests/it/main.rs\""), "{}", krate.display());
        let main = fs::read_to_string(it.join("main.rs")).expect("the program");
        for name in names(&it).iter().filter(|name| *name != "main") {
            assert!(main.contains(&format!("mod {name};\n")), "{}: no mod {name}", krate.display());
            modules += 1;
        }
    }
    assert!(modules > 120, "{modules} modules of tests");
}
