//! `docs/json.md` has every key that the tool prints, with its type, and no other.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::Value;

use crate::folder::Folder;

const PAGE: &str = include_str!("../../../../docs/json.md");

/// An open cube, whose bottom is missing.
const OPEN: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
                    f 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

/// Types by key.
type Keys = BTreeMap<String, String>;

/// The keys of a section of the page, with those of the sections that it refers to.
fn keys_of(section: &str, below: &str) -> Keys {
    let head = format!("## {section}\n");
    let text = PAGE.split_once(&head).unwrap_or_else(|| panic!("no section {section}")).1;
    let rows = text.split("\n## ").next().unwrap().lines().filter(|line| line.starts_with("| "));
    let mut keys = Keys::new();
    for row in rows.skip_while(|row| row.starts_with("| key")) {
        let cells: Vec<_> = row.trim_matches('|').splitn(3, " | ").map(str::trim).collect();
        let (key, kind, meaning) = match cells[..] {
            [key, kind, meaning] => (key, kind, meaning),
            [kind, meaning] => ("", kind, meaning),
            _ => panic!("{row}"),
        };
        let key = joined(below, key.trim_matches('`'));
        let other = meaning.split_once("](#").map(|(_, name)| name.split_once(')').unwrap().0);
        if let Some(other) = other.filter(|_| kind != "any") {
            keys.append(&mut keys_of(other, &key));
        }
        if key != below {
            keys.insert(key, kind.to_owned());
        }
    }
    keys
}

fn joined(above: &str, key: &str) -> String {
    format!("{above}.{key}").trim_matches('.').to_owned()
}

/// Compares a value with the keys, and adds those that it has to `printed`.
fn compare(value: &Value, at: &str, keys: &Keys, printed: &mut BTreeSet<String>) {
    match value {
        Value::Array(all) => all.iter().for_each(|one| compare(one, at, keys, printed)),
        Value::Object(fields) => {
            for (name, value) in fields {
                let key = joined(at, name);
                let kind = keys.get(&key).unwrap_or_else(|| panic!("the page has no {key}: {value}"));
                let fits = |kind: &str| match kind {
                    "any" => true,
                    "null" => value.is_null(),
                    "boolean" => value.is_boolean(),
                    "text" => value.is_string(),
                    "integer" => value.is_i64() || value.is_u64(),
                    "number" => value.is_number(),
                    "list" => value.is_array(),
                    "object" => value.is_object(),
                    _ => panic!("{kind}"),
                };
                assert!(kind.split(" or ").any(fits), "{key} is {kind} on the page: {value}");
                if kind != "any" {
                    compare(value, &key, keys, printed);
                }
                printed.insert(key);
            }
        }
        _ => {}
    }
}

/// Runs commands that print the JSON of a section.
fn check(folder: &Folder, section: &str, commands: &[&str]) {
    let (keys, mut printed) = (keys_of(section, ""), BTreeSet::new());
    for command in commands {
        let args: Vec<_> = command.split(' ').map(|arg| arg.replace('_', " ")).collect();
        let args: Vec<_> = args.iter().map(String::as_str).chain(["--json"]).collect();
        let (_, out, err) = folder.tesdf(&args);
        let value = serde_json::from_str(&out).unwrap_or_else(|e| panic!("{command}: {e}: {err}"));
        compare(&value, "", &keys, &mut printed);
    }
    let missing: Vec<_> = keys.keys().filter(|key| !printed.contains(*key)).collect();
    assert!(missing.is_empty(), "{section}: no command printed {missing:?}");
}

