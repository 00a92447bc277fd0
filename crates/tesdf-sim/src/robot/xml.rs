//! Bounds on XML, before a parser that recurses, or takes a time that grows with the square of a
//! count, reads it.
//!
//! `roxmltree` 0.21 compares each attribute of an element with all before it, copies the namespaces
//! of an element to those within, and replaces entities within entities.
use std::path::Path;

use roxmltree::{Document, ParsingOptions};

use super::RobotError;

/// Greatest depth of elements.
const MAX_DEPTH: usize = 256;
/// Greatest number of attributes of an element, those of namespaces included.
const MAX_ATTRIBUTES: usize = 256;
/// Greatest number of attributes of a file that declare a namespace.
const MAX_NAMESPACES: usize = 256;

/// The XML of the file at `path`.
///
/// # Errors
/// It is none, or exceeds a bound.
pub fn parse<'a>(path: &Path, text: &'a str) -> Result<Document<'a>, RobotError> {
    if let Err((at, found)) = (Scan { text, at: 0, depth: 0, namespaces: 0 }).whole() {
        let line = 1 + text.as_bytes()[..at].iter().filter(|&&byte| byte == b'\n').count();
        return Err(RobotError::in_line(path, u32::try_from(line).unwrap_or(u32::MAX), found));
    }
    let options = ParsingOptions { allow_dtd: true, ..ParsingOptions::default() };
    Document::parse_with_options(text, options)
        .map_err(|e| RobotError::in_file(path, format!("the XML is broken: {e}")))
}

/// A place in a text that is scanned once. Where the text is no XML, the scan may end early: a
/// parser ends at that place, too.
struct Scan<'a> {
    text: &'a str,
    at: usize,
    depth: usize,
    namespaces: usize,
}

/// The byte at fault, and what was found there.
type Refused = (usize, String);

impl Scan<'_> {
    fn whole(mut self) -> Result<(), Refused> {
        while self.skip_to("<") {
            let rest = &self.text.as_bytes()[self.at..];
            // A comment may contain tags, and a tag may contain the start of a comment.
            match rest {
                [b'<', b'!', b'-', b'-', ..] => self.skip_past(4, "-->"),
                [b'<', b'!', b'[', ..] => self.skip_past(3, "]]>"),
                [b'<', b'?', ..] => self.skip_past(2, "?>"),
                [b'<', b'!', ..] => self.document_type()?,
                [b'<', b'/', ..] => {
                    self.depth = self.depth.saturating_sub(1);
                    self.skip_past(2, ">");
                }
                _ => self.element()?,
            }
        }
        Ok(())
    }

    /// Moves to the next `end`. Returns whether there is one.
    fn skip_to(&mut self, end: &str) -> bool {
        let found = self.text.get(self.at..).and_then(|rest| rest.find(end));
        self.at = found.map_or(self.text.len(), |found| self.at + found);
        found.is_some()
    }

    fn skip_past(&mut self, start: usize, end: &str) {
        self.at = self.text.len().min(self.at + start);
        if self.skip_to(end) {
            self.at += end.len();
        }
    }

    /// The bytes from here to the end of a tag, which are not in quotes.
    fn tag(&mut self, mut each: impl FnMut(usize, u8) -> Result<(), Refused>) -> Result<(), Refused> {
        let mut quote = None;
        while let Some(&byte) = self.text.as_bytes().get(self.at) {
            self.at += 1;
            match (quote, byte) {
                (None, b'>') => break,
                (None, b'"' | b'\'') => quote = Some(byte),
                (None, _) => each(self.at - 1, byte)?,
                (Some(open), _) if open == byte => quote = None,
                _ => {}
            }
        }
        Ok(())
    }

    fn document_type(&mut self) -> Result<(), Refused> {
        self.tag(|at, byte| match byte {
            b'[' => Err((at, "the document type declares entities; expected none".into())),
            _ => Ok(()),
        })
    }

    fn element(&mut self) -> Result<(), Refused> {
        let start = self.at;
        let bytes = self.text.as_bytes();
        let (mut attributes, mut namespaces, mut word, mut last) = (0, 0, start, b'<');
        self.at += 1;
        self.tag(|at, byte| {
            match byte {
                b'=' => {
                    attributes += 1;
                    namespaces += usize::from(bytes[word..at].starts_with(b"xmlns"));
                }
                _ if last.is_ascii_whitespace() => word = at,
                _ => {}
            }
            last = byte;
            Ok(())
        })?;
        self.namespaces += namespaces;
        let is_empty = bytes[..self.at].ends_with(b"/>");
        self.depth += usize::from(!is_empty);
        for (found, most, what) in [
            (attributes, MAX_ATTRIBUTES, "attributes of an element"),
            (self.namespaces, MAX_NAMESPACES, "namespaces"),
            (self.depth, MAX_DEPTH, "elements within each other"),
        ] {
            if found > most {
                return Err((start, format!("{found} {what}; expected at most {most}")));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<(), String> {
        parse(Path::new("robot.urdf"), text).map(drop).map_err(|e| e.to_string())
    }

    fn many(start: &str, each: impl Fn(usize) -> String, end: &str) -> String {
        let each: String = (0..100_000).map(each).collect();
        format!("{start}{each}{end}")
    }

    /// Each took minutes, or all memory.
    #[test]
    fn what_takes_the_square_of_a_count_is_refused_at_once() {
        let spaces = |k| format!(" xmlns:a{k}='u{k}'");
        let hidden = "<!DOCTYPE robot SYSTEM '<!--'>\n<robot";
        let deep = format!("{}{}", many("<robot>", |_| "<x>".into(), ""), "</x>".repeat(100_000));
        let nested = many("<robot>", |k| format!("<x{}>", spaces(k)), "");
        for (text, told) in [
            (many("<robot", |k| format!(" a{k}='>'"), "/>"), "line 1: 100000 attributes of an element"),
            (many(hidden, |k| format!(" a{k}='1'"), "/>"), "line 2: 100000 attributes of an element"),
            (many("<robot", spaces, "/>"), "line 1: 100000 attributes"),
            (many("<robot>\n", |k| format!("<x{}/>", spaces(k)), "</robot>"), "line 2: 257 namespaces"),
            (nested, "line 1: 257 "),
            (deep, "line 1: 257 elements within each other; expected at most 256"),
            (many("<!DOCTYPE robot [", |k| format!("<!ENTITY a{k} 'x'>"), "]><robot/>"), "declares entities"),
        ] {
            let refused = read(&text).unwrap_err();
            assert!(refused.starts_with("robot.urdf, ") && refused.contains(told), "{refused}");
        }
    }

    #[test]
    fn ordinary_xml_is_read() {
        for text in [
            "<?xml version='1.0'?><!DOCTYPE robot><robot/>",
            "<!DOCTYPE robot SYSTEM 'robot.dtd' >\n<robot xmlns:a='u' a:b='>'>\n<!-- <x> --><x/></robot>",
            "<robot><![CDATA[ <x <x ]]><x a='1' b = \"=\" /></robot>",
        ] {
            read(text).unwrap();
        }
        let flat = many("<robot>", |k| format!("<link name='l{k}'><x/></link>"), "</robot>");
        read(&flat).unwrap();
        for broken in ["", "<", "<!", "<!-", "<!--", "<![", "<?", "</", "<a", "<a b='", "é<é é='"] {
            assert!(read(broken).unwrap_err().contains("the XML is broken"), "{broken}");
        }
    }
}
