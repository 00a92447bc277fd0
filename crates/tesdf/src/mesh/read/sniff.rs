//! Recognises content that contradicts the extension.
use super::text::without_bom;
use super::{MeshFormat, ReadError};

const EXPORT: &str = "export the mesh again, or check the path";
const RENAME: &str = "give the file the extension of its content";

/// First bytes of a kind of file, its description, and what to do about it.
const KINDS: &[(&[u8], &str, &str)] = &[
    (b"\x89PNG", "is a PNG picture", EXPORT),
    (b"\xFF\xD8\xFF", "is a JPEG picture", EXPORT),
    (b"GIF8", "is a GIF picture", EXPORT),
    (b"%PDF", "is a PDF document", EXPORT),
    (b"\x7FELF", "is a program", EXPORT),
    (b"PK\x03\x04", "is a ZIP archive", "unpack it, or give it the extension .3mf if it is a 3MF file"),
    (b"\x1F\x8B", "is compressed by gzip", "unpack it with gunzip"),
    (b"\xFF\xFE", "is UTF-16 text", "save it as UTF-8"),
    (b"\xFE\xFF", "is UTF-16 text", "save it as UTF-8"),
    (b"version https://git-lfs", "is a Git LFS pointer", "fetch the file itself with 'git lfs pull'"),
    (b"<!DOCTYPE", "is a web page", "download the file itself"),
    (b"<html", "is a web page", "download the file itself"),
    (b"ISO-10303-21", "is a STEP file", "give it the extension .step"),
    (b"Kaydara FBX", "is an FBX file", "export STL, OBJ, PLY, OFF or glTF"),
];

/// First bytes of the formats that can be read.
const FORMATS: &[(&[u8], MeshFormat, &str)] = &[
    (b"ply\n", MeshFormat::Ply, "is a PLY file"),
    (b"ply\r", MeshFormat::Ply, "is a PLY file"),
    (b"glTF", MeshFormat::Glb, "is a GLB file"),
    (b"solid ", MeshFormat::Stl, "is an ASCII STL file"),
    (b"OFF\n", MeshFormat::Off, "is an OFF file"),
    (b"OFF\r", MeshFormat::Off, "is an OFF file"),
];

/// Refuses content that is known to be of another kind.
pub(super) fn refuse_other_kinds(bytes: &[u8], format: MeshFormat) -> Result<(), ReadError> {
    let text = without_bom(bytes);
    for &(magic, looks, help) in KINDS {
        if bytes.starts_with(magic) || text.starts_with(magic) {
            return Err(ReadError::WrongContent { format, looks: looks.into(), help });
        }
    }
    for &(magic, other, looks) in FORMATS {
        if other != format && text.starts_with(magic) {
            return Err(ReadError::WrongContent { format, looks: looks.into(), help: RENAME });
        }
    }
    Ok(())
}

/// Refuses a text file that contains a zero byte.
pub(super) fn refuse_binary(bytes: &[u8], format: MeshFormat) -> Result<(), ReadError> {
    match bytes.iter().position(|b| *b == 0) {
        None => Ok(()),
        Some(at) => Err(ReadError::WrongContent {
            format,
            looks: format!("has a zero byte at byte {at}, which text never has"),
            help: EXPORT,
        }),
    }
}