#[test]
fn the_page_has_each_key_that_is_printed_and_no_other() {
    let folder = Folder::new();
    folder.write("open.obj", OPEN);
    std::fs::create_dir(folder.path("meshes")).unwrap();
    folder.write("meshes/open.obj", OPEN);
    let check = |section, commands: &[&str]| check(&folder, section, commands);
    check("part", &["part peg -o peg.stl"]);
    let encodings = [
        "encode peg.stl -o peg.tesdf --preset gpu",
        "encode open.obj -o repaired.tesdf --repair auto",
        "encode open.obj -o jumps.tesdf --inside generalized",
    ];
    check("encode", &encodings);
    check("check", &["check peg.stl", "check peg.stl open.obj"]);
    check("repair", &["repair open.obj -o closed.ply --fill-holes"]);
    check("encode-all", &["encode-all meshes -o all"]);
    check("inspect", &["inspect peg.tesdf repaired.tesdf jumps.tesdf", "inspect peg.tesdf"]);
    folder.write("wrong.json", crate::tes_json::FILE.replace("LIST", "0"));
    folder.good(&["import", "wrong.json", "-o", "wrong.tesdf"]);
    let proofs = ["peg", "wrong"].map(|name| format!("verify {name}.tesdf --prove --samples 50"));
    check("verify", &proofs.each_ref().map(String::as_str));
    let beside = "collide peg.tesdf peg.tesdf --pose-a 0.007_0_0.001_0_0_0_1";
    let same = "collide peg.tesdf peg.tesdf --mode node --report";
    check("collide", &[beside]);
    check("collide --report", &[&format!("{beside} --report"), same]);
    check("collide --why", &[&format!("{beside} --why")]);
    check("clearance", &["clearance peg.tesdf peg.tesdf --pose-a 0.05_0_0_0_0_0_1"]);
    check("toi", &["toi peg.tesdf peg.tesdf --pose-a 0.05_0_0_0_0_0_1 --velocity-a -1_0_0_0_0_0"]);
    let body = |name, more| format!("[[bodies]]\nname = \"{name}\"\nasset = \"peg.tesdf\"\n{more}\n");
    let bodies = body("a", "fixed = true") + &body("b", "density = 1000");
    folder.write("s.toml", format!("time_step = 1e-3\nduration = 2e-3\ngravity = [0, 0, 0]\n{bodies}"));
    check("simulate", &["simulate s.toml -o run"]);
}

#[test]
fn several_files_are_a_list_and_the_exit_code_is_the_worst() {
    let folder = Folder::new();
    folder.write("open.obj", OPEN);
    folder.good(&["part", "peg", "-o", "peg.stl"]);
    let code = |args: &[&str]| folder.tesdf(args).0;
    assert_eq!(code(&["check", "peg.stl", "peg.stl"]), Some(0));
    assert_eq!(code(&["check", "open.obj", "peg.stl"]), Some(1));
    let (code, out, err) = folder.tesdf(&["check", "peg.stl", "none.obj", "open.obj"]);
    assert_eq!(code, Some(2), "{err}");
    assert!(out.contains("peg.stl: STL") && out.contains("\n\nopen.obj: OBJ"), "{out}");
    assert!(out.contains("\nvolume ") && out.contains("\ninertia "), "{out}");
    assert!(err.contains("none.obj"), "{err}");
    assert!(err.contains("error: 1 of 3 files cannot be read"), "{err}");

    let (code, out, _) = folder.tesdf(&["check", "peg.stl", "none.obj", "open.obj", "--json"]);
    let all: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((code, all.as_array().unwrap().len()), (Some(2), 3));
    assert_eq!((&all[0]["file"], &all[1]["file"]), (&"peg.stl".into(), &"none.obj".into()));
    assert!(all[1]["error"].is_string() && all[1].get("check").is_none(), "{out}");
    let alone: Value = serde_json::from_str(&folder.good(&["check", "peg.stl", "--json"])).unwrap();
    assert_eq!(alone, all[0]);

    folder.good(&["encode", "peg.stl", "-o", "peg.tesdf", "--preset", "fast"]);
    let out = folder.good(&["inspect", "peg.tesdf", "peg.tesdf", "--json"]);
    let all: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(all[0], all[1]);
    let [of_asset, of_mesh] = [&all[0], &alone].map(|found| found["solid"]["volume"].as_f64().unwrap());
    assert!((of_asset - of_mesh).abs() < 1e-9 * of_mesh, "{of_asset} {of_mesh}");
}
