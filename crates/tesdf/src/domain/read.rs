//! Reads files of tetrahedra to a [`TetMesh`]: Gmsh and TetGen.
//!
//! Only tetrahedra of four vertices are read. Points, lines and surface elements are skipped and
//! counted. Other volumes are an error. Memory is allocated for bytes that are there, and never by
//! a count in a header.
use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::Serialize;

mod error;
mod tetgen;

use super::TetMesh;
use crate::mesh::msh::{self, Msh, Wanted};
pub use error::ReadTetrahedraError;
use error::malformed;

/// A format of tetrahedra that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum TetFormat {
    /// Gmsh's MSH 2.2 and 4.1, ASCII and binary.
    Msh,
    /// TetGen's vertices. The tetrahedra are in the `.ele` file beside it.
    Node,
    /// TetGen's tetrahedra. The vertices are in the `.node` file beside it.
    Ele,
}

impl TetFormat {
    /// All formats, in the order in which messages list them.
    pub const ALL: [Self; 3] = [Self::Msh, Self::Node, Self::Ele];

    /// The format of a file by its extension, in upper or lower case.
    ///
    /// # Errors
    /// [`ReadTetrahedraError::UnknownExtension`] lists the known extensions.
    pub fn of_path(path: impl AsRef<Path>) -> Result<Self, ReadTetrahedraError> {
        let path = path.as_ref();
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        Self::ALL
            .into_iter()
            .find(|f| f.extension().eq_ignore_ascii_case(&extension))
            .ok_or_else(|| ReadTetrahedraError::UnknownExtension { path: path.to_owned() })
    }

    /// The file extension, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Msh => "msh",
            Self::Node => "node",
            Self::Ele => "ele",
        }
    }
}

impl std::fmt::Display for TetFormat {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Msh => "Gmsh MSH",
            Self::Node => "TetGen .node",
            Self::Ele => "TetGen .ele",
        })
    }
}

/// Elements that were skipped because they have no volume.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Skipped {
    /// Points.
    pub points: usize,
    /// Lines of any order.
    pub lines: usize,
    /// Triangles, quadrangles and polygons of any order.
    pub surfaces: usize,
}

/// The tetrahedra of a file, and the elements that were skipped.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedTetrahedra {
    /// Vertices and tetrahedra in the order of the file. Vertices are numbered from 0, whatever
    /// numbers the file gives them.
    pub mesh: TetMesh,
    /// The format of the file.
    pub format: TetFormat,
    /// The elements that were skipped.
    pub skipped: Skipped,
}

/// The result of a parser. Corners are valid ids of `vertices`.
#[derive(Default)]
struct Parsed {
    vertices: Vec<DVec3>,
    tetrahedra: Vec<[u32; 4]>,
    skipped: Skipped,
}

fn parse_msh(bytes: &[u8]) -> Result<Parsed, ReadTetrahedraError> {
    let Msh { nodes, tetrahedra, skipped: [points, lines, surfaces], .. } =
        msh::read(bytes, Wanted::Tetrahedra)?;
    Ok(Parsed { vertices: nodes, tetrahedra, skipped: Skipped { points, lines, surfaces } })
}

/// Reads a file of tetrahedra. Its extension names the format. Of TetGen's pair, either path is
/// accepted.
///
/// # Errors
/// [`ReadTetrahedraError`] names what is wrong, the line, byte or element, and what to do.
pub fn read_tetrahedra(path: impl AsRef<Path>) -> Result<TetMesh, ReadTetrahedraError> {
    Ok(load_tetrahedra(path)?.mesh)
}

/// The same as [`read_tetrahedra`], with a report of the skipped elements.
///
/// # Errors
/// The same as for [`read_tetrahedra`].
pub fn load_tetrahedra(path: impl AsRef<Path>) -> Result<LoadedTetrahedra, ReadTetrahedraError> {
    load(path.as_ref())
}

fn load(path: &Path) -> Result<LoadedTetrahedra, ReadTetrahedraError> {
    let format = TetFormat::of_path(path)?;
    let bytes = |path: &Path| {
        crate::input::read(path).map_err(|source| ReadTetrahedraError::Open { path: path.to_owned(), source })
    };
    let parsed = match format {
        TetFormat::Msh => parse_msh(&bytes(path)?),
        TetFormat::Node => tetgen::parse(&bytes(path)?, &bytes(&beside(path, TetFormat::Ele))?),
        TetFormat::Ele => tetgen::parse(&bytes(&beside(path, TetFormat::Node))?, &bytes(path)?),
    }?;
    let mesh = TetMesh::new(parsed.vertices, parsed.tetrahedra)
        .map_err(|source| ReadTetrahedraError::Mesh { format, source })?;
    Ok(LoadedTetrahedra { mesh, format, skipped: parsed.skipped })
}

/// The files that [`read_tetrahedra`] opens for `path`: the file itself, and the other file of
/// TetGen's pair.
pub fn tetrahedra_files(path: impl AsRef<Path>) -> Vec<PathBuf> {
    let path = path.as_ref();
    let other = match TetFormat::of_path(path) {
        Ok(TetFormat::Node) => Some(beside(path, TetFormat::Ele)),
        Ok(TetFormat::Ele) => Some(beside(path, TetFormat::Node)),
        _ => None,
    };
    std::iter::once(path.to_path_buf()).chain(other).collect()
}

