//! Bounds what an MJCF file becomes with the files that it includes, before a parser that recurses
//! reads it.
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use roxmltree::Node;

use super::{RobotError, parse, read};

/// Greatest depth of elements, with those of included files: each takes some kilobytes of the
/// stack, and threads may have 2 MiB.
const MAX_DEPTH: usize = 64;
/// Greatest number of elements, each included file counted as often as it is included. The parser
/// takes a time that grows with the square of the number of attached bodies.
const MAX_ELEMENTS: u64 = 1 << 17;

/// What a file becomes.
#[derive(Clone, Copy, Default)]
struct Size {
    depth: usize,
    elements: u64,
}

/// The sizes of the files that are measured, and the files in which the measurement is.
struct Files<'a> {
    /// What the model includes is relative to it.
    folder: &'a Path,
    /// By path, and whether the file is of a model to attach.
    known: BTreeMap<(PathBuf, bool), Size>,
    open: Vec<PathBuf>,
}

/// Checks the MJCF file at `path` and all files that it includes or attaches. Each is read once.
///
/// # Errors
/// A file cannot be read or is no XML, a file includes itself, elements are nested too deep, or
/// there would be too many of them.
pub(super) fn check(path: &Path) -> Result<(), RobotError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    Files { folder, known: BTreeMap::new(), open: Vec::new() }.measure(path, false).map(|_| ())
}

impl Files<'_> {
    fn measure(&mut self, path: &Path, is_model: bool) -> Result<Size, RobotError> {
        if let Some(&size) = self.known.get(&(path.to_owned(), is_model)) {
            return Ok(size);
        }
        let text = read(path)?;
        let document = parse(path, &text)?;
        let line = |node: Node<'_, '_>| document.text_pos_at(node.range().start).row;
        self.open.push(path.to_owned());
        let (mut size, mut models) = (Size::default(), BTreeMap::new());
        // The depth of each element, in the order of the document, whose nodes are numbered so.
        let mut depths: Vec<usize> = Vec::new();
        for node in document.descendants() {
            let above = node.parent().and_then(|parent| depths.get(parent.id().get_usize()));
            let depth = above.copied().unwrap_or(0) + usize::from(node.is_element());
            depths.push(depth);
            let other = match node.tag_name().name() {
                "include" => self.included(path, is_model, node, &line)?,
                "model" => {
                    // Its file is relative to that of the model that attaches it.
                    let file = node.attribute("file").map(|name| path.with_file_name(name));
                    let model = file.map(|file| self.other(path, &file, true, &|| line(node)));
                    let model = model.transpose()?.unwrap_or_default();
                    models.extend(node.attribute("name").map(|name| (name, model)));
                    model
                }
                "attach" => {
                    node.attribute("model").and_then(|model| models.get(model)).copied().unwrap_or_default()
                }
                _ => Size::default(),
            };
            size.depth = size.depth.max(depth + other.depth);
            let own = u64::from(node.is_element());
            size.elements = size.elements.saturating_add(other.elements).saturating_add(own);
            if size.depth > MAX_DEPTH {
                let found = format!("elements are nested {} deep", size.depth);
                let reason = format!("{found}; expected at most {MAX_DEPTH}: divide the chain of bodies");
                return Err(RobotError::in_line(path, line(node), reason));
            }
            if size.elements > MAX_ELEMENTS {
                let found = format!("with this element and its includes there are {}", size.elements);
                let reason = format!("{found}; expected at most {MAX_ELEMENTS}: include less");
                return Err(RobotError::in_line(path, line(node), reason));
            }
        }
        self.open.pop();
        self.known.insert((path.to_owned(), is_model), size);
        Ok(size)
    }

    fn included(
        &mut self,
        path: &Path,
        is_model: bool,
        node: Node<'_, '_>,
        line: &dyn Fn(Node<'_, '_>) -> u32,
    ) -> Result<Size, RobotError> {
        let Some(name) = node.attribute("file") else {
            return Err(RobotError::in_line(path, line(node), "<include> has no file; expected one"));
        };
        let folder = if is_model { path.parent().unwrap_or(Path::new("")) } else { self.folder };
        self.other(path, &folder.join(name), is_model, &|| line(node))
    }

    /// `line` counts from the start of the file, so it is called for an error alone.
    fn other(
        &mut self,
        path: &Path,
        file: &Path,
        is_model: bool,
        line: &dyn Fn() -> u32,
    ) -> Result<Size, RobotError> {
        let at = |found: String| RobotError::in_line(path, line(), found);
        if let Err(e) = std::fs::metadata(file) {
            return Err(at(format!("cannot read {}: {e}", file.display())));
        }
        if self.open.iter().any(|open| open == file) {
            return Err(at(format!("{} includes itself; expected files that end", file.display())));
        }
        if self.open.len() >= MAX_DEPTH {
            return Err(at(format!("{MAX_DEPTH} files include each other; expected fewer: join them")));
        }
        self.measure(file, is_model)
    }
}

