//! The files that an MJCF file includes, put in their places.
//!
//! `mjcf-rs` 0.36 follows includes too, but not those whose first element is `<mujocoinclude>`,
//! which MuJoCo takes as well.
use std::path::{Path, PathBuf};

use crate::terminal::report::Failure;

use super::{parse, read};

/// Largest size of the text with all includes.
const MAX_BYTES: usize = 1 << 28;

/// The text of the MJCF file at `path` with the contents of the files that it includes, which are
/// below the folder of the file.
///
/// # Errors
/// A file cannot be read, is no XML, or includes itself.
pub(super) fn expand(path: &Path) -> Result<String, Failure> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut open = vec![path.to_path_buf()];
    let text = read(path)?;
    inner(path, &text, folder, &mut open)
}

fn inner(path: &Path, text: &str, folder: &Path, open: &mut Vec<PathBuf>) -> Result<String, Failure> {
    let document = parse(path, text)?;
    let mut out = String::new();
    let mut end = 0;
    for node in document.descendants().filter(|node| node.has_tag_name("include")) {
        let line = document.text_pos_at(node.range().start).row;
        let at = |found: String| Failure::new(format!("{}, line {line}: {found}", path.display()));
        let Some(name) = node.attribute("file") else {
            return Err(at("<include> has no file; expected one".into()));
        };
        let included = folder.join(name);
        if open.contains(&included) {
            return Err(at(format!("{name} includes itself; expected files that end")));
        }
        let text_of = read(&included).map_err(|e| at(e.message))?;
        open.push(included.clone());
        let whole = inner(&included, &text_of, folder, open)?;
        open.pop();
        let content = parse(&included, &whole)?;
        out += &text[end..node.range().start];
        for child in content.root_element().children() {
            out += &whole[child.range()];
        }
        end = node.range().end;
        if out.len() > MAX_BYTES {
            return Err(at(format!("with its includes the file has more than {MAX_BYTES} bytes")));
        }
    }
    out += &text[end..];
    Ok(out)
}