/// The other file of a pair. Its extension is in upper case where that of `path` is.
fn beside(path: &Path, format: TetFormat) -> PathBuf {
    let upper = path.extension().is_some_and(|e| e.to_string_lossy().chars().all(char::is_uppercase));
    let extension = format.extension();
    path.with_extension(if upper { extension.to_uppercase() } else { extension.to_owned() })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    macro_rules! golden {
        ($parse:expr, $($name:literal),*) => {
            vec![$(($name, &include_bytes!(concat!("../../tests/data/tetrahedra/", $name))[..], $parse)),*]
        };
    }

    type Parse = fn(&[u8]) -> Result<Parsed, ReadTetrahedraError>;

    const NODE: &[u8] = b"# a comment\n5 3 1 1\n1 0 0 0 9 1\n2 1 0 0 9 1\n3 0 1 0 9 1 # another\n\n4 0 0 1 9 1\n5 1 1 1 9 0\n";
    const ELE: &[u8] = b"2 4 1\n1 1 2 3 4 7\n2 2 3 4 5 7\n";

    fn samples() -> Vec<(&'static str, &'static [u8], Parse)> {
        let mut all = golden!(
            parse_msh as Parse,
            "v22.msh",
            "v22_binary.msh",
            "v41.msh",
            "v41_binary.msh",
            "v41_parametric.msh",
            "v41_binary_parametric.msh"
        );
        all.push(("node", NODE, |bytes| tetgen::parse(bytes, ELE)));
        all.push(("ele", ELE, |bytes| tetgen::parse(NODE, bytes)));
        all
    }

    /// Checks that the result of a parser is valid, whatever the parser has read.
    fn assert_sound(name: &str, bytes: &[u8], result: &Result<Parsed, ReadTetrahedraError>) {
        match result {
            Ok(parsed) => {
                assert!(parsed.vertices.len() + parsed.tetrahedra.len() <= bytes.len(), "{name}");
                let corners = parsed.tetrahedra.iter().flatten();
                assert!(corners.into_iter().all(|&v| (v as usize) < parsed.vertices.len()), "{name}");
                assert!(parsed.vertices.iter().all(|p| p.is_finite()), "{name}");
            }
            Err(error) => assert!(error.to_string().len() > 20, "{name}: {error}"),
        }
    }

    /// Checks that a file which is cut short is refused, unless only bytes without numbers are
    /// missing.
    #[test]
    fn prefixes_are_refused() {
        for (name, bytes, parse) in samples() {
            let whole = parse(bytes).unwrap();
            let is_text = matches!(name, "node" | "ele");
            // Where a text ends in a number, every beginning of this number is a number too.
            for end in (0..bytes.len()).filter(|&end| !is_text || bytes[end] == b'\n') {
                let result = parse(&bytes[..end]);
                assert_sound(name, bytes, &result);
                if let Ok(part) = result {
                    assert_eq!(part.tetrahedra, whole.tetrahedra, "{name}: the first {end} bytes");
                    assert_eq!(part.vertices, whole.vertices, "{name}: the first {end} bytes");
                    assert!(end + 40 > bytes.len(), "{name}: the first {end} bytes");
                }
            }
        }
    }

    /// Checks that any count may have any value: no memory is allocated by it.
    #[test]
    fn counts_in_files_allocate_no_memory() {
        for (name, bytes, parse) in samples() {
            for huge in ["4294967295", "18446744073709551615", "-1"] {
                // Changes every whole number of a text, one at a time.
                let is_digit = |i: usize| bytes.get(i).is_some_and(u8::is_ascii_digit);
                let starts =
                    (0..bytes.len().min(700)).filter(|&i| is_digit(i) && (i == 0 || !is_digit(i - 1)));
                for start in starts {
                    let length = bytes[start..].iter().take_while(|b| b.is_ascii_digit()).count();
                    let changed = [&bytes[..start], huge.as_bytes(), &bytes[start + length..]].concat();
                    assert_sound(name, &changed, &parse(&changed));
                }
            }
            // Changes every byte of a binary number.
            for at in 0..bytes.len().saturating_sub(8).min(800) {
                let mut changed = bytes.to_vec();
                changed[at..at + 8].fill(0x7f);
                assert_sound(name, &changed, &parse(&changed));
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]
        #[test]
        fn flipped_bytes_never_panic(
            sample in 0..8usize,
            changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..4u8), 1..6),
        ) {
            let (name, bytes, parse) = samples()[sample];
            let mut changed = bytes.to_vec();
            for (at, byte, kind) in changes {
                let at = at.index(changed.len());
                match kind {
                    0 => changed[at] = byte,
                    1 => changed[at] ^= 1 << (byte % 8),
                    2 => changed.insert(at, byte),
                    _ => drop(changed.remove(at)),
                }
            }
            assert_sound(name, &changed, &parse(&changed));
        }
    }
}