#[cfg(test)]
mod tests {
    use super::super::expand;

    fn refusal(files: &[(&str, String)]) -> String {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        expand(&folder.path().join(files[0].0)).expect_err("it was accepted").to_string()
    }

    fn chain(bodies: usize) -> String {
        let (open, close) = ("<body>".repeat(bodies), "</body>".repeat(bodies));
        format!("<mujoco><worldbody>{open}{close}</worldbody></mujoco>")
    }

    #[test]
    fn bodies_nested_too_deep_are_refused_and_others_fit_the_stack() {
        let told = refusal(&[("robot.xml", chain(3000))]);
        assert!(told.contains("line 1: 257 elements within each other"), "{told}");
        let told = refusal(&[("robot.xml", chain(200))]);
        assert!(told.contains("line 1: elements are nested 65 deep; expected at most 64"), "{told}");
        let half = |name: &str| {
            let deep = "<body>".repeat(32);
            format!("<mujoco>{deep}<include file='{name}'/>{}</mujoco>", "</body>".repeat(32))
        };
        let told = refusal(&[("robot.xml", half("other.xml")), ("other.xml", half("robot.xml"))]);
        assert!(told.contains("robot.xml includes itself"), "{told}");
        let told = refusal(&[("robot.xml", half("other.xml")), ("other.xml", chain(32))]);
        assert!(told.contains("nested 68 deep"), "{told}");
        // The thread of a test has the 2 MiB that all threads but the first have.
        let model = mjcf_rs::Model::from_str(&chain(62), ".").unwrap();
        assert_eq!(model.bodies.len(), 63);
    }

    #[test]
    fn files_that_include_each_other_many_times_are_refused_at_once() {
        for (one, many) in [
            ("<include file='{}'/>", ""),
            ("<asset><model name='m{n}' file='{}'/></asset>", ""),
            ("", "<asset><model name='m' file='{}'/></asset><worldbody>{attach}</worldbody>"),
        ] {
            let text = |k: usize| {
                let next = format!("f{}.xml", k + 1);
                let ten = (0..10).map(|n| one.replace("{}", &next).replace("{n}", &n.to_string()));
                let ten: String = ten.collect();
                let attach = "<attach model='m' body='b'/>".repeat(10);
                let many = many.replace("{}", &next).replace("{attach}", &attach);
                format!("<mujoco>{ten}{many}</mujoco>")
            };
            let mut files: Vec<_> = (0..12).map(|k| (format!("f{k}.xml"), text(k))).collect();
            files.push(("f12.xml".into(), "<mujoco/>".into()));
            let files: Vec<_> = files.iter().map(|(name, text)| (name.as_str(), text.clone())).collect();
            let told = refusal(&files);
            assert!(told.contains("expected at most 131072"), "{told}");
        }
        let told =
            refusal(&[("a.xml", "<mujoco><asset><model name='a' file='a.xml'/></asset></mujoco>".into())]);
        assert!(told.contains("a.xml includes itself"), "{told}");
    }
}
