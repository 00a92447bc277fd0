use std::fmt;

/// A place in a mesh file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of a text file, 1-based.
    Line(u64),
    /// An offset into a binary file, 0-based.
    Byte(u64),
    /// An element of a glTF or 3MF file, such as `meshes[0].primitives[1]`.
    Element(String),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
            Self::Element(element) => f.write_str(element),
        }
    }
}
