//! Points and answers as CSV.
use std::io::{self, Write};

use tesdf::glam::DVec3;
use tesdf::query::Answer;

/// Why points cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum PointsError {
    /// The file has no header.
    #[error("the file is empty")]
    Empty,
    /// A column is missing or occurs twice.
    #[error("line 1: the column {column} occurs {count} times; expected once; the header is: {header}")]
    Column {
        /// `x`, `y` or `z`.
        column: &'static str,
        /// Number of columns with that name.
        count: usize,
        /// The header that was found.
        header: String,
    },
    /// A row ends before a needed column.
    #[error("line {line}: {fields} fields, and none for the column {column}; expected at least {expected}")]
    Short {
        /// Line number, from 1.
        line: usize,
        /// `x`, `y` or `z`.
        column: &'static str,
        /// Number of fields in the row.
        fields: usize,
        /// Number of fields that are needed.
        expected: usize,
    },
    /// A row has more fields than the header.
    #[error(
        "line {line}: {fields} fields under {columns} columns; expected one field per column: numbers need a decimal point, because a \
         comma ends a field"
    )]
    Long {
        /// Line number, from 1.
        line: usize,
        /// Number of fields in the row.
        fields: usize,
        /// Number of columns of the header.
        columns: usize,
    },
    /// A field is not a number.
    #[error("line {line}, column {column}: {found:?} is not a number")]
    Number {
        /// Line number, from 1.
        line: usize,
        /// `x`, `y` or `z`.
        column: &'static str,
        /// The text of the field.
        found: String,
    },
    /// The file is not CSV.
    #[error(transparent)]
    Csv(#[from] csv::Error),
}

const COLUMNS: [&str; 3] = ["x", "y", "z"];
/// Error messages cut a field after this number of characters.
const SHOWN: usize = 80;

/// Reads the points of a CSV file from the columns `x`, `y` and `z` of its header. They may have
/// any order and case; other columns are ignored.
///
/// A byte-order mark, CRLF, quotes, blank lines and empty fields at the end of a row are accepted.
/// `nan` and `inf` are valid numbers.
///
/// # Errors
/// [`PointsError`] names the line and column.
pub fn read(bytes: &[u8]) -> Result<Vec<DVec3>, PointsError> {
    let mut reader = csv::ReaderBuilder::new().flexible(true).trim(csv::Trim::All).from_reader(bytes);
    let header = reader.byte_headers()?.clone();
    if header.is_empty() {
        return Err(PointsError::Empty);
    }
    let mut places = [0; 3];
    for (place, column) in places.iter_mut().zip(COLUMNS) {
        let mut found =
            header.iter().enumerate().filter(|(_, name)| name.eq_ignore_ascii_case(column.as_bytes()));
        let (Some((at, _)), None) = (found.next(), found.next()) else {
            let count = header.iter().filter(|name| name.eq_ignore_ascii_case(column.as_bytes())).count();
            let header: Vec<_> = header.iter().map(String::from_utf8_lossy).collect();
            let header = header.join(",").chars().take(SHOWN).collect();
            return Err(PointsError::Column { column, count, header });
        };
        *place = at;
    }
    let mut points = Vec::new();
    let mut row = csv::ByteRecord::new();
    while reader.read_byte_record(&mut row)? {
        let line = || line_of(bytes, row.position().map_or(0, csv::Position::byte));
        let fields = row.iter().rposition(|field| !field.is_empty()).map_or(0, |last| last + 1);
        if fields > header.len() {
            return Err(PointsError::Long { line: line(), fields: row.len(), columns: header.len() });
        }
        let mut p = DVec3::ZERO;
        for (axis, (at, column)) in places.into_iter().zip(COLUMNS).enumerate() {
            let field = row.get(at).ok_or_else(|| PointsError::Short {
                line: line(),
                column,
                fields: row.len(),
                expected: at + 1,
            })?;
            let number = std::str::from_utf8(field).ok().and_then(|text| text.parse().ok());
            p[axis] = number.ok_or_else(|| PointsError::Number {
                line: line(),
                column,
                found: String::from_utf8_lossy(field).chars().take(SHOWN).collect(),
            })?;
        }
        points.push(p);
    }
    Ok(points)
}

/// Line number, from 1, of the row at byte `start`. The line numbers of the `csv` crate do not
/// count blank lines before a row.
fn line_of(bytes: &[u8], start: u64) -> usize {
    let start = usize::try_from(start).map_or(bytes.len(), |s| s.min(bytes.len()));
    let blank = bytes[start..].iter().take_while(|b| matches!(b, b'\r' | b'\n')).count();
    let before = &bytes[..start + blank];
    let ends = |(i, &b): (usize, &u8)| b == b'\n' || b == b'\r' && before.get(i + 1) != Some(&b'\n');
    1 + before.iter().enumerate().filter(|&at| ends(at)).count()
}

