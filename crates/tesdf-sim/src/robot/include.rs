//! The files that an MJCF file includes, put in their places.
//!
//! `mjcf-rs` 0.36 follows includes too, but not those whose first element is `<mujocoinclude>`,
//! which MuJoCo takes as well.
use std::path::Path;

use super::{RobotError, bounds, parse, read};

/// Largest size of the text with all includes.
const MAX_BYTES: usize = 1 << 28;

/// The text of the MJCF file at `path` with the contents of the files that it includes, whose names
/// are relative to the folder of the file.
///
/// # Errors
/// A file cannot be read, is no XML, or includes itself; elements are nested too deep, or there are
/// too many of them.
pub fn expand(path: &Path) -> Result<String, RobotError> {
    bounds::check(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    inner(path, folder)
}

/// [`bounds::check`] has bounded how deep this recurses, and how often.
fn inner(path: &Path, folder: &Path) -> Result<String, RobotError> {
    let text = read(path)?;
    let document = parse(path, &text)?;
    let mut out = String::new();
    let mut end = 0;
    for node in document.descendants().filter(|node| node.has_tag_name("include")) {
        let included = folder.join(node.attribute("file").unwrap_or_default());
        let whole = inner(&included, folder)?;
        let content = parse(&included, &whole)?;
        out += &text[end..node.range().start];
        for child in content.root_element().children() {
            out += &whole[child.range()];
        }
        end = node.range().end;
        if out.len() > MAX_BYTES {
            let line = document.text_pos_at(node.range().start).row;
            let found = format!("with its includes the file has more than {MAX_BYTES} bytes");
            return Err(RobotError::in_line(path, line, found));
        }
    }
    out += &text[end..];
    Ok(out)
}
