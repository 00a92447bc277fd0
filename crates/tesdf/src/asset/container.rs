use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::marker::PhantomData;
use std::ops::{Deref, Range};
use std::path::Path;
use std::sync::Arc;

use memmap2::Mmap;

use super::header::{self, SECTION_CHECKSUM, Shape};
use super::{AssetError, FORMAT_VERSION_OF_RULES, Presence, Section, SectionSpec};
use crate::input;

#[cfg(target_endian = "big")]
compile_error!("sections are read in place and are little-endian; this target is big-endian");

/// Number of bytes by which data from a pipe is recognised as a `.tesdf` file.
const PREFIX: u64 = 512;

/// The shape of a section in the header.
pub(super) fn shape_of(spec: &SectionSpec, rows: u64) -> Shape {
    Shape { rows, columns: (spec.columns != 1).then_some(spec.columns as u64) }
}

/// An open `.tesdf` file: its bytes, and the place of each section in them.
///
/// Opening checks the structure: magic and version; that the file has every section of the table
/// with its element type and columns; that sections are aligned and follow each other without gaps;
/// and that the file ends where the last section ends. Opening reads only the header, so it takes
/// the same time for files of all sizes. [`verify_checksums`](Self::verify_checksums) reads the
/// whole file. The meaning of the numbers in the sections is not checked here.
///
/// Cloning is cheap: clones share the bytes.
#[derive(Clone, Debug)]
pub struct Container {
    storage: Arc<Storage>,
    metadata: BTreeMap<String, String>,
    pub(super) sections: Vec<Placed>,
    header_end: usize,
    /// Position of the digits of the header's checksum.
    pub(super) digits: usize,
    version: u32,
}

#[derive(Debug)]
enum Storage {
    Mapped(Mmap),
    /// Words of `u64` for the alignment. The last word may be partly unused.
    Owned {
        words: Vec<u64>,
        length: usize,
    },
}

impl Storage {
    fn bytes(&self) -> &[u8] {
        match self {
            Self::Mapped(map) => map,
            Self::Owned { words, length } => &bytemuck::cast_slice(words)[..*length],
        }
    }
}

/// A section's place in the file and its checksum, in hex.
#[derive(Clone, Debug)]
pub(super) struct Placed {
    pub spec: SectionSpec,
    pub range: Range<usize>,
    pub checksum: String,
}

impl Container {
    /// Maps the file at `path`, read-only, and checks its structure against `table`.
    ///
    /// The file must not be changed in place while it is open. A reader would see the change, and
    /// after a truncation the operating system ends the process (SIGBUS). To replace the file by a
    /// rename, as [`save_atomic`](super::save_atomic) does, is safe. For a file that others may
    /// write to, read it and call [`from_bytes`](Self::from_bytes).
    ///
    /// Data from a pipe or a device is held in memory; see [`input::read`](crate::input::read).
    ///
    /// # Errors
    /// [`AssetError`] names what was found, in which section, and what was expected.
    pub fn open(path: impl AsRef<Path>, table: &[SectionSpec]) -> Result<Self, AssetError> {
        Self::open_path(path.as_ref(), table)
    }

    fn open_path(path: &Path, table: &[SectionSpec]) -> Result<Self, AssetError> {
        let io = |action| move |source| AssetError::Io { action, path: path.to_path_buf(), source };
        let mut file = File::open(path).map_err(io("open"))?;
        let kind = file.metadata().map_err(io("open"))?;
        if !kind.is_file() || kind.len() == 0 {
            // A pipe cannot be mapped, an empty file can be mapped only on some systems, and a
            // folder cannot be read.
            let mut bytes = Vec::new();
            file.by_ref().take(PREFIX).read_to_end(&mut bytes).map_err(io("read"))?;
            if let Err(e @ (AssetError::NotTesdf { .. } | AssetError::Version { .. })) =
                header::read_prefix(&bytes)
            {
                // A pipe may never end.
                return Err(e);
            }
            input::read_rest(&mut file, &mut bytes).map_err(io("read"))?;
            return Self::from_bytes(&bytes, table);
        }
        // SAFETY: nothing in this process writes to the mapping. The documentation above says what
        // other processes may do.
        let map = unsafe { Mmap::map(&file) }.map_err(io("map"))?;
        Self::new(Storage::Mapped(map), table)
    }

