/// Number type of a section, little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Element {
    /// 8-bit unsigned integer.
    U8,
    /// 16-bit unsigned integer.
    U16,
    /// 32-bit unsigned integer.
    U32,
    /// 32-bit float.
    F32,
    /// 64-bit float.
    F64,
}

impl Element {
    /// Size in bytes. It is also the alignment.
    pub const fn size(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The name in the header, as safetensors spells it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::U8 => "U8",
            Self::U16 => "U16",
            Self::U32 => "U32",
            Self::F32 => "F32",
            Self::F64 => "F64",
        }
    }
}

/// Whether a file may lack a section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Presence {
    /// Every file has the section. It may have no rows.
    Required,
    /// A file may lack the section.
    Optional,
}

/// Layout of one section. A table of these is the layout of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SectionSpec {
    /// Name in the header.
    pub name: &'static str,
    /// Number type.
    pub element: Element,
    /// Numbers in a row. With 1 the array has the shape `[n]`, with more it has `[n, columns]`.
    pub columns: usize,
    /// Whether a file may lack the section.
    pub presence: Presence,
}

impl SectionSpec {
    /// A section that every file has.
    pub const fn required(name: &'static str, element: Element, columns: usize) -> Self {
        Self { name, element, columns, presence: Presence::Required }
    }

    /// A section that a file may lack.
    pub const fn optional(name: &'static str, element: Element, columns: usize) -> Self {
        Self { name, element, columns, presence: Presence::Optional }
    }

    /// Bytes of one row.
    pub const fn row_size(&self) -> usize {
        self.element.size() * self.columns
    }
}

/// A section to write: its layout and its bytes.
#[derive(Clone, Copy, Debug)]
pub struct Section<'a> {
    /// Layout.
    pub spec: SectionSpec,
    /// Whole rows, little-endian.
    pub bytes: &'a [u8],
}

impl<'a> Section<'a> {
    /// Makes a section of the rows of `values`. Writing the section checks its length.
    pub fn new<T: bytemuck::Pod>(spec: SectionSpec, values: &'a [T]) -> Self {
        Self { spec, bytes: bytemuck::cast_slice(values) }
    }
}
