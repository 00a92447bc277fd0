//! Reads TetGen's `.node` and `.ele`. Vertices count from 0 or 1, as the first line of the `.node`
//! file says.
use glam::DVec3;

use super::{Parsed, ReadTetrahedraError, TetFormat, malformed};
use crate::mesh::{
    Place,
    text::{Lines, shown, without_comment, words},
};

type Result<T> = std::result::Result<T, ReadTetrahedraError>;

pub(super) fn parse(node: &[u8], ele: &[u8]) -> Result<Parsed> {
    let (vertices, base) = nodes(Table::new(node, TetFormat::Node)?)?;
    let tetrahedra = elements(Table::new(ele, TetFormat::Ele)?, vertices.len() as u64, base)?;
    Ok(Parsed { vertices, tetrahedra, ..Parsed::default() })
}

/// A header of counts, followed by the number of rows that its first count gives.
struct Table<'a> {
    format: TetFormat,
    lines: Lines<'a>,
    rows: u64,
    /// The other counts.
    header: Vec<u64>,
    header_line: u64,
}

impl<'a> Table<'a> {
    fn new(bytes: &'a [u8], format: TetFormat) -> Result<Self> {
        let mut table =
            Self { format, lines: Lines::new(bytes), rows: 0, header: Vec::new(), header_line: 1 };
        let Some((line, first)) = table.next_content() else {
            return Err(malformed(format, Place::Line(1), "nothing", "expected a line of counts"));
        };
        table.header_line = line;
        for word in words(first) {
            table.header.push(table.whole(word, line)?);
        }
        table.rows = table.header.remove(0);
        Ok(table)
    }

    fn error(&self, line: u64, found: impl Into<String>, help: impl Into<String>) -> ReadTetrahedraError {
        malformed(self.format, Place::Line(line), found, help)
    }

    fn next_content(&mut self) -> Option<(u64, &'a [u8])> {
        self.lines.by_ref().map(|(n, l)| (n, without_comment(l))).find(|(_, l)| words(l).next().is_some())
    }

    fn whole(&self, word: &[u8], line: u64) -> Result<u64> {
        std::str::from_utf8(word).ok().and_then(|w| w.parse().ok()).ok_or_else(|| {
            self.error(line, format!("{} is not a whole number", shown(word)), "expected a count or an id")
        })
    }

    /// Reads row `row`. Returns the words after its id. The id must be `base` plus the number of
    /// the row.
    fn row(&mut self, row: u64, base: u64) -> Result<(u64, Vec<&'a [u8]>)> {
        let Some((line, text)) = self.next_content() else {
            let found = format!("the file ends after {row} of {} rows", self.rows);
            return Err(self.error(self.lines.number().max(1), found, "is the file cut short?"));
        };
        let mut cells: Vec<_> = words(text).collect();
        let id = self.whole(cells.remove(0), line)?;
        if id.checked_sub(row) != Some(base) {
            let found = format!("row {id}");
            return Err(self.error(line, found, format!("expected row {}", base.saturating_add(row))));
        }
        Ok((line, cells))
    }

    fn is_at_end(&mut self) -> Result<()> {
        let rows = self.rows;
        match self.next_content() {
            None => Ok(()),
            Some((line, text)) => {
                let found = format!("{} after the last of {rows} rows", shown(text.trim_ascii()));
                Err(self.error(line, found, "expected the end: is the count in the first line right?"))
            }
        }
    }
}

/// The vertices, and the number from which they count.
fn nodes(mut table: Table<'_>) -> Result<(Vec<DVec3>, u64)> {
    if table.header.first().is_some_and(|&dimension| dimension != 3) {
        let found = format!("dimension {}", table.header[0]);
        return Err(table.error(table.header_line, found, "expected 3"));
    }
    if table.rows == 0 {
        return Err(table.error(
            table.header_line,
            "no vertices",
            "expected those that TetGen wrote, as in NAME.1.node",
        ));
    }
    // The id of the first row gives the number from which they count.
    let mut lines = Lines::after(table.lines.rest(), table.lines.number());
    let first = lines.find_map(|(_, l)| words(without_comment(l)).next());
    let base = if first == Some(b"1") { 1 } else { 0 };
    let mut vertices = Vec::new();
    for row in 0..table.rows {
        let (line, cells) = table.row(row, base)?;
        let mut p = [0.0; 3];
        for (axis, value) in p.iter_mut().enumerate() {
            let name = ['x', 'y', 'z'][axis];
            let Some(&word) = cells.get(axis) else {
                let found = format!("vertex {} has no {name}", row + base);
                return Err(table.error(line, found, "expected three coordinates"));
            };
            let parsed = std::str::from_utf8(word).ok().and_then(|w| w.parse::<f64>().ok());
            *value = parsed.filter(|v| v.is_finite()).ok_or_else(|| {
                let found = format!("vertex {} has {name} = {}", row + base, shown(word));
                table.error(line, found, "expected a finite decimal number such as -1.5e-3")
            })?;
        }
        vertices.push(p.into());
    }
    table.is_at_end()?;
    Ok((vertices, base))
}

fn elements(mut table: Table<'_>, vertices: u64, base: u64) -> Result<Vec<[u32; 4]>> {
    match table.header.first() {
        None | Some(4) => {}
        Some(10) => {
            return Err(ReadTetrahedraError::Element {
                format: TetFormat::Ele,
                place: Place::Line(table.header_line),
                element: base,
                kind: "a second-order tetrahedron, like all of the file".to_owned(),
            });
        }
        Some(corners) => {
            let found = format!("{corners} vertices for each tetrahedron");
            return Err(table.error(table.header_line, found, "expected 4"));
        }
    }
    let mut tetrahedra = Vec::new();
    for row in 0..table.rows {
        let (line, cells) = table.row(row, base)?;
        let mut corners = [0; 4];
        for (k, corner) in corners.iter_mut().enumerate() {
            let Some(&word) = cells.get(k) else {
                let found = format!("tetrahedron {} has {k} vertices", row + base);
                return Err(table.error(line, found, "expected 4"));
            };
            let id = table.whole(word, line)?;
            *corner = id.checked_sub(base).filter(|&v| v < vertices).ok_or_else(|| {
                let found = format!("tetrahedron {} uses vertex {id}", row + base);
                let help = format!(
                    "expected {base} to {}, which the .node has: do the two files belong together?",
                    vertices + base - 1
                );
                table.error(line, found, help)
            })? as u32;
        }
        tetrahedra.push(corners);
    }
    table.is_at_end()?;
    Ok(tetrahedra)
}