/// The header of the answers.
pub const HEADER: &str = "x,y,z,signed_distance,gx,gy,gz,cx,cy,cz,face\n";

/// Writes one row per point. Numbers have the fewest digits that read back as the same f64. A point
/// that is not finite has no answer: its row has `NaN` in every column after the first three, and
/// an empty face.
///
/// # Errors
/// `out` cannot be written.
pub fn write(mut out: impl Write, points: &[DVec3], answers: &[Answer]) -> io::Result<()> {
    for (p, answer) in points.iter().zip(answers) {
        let Answer { signed_distance, gradient: g, closest_point: c, face } = answer;
        // `{:?}` is the shortest text that reads back as the same number; `{}` would print up to
        // 300 digits.
        write!(out, "{:?},{:?},{:?},{signed_distance:?},", p.x, p.y, p.z)?;
        write!(out, "{:?},{:?},{:?},{:?},{:?},{:?},", g.x, g.y, g.z, c.x, c.y, c.z)?;
        match *face {
            Answer::NO_FACE => writeln!(out)?,
            face => writeln!(out, "{face}")?,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(text: &[u8]) -> Result<Vec<[f64; 3]>, String> {
        read(text).map(|p| p.iter().map(DVec3::to_array).collect()).map_err(|e| e.to_string())
    }

    #[test]
    fn csv_as_found_in_the_wild_is_read() {
        let expected = Ok(vec![[1.0, 2.0, 3.0], [-4e-3, 5.0, 6e7]]);
        for text in [
            &b"x,y,z\n1,2,3\n-4e-3,5,6e7\n"[..],
            b"\xef\xbb\xbfx,y,z\r\n1,2,3\r\n-4e-3,5,6e7",
            b"name, Z ,\"X\",y\n\"a, b\",3,1,2\n\n\xff,6e7,-4e-3,+5,,\n",
        ] {
            assert_eq!(points(text), expected, "{:?}", String::from_utf8_lossy(text));
        }
        assert_eq!(points(b"x,y,z\n"), Ok(vec![]));
        assert!(points(b"x,y,z\nnan,inf,-inf").unwrap()[0][0].is_nan());
    }

    #[test]
    fn errors_name_line_and_column() {
        for (text, expected) in [
            (&b""[..], "the file is empty"),
            (b"x;y;z\n1;2;3", "line 1: the column x occurs 0 times; expected once; the header is: x;y;z"),
            (b"x,y,Y,z\n", "line 1: the column y occurs 2 times; expected once; the header is: x,y,Y,z"),
            (b"x,y,z\n1,2,3\n\n1,2\n", "line 4: 2 fields, and none for the column z; expected at least 3"),
            (
                b"x,y,z\n1,2,3\n1,5,2,5,3,5\n",
                "line 3: 6 fields under 3 columns; expected one field per column: numbers need a decimal point, because a comma \
                 ends a field",
            ),
            (b"x,y,z\r\n1,,3\r\n", "line 2, column y: \"\" is not a number"),
            (b"i,x,y,z\n\"a\nb\",1,2,3\n4,5,six,7\n", "line 4, column y: \"six\" is not a number"),
        ] {
            assert_eq!(points(text).unwrap_err(), expected);
        }
    }

    #[test]
    fn numbers_round_trip() {
        let values = [0.1 + 0.2, 1e300, f64::MIN_POSITIVE, -0.0, 5e-324, 1.0 / 3.0];
        let p = DVec3::from_slice(&values[..3]);
        let answer = Answer {
            signed_distance: values[3],
            gradient: DVec3::splat(values[4]),
            closest_point: DVec3::splat(values[5]),
            face: 16_777_215,
        };
        let none = Answer {
            signed_distance: f64::NAN,
            gradient: DVec3::NAN,
            closest_point: DVec3::NAN,
            face: Answer::NO_FACE,
        };
        let mut out = Vec::new();
        write(&mut out, &[p, DVec3::NAN], &[answer, none]).unwrap();
        let text = String::from_utf8(out).unwrap();
        let lines: Vec<_> = text.lines().collect();
        let found: Vec<f64> = lines[0].split(',').map(|s| s.parse().unwrap()).collect();
        let [a, b] = [values[4], values[5]];
        let expected = [p.x, p.y, p.z, values[3], a, a, a, b, b, b, 16_777_215.0];
        assert_eq!(found.iter().map(|v| v.to_bits()).collect::<Vec<_>>(), expected.map(f64::to_bits));
        assert!(lines[0].len() < 150);
        assert_eq!(lines[1], "NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,NaN,");
    }
}
