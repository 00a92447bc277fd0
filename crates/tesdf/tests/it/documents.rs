//! Everything that the documents of the repository name exists: the targets of relative links,
//! their headings, and source files.
use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};

use tesdf::asset::SectionSpec;
use tesdf::asset::layout::SECTIONS;

/// Folders with files that others wrote or that are made.
const NOT_OURS: [&str; 5] = ["target", ".git", "corpus", "licences", "node_modules"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// All files below a folder, relative to `root`.
fn files(root: &Path, folder: &Path, found: &mut BTreeSet<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name();
        if entry.file_type().unwrap().is_dir() {
            if !NOT_OURS.iter().any(|n| name == *n) {
                files(root, &entry.path(), found);
            }
        } else {
            found.insert(entry.path().strip_prefix(root).unwrap().to_owned());
        }
    }
}

/// The text without blocks of code, line by line.
fn prose(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut is_code = false;
    text.lines().enumerate().filter(move |(_, line)| {
        let is_fence = line.trim_start().starts_with("```");
        is_code ^= is_fence;
        !is_code && !is_fence && !line.starts_with("    ")
    })
}

/// A heading as GitHub names it in links.
fn anchor(heading: &str) -> String {
    let kept = |c: char| c.is_alphanumeric() || c == ' ' || c == '-' || c == '_';
    heading
        .trim()
        .to_lowercase()
        .chars()
        .filter(|&c| kept(c))
        .map(|c| if c == ' ' { '-' } else { c })
        .collect()
}

/// `folder/../name` without the dots.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => drop(plain.pop()),
            Component::CurDir => {}
            part => plain.push(part),
        }
    }
    plain
}

/// The parts of a line between `` ` ``.
fn code_spans(line: &str) -> impl Iterator<Item = &str> {
    line.split('`').skip(1).step_by(2)
}

#[test]
fn links_and_named_files_exist() {
    let root = root();
    let mut all = BTreeSet::new();
    files(&root, &root, &mut all);
    let mut wrong = Vec::new();
    let (mut links, mut names) = (0, 0);
    for document in all.iter().filter(|f| f.extension().is_some_and(|e| e == "md")) {
        let text = fs::read_to_string(root.join(document)).unwrap();
        let folder = document.parent().unwrap();
        for (number, line) in prose(&text) {
            let place = format!("{}:{}", document.display(), number + 1);
            for target in line.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
                if target.contains("://") {
                    continue;
                }
                links += 1;
                let (file, heading) = target.split_once('#').unwrap_or((target, ""));
                let file = if file.is_empty() { document.clone() } else { plain(&folder.join(file)) };
                if !root.join(&file).exists() {
                    wrong.push(format!("{place}: {target}: there is no such file"));
                } else if !heading.is_empty() {
                    let text = fs::read_to_string(root.join(&file)).unwrap();
                    let mut headings = prose(&text)
                        .filter(|(_, l)| l.starts_with('#'))
                        .map(|(_, l)| l.trim_start_matches('#'));
                    if !headings.any(|h| anchor(h) == heading) {
                        wrong.push(format!("{place}: {target}: there is no such heading"));
                    }
                }
            }
            // The changelog names files that may be gone.
            if document.ends_with("CHANGELOG.md") {
                continue;
            }
            for name in code_spans(line).filter(|s| s.ends_with(".rs") && !s.contains(['*', ' '])) {
                names += 1;
                if !all.iter().any(|f| f.ends_with(name)) {
                    wrong.push(format!("{place}: `{name}`: no file's path ends so"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
    // Else nothing was read.
    assert!(links > 40 && names > 40, "{links} links, {names} names");
}

/// The table of sections in the documents has those of the layout, in their order.
#[test]
fn the_documented_sections_are_those_of_the_file() {
    let text = fs::read_to_string(root().join("docs/architecture.md")).unwrap();
    let numbers = |spec: &SectionSpec| match spec.columns {
        1 => format!("{} [", spec.element.name().to_lowercase()),
        columns => format!("{} [*, {columns}]", spec.element.name().to_lowercase()),
    };
    let expected: Vec<_> = SECTIONS.iter().map(|spec| (spec.name.to_owned(), numbers(spec))).collect();
    let documented = |line: &str| {
        let (name, rest) = line.strip_prefix("    ")?.split_once(' ')?;
        let (element, shape) = rest.trim_start().split_once(" [")?;
        let is_section =
            name.contains('.') && SECTIONS.iter().any(|s| s.element.name().to_lowercase() == element);
        let numbers = match shape.split(']').next()?.split_once(", ") {
            Some((_, columns)) => format!("{element} [*, {columns}]"),
            None => format!("{element} ["),
        };
        is_section.then(|| (name.to_owned(), numbers))
    };
    assert_eq!(text.lines().filter_map(documented).collect::<Vec<_>>(), expected);
}