    /// Copies `bytes` into aligned memory and checks the structure against `table`.
    ///
    /// # Errors
    /// The same as for [`open`](Self::open).
    pub fn from_bytes(bytes: &[u8], table: &[SectionSpec]) -> Result<Self, AssetError> {
        let mut words = Vec::new();
        let count = bytes.len().div_ceil(size_of::<u64>());
        words.try_reserve_exact(count).map_err(|_| AssetError::Memory { bytes: bytes.len() })?;
        words.resize(count, 0_u64);
        bytemuck::cast_slice_mut(&mut words)[..bytes.len()].copy_from_slice(bytes);
        Self::new(Storage::Owned { words, length: bytes.len() }, table)
    }

    fn new(storage: Storage, table: &[SectionSpec]) -> Result<Self, AssetError> {
        let bytes = storage.bytes();
        let header::Prefix { version, digits, end: header_end } = header::read_prefix(bytes)?;
        let header::Header { mut metadata, entries } =
            header::parse(&bytes[header::LENGTH_FIELD..header_end])?;
        let mut sections: Vec<Placed> = Vec::with_capacity(table.len());
        let mut end = 0_u64;
        for (name, entry) in entries {
            let wrong = |reason: String| AssetError::section(&name, reason);
            let spec = table
                .iter()
                .find(|spec| spec.name == name)
                .ok_or_else(|| wrong("no section of this format version has this name".into()))?;
            if sections.iter().any(|s| s.spec.name == name) {
                return Err(wrong("it has two entries".into()));
            }
            if entry.dtype != spec.element.name() {
                let found = super::error::shown(&entry.dtype);
                return Err(wrong(format!("element type {found}; expected {}", spec.element.name())));
            }
            let expected = shape_of(spec, entry.shape.rows);
            if entry.shape != expected {
                return Err(wrong(format!("shape {}; expected {expected}", entry.shape)));
            }
            let [from, to] = entry.data_offsets;
            let size = entry.shape.rows.checked_mul(spec.row_size() as u64);
            if from != end || to.checked_sub(from) != size {
                return Err(wrong(format!(
                    "data_offsets [{from},{to}]; the section before ends at {end} and the shape {} needs {}",
                    entry.shape,
                    size.map_or("more than 2^64 bytes".to_string(), |s| format!("{s} bytes"))
                )));
            }
            if !from.is_multiple_of(spec.element.size() as u64) {
                return Err(wrong(format!(
                    "data_offsets [{from},{to}] are not aligned to {} bytes",
                    spec.element.size()
                )));
            }
            let checksum = metadata
                .remove(&format!("{SECTION_CHECKSUM}{name}"))
                .ok_or_else(|| wrong(format!("the metadata has no {SECTION_CHECKSUM}{name}")))?;
            let available = (bytes.len() - header_end) as u64;
            if to > available {
                return Err(wrong(format!(
                    "it ends at byte {to} of the data, but the file has {available}; it was cut short, \
                     copy or encode it again"
                )));
            }
            // Both ends are within the file, so they fit a usize.
            let range = header_end + from as usize..header_end + to as usize;
            sections.push(Placed { spec: *spec, range, checksum });
            end = to;
        }
        for spec in table {
            if spec.presence == Presence::Required && !sections.iter().any(|s| s.spec.name == spec.name) {
                return Err(AssetError::section(spec.name, "it is missing"));
            }
        }
        let expected = header_end as u64 + end;
        if bytes.len() as u64 != expected {
            return Err(AssetError::TrailingBytes { expected, extra: bytes.len() as u64 - expected });
        }
        for key in ["format", "version", "checksum"] {
            metadata.remove(key);
        }
        if let Some(key) = metadata.keys().find(|key| key.starts_with(SECTION_CHECKSUM)) {
            return Err(AssetError::header(format!(
                "{} belongs to no section of the file",
                super::error::shown(key)
            )));
        }
        if (version == FORMAT_VERSION_OF_RULES) != metadata.contains_key(header::RULE) {
            let only = format!(
                "version {version}: files of version {FORMAT_VERSION_OF_RULES}, and no others, have the metadata key {}",
                header::RULE
            );
            return Err(AssetError::header(only));
        }
        Ok(Self { storage: Arc::new(storage), metadata, sections, header_end, digits, version })
    }

