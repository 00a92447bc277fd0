//! Reads the header of a PLY file.
use super::super::text::{Lines, malformed, shown, words};
use super::{PLY, ReadError, Rows};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Encoding {
    Ascii,
    Little,
    Big,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    Scalar(Scalar),
    List { size: Scalar, item: Scalar },
}

pub(super) struct Property {
    pub name: Vec<u8>,
    pub kind: Kind,
}

pub(super) struct Element {
    pub name: Vec<u8>,
    pub count: u64,
    pub properties: Vec<Property>,
    /// Line of the declaration in the header.
    pub line: u64,
}

pub(super) struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
}

/// Reads the header. The returned rows begin after it.
pub(super) fn header(bytes: &[u8]) -> Result<(Header, Rows<'_>), ReadError> {
    let mut lines = Lines::new(bytes);
    match lines.next() {
        Some((_, first)) if first.trim_ascii_end() == b"ply" => {}
        Some((_, first)) => {
            return Err(malformed(PLY, 1, shown(first), "expected 'ply': is the file of another kind?"));
        }
        None => return Err(malformed(PLY, 1, "nothing", "expected 'ply'")),
    }
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        let line_number = lines.number() + 1;
        let Some((n, line)) = lines.next() else {
            let help = "expected 'end_header': is the file cut short?";
            return Err(malformed(PLY, line_number, "the file ends in its header", help));
        };
        let parts: Vec<_> = words(line).collect();
        match parts[..] {
            [] | [b"comment" | b"obj_info", ..] => {}
            [b"format", kind, version] => {
                if version != b"1.0" {
                    return Err(malformed(PLY, n, format!("version {}", shown(version)), "expected 1.0"));
                }
                encoding = Some(match kind {
                    b"ascii" => Encoding::Ascii,
                    b"binary_little_endian" => Encoding::Little,
                    b"binary_big_endian" => Encoding::Big,
                    _ => {
                        let help = "expected ascii, binary_little_endian or binary_big_endian";
                        return Err(malformed(PLY, n, format!("format {}", shown(kind)), help));
                    }
                });
            }
            [b"element", name, count] => {
                let count =
                    std::str::from_utf8(count).ok().and_then(|c| c.parse().ok()).ok_or_else(|| {
                        malformed(PLY, n, format!("the count {}", shown(count)), "expected a whole number")
                    })?;
                if elements.iter().any(|e| e.name == name) {
                    let found = format!("a second element {}", shown(name));
                    return Err(malformed(PLY, n, found, "expected each element once"));
                }
                elements.push(Element { name: name.to_owned(), count, properties: Vec::new(), line: n });
            }
            [b"property", .., name] => {
                let kind = match parts[1..parts.len() - 1] {
                    [b"list", size, item] => Kind::List { size: scalar(size, n)?, item: scalar(item, n)? },
                    [ty] => Kind::Scalar(scalar(ty, n)?),
                    _ => {
                        let help = "expected 'property TYPE NAME' or 'property list TYPE TYPE NAME'";
                        return Err(malformed(PLY, n, shown(line), help));
                    }
                };
                let Some(element) = elements.last_mut() else {
                    return Err(malformed(
                        PLY,
                        n,
                        "a property before any element",
                        "expected 'element' first",
                    ));
                };
                element.properties.push(Property { name: name.to_owned(), kind });
            }
            [b"end_header"] => break,
            _ => {
                let help = "expected format, element, property, comment or end_header";
                return Err(malformed(PLY, n, shown(line), help));
            }
        }
    }
    let Some(encoding) = encoding else {
        return Err(malformed(PLY, lines.number(), "the header has no 'format' line", "expected one"));
    };
    // `Lines` treats a line feed after a carriage return as part of the line end. When the header's
    // lines end with a lone carriage return, that line feed is the first byte of the data.
    let mut data = lines.rest();
    let first_end = bytes.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(0);
    let lone_returns = bytes.get(first_end) == Some(&b'\r') && bytes.get(first_end + 1) != Some(&b'\n');
    let start = bytes.len() - data.len();
    if lone_returns && start >= 2 && bytes[start - 2..start] == *b"\r\n" {
        data = &bytes[start - 1..];
    }
    let rows = Rows::new(bytes, bytes.len() - data.len(), encoding, lines.number());
    Ok((Header { encoding, elements }, rows))
}

fn scalar(name: &[u8], line: u64) -> Result<Scalar, ReadError> {
    Ok(match name {
        b"char" | b"int8" => Scalar::I8,
        b"uchar" | b"uint8" => Scalar::U8,
        b"short" | b"int16" => Scalar::I16,
        b"ushort" | b"uint16" => Scalar::U16,
        b"int" | b"int32" => Scalar::I32,
        b"uint" | b"uint32" => Scalar::U32,
        b"float" | b"float32" => Scalar::F32,
        b"double" | b"float64" => Scalar::F64,
        _ => {
            let help = "expected char, uchar, short, ushort, int, uint, float or double";
            return Err(malformed(PLY, line, format!("the type {}", shown(name)), help));
        }
    })
}