    /// The version of the file format.
    pub fn version(&self) -> u32 {
        self.version
    }

    /// The metadata of the caller, as given to [`write_container`](super::write_container).
    pub fn metadata(&self) -> &BTreeMap<String, String> {
        &self.metadata
    }

    /// The whole file.
    pub fn as_bytes(&self) -> &[u8] {
        self.storage.bytes()
    }

    /// Number of bytes before the first section: the length field and the header.
    pub fn header_size(&self) -> usize {
        self.header_end
    }

    /// The sections of this file, in the order of the file, with their bytes.
    pub fn sections(&self) -> impl Iterator<Item = Section<'_>> {
        self.sections.iter().map(|s| Section { spec: s.spec, bytes: &self.as_bytes()[s.range.clone()] })
    }

    /// The section `name` in place, with one `T` for each number or for each row. `None` when the
    /// file does not have it.
    ///
    /// # Errors
    /// [`AssetError::Section`] when the size of `T` is neither that of a number nor that of a row,
    /// or when the alignment of `T` is larger than that of the section.
    pub fn section<T: bytemuck::Pod>(&self, name: &str) -> Result<Option<&[T]>, AssetError> {
        let Some(Placed { spec, range, .. }) = self.sections.iter().find(|s| s.spec.name == name) else {
            return Ok(None);
        };
        if size_of::<T>() != spec.element.size() && size_of::<T>() != spec.row_size() {
            return Err(AssetError::section(
                name,
                format!(
                    "read as a type of {} bytes; a number has {} and a row {}",
                    size_of::<T>(),
                    spec.element.size(),
                    spec.row_size()
                ),
            ));
        }
        bytemuck::try_cast_slice(&self.as_bytes()[range.clone()])
            .map(Some)
            .map_err(|e| AssetError::section(name, format!("cannot be read in place: {e}")))
    }

    /// The same as [`section`](Self::section), but the result shares the ownership of the bytes. It
    /// is for types that keep a section.
    ///
    /// # Errors
    /// The same as for [`section`](Self::section). A section that the file does not have is an
    /// error here.
    pub fn shared_section<T: bytemuck::Pod>(&self, name: &str) -> Result<SharedSection<T>, AssetError> {
        let slice: &[T] = self.section(name)?.ok_or_else(|| AssetError::section(name, "it is missing"))?;
        let (start, length) = (slice.as_ptr(), slice.len());
        Ok(SharedSection { storage: Arc::clone(&self.storage), start, length, element: PhantomData })
    }
}

/// A section of a [`Container`] that keeps the bytes of the container alive. It dereferences to a
/// slice at no cost.
#[derive(Clone)]
pub struct SharedSection<T> {
    storage: Arc<Storage>,
    start: *const T,
    length: usize,
    element: PhantomData<T>,
}

impl<T: bytemuck::Pod> SharedSection<T> {
    /// A copy of rows that come from no file.
    pub(crate) fn of_rows(rows: &[T]) -> Self {
        let bytes: &[u8] = bytemuck::cast_slice(rows);
        let mut words = vec![0u64; bytes.len().div_ceil(8)];
        bytemuck::cast_slice_mut(&mut words)[..bytes.len()].copy_from_slice(bytes);
        let start = words.as_ptr().cast();
        let storage = Arc::new(Storage::Owned { words, length: bytes.len() });
        Self { storage, start, length: rows.len(), element: PhantomData }
    }
}

// SAFETY: the bytes are immutable and owned by `storage`, which is `Send + Sync`. `start` is only
// read.
unsafe impl<T: bytemuck::Pod + Send + Sync> Send for SharedSection<T> {}
// SAFETY: as above.
unsafe impl<T: bytemuck::Pod + Send + Sync> Sync for SharedSection<T> {}

impl<T: bytemuck::Pod> Deref for SharedSection<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        // SAFETY: `start` and `length` are those of a slice that bytemuck has checked. Its memory
        // (a mapping, or the heap block of a vector that nobody can reach mutably) does not move,
        // and lives as long as `storage`.
        unsafe { std::slice::from_raw_parts(self.start, self.length) }
    }
}

impl<T: bytemuck::Pod + std::fmt::Debug> std::fmt::Debug for SharedSection<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "SharedSection of {} of {} bytes", self.length, self.storage.bytes().len())
    }
}
