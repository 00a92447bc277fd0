//! Reads the bytes behind the accessors of a glTF file.
use std::borrow::Cow;
use std::path::{Component, Path, PathBuf};

use base64::Engine;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use glam::DVec3;
use gltf_json as json;
use json::accessor::{ComponentType, GenericComponentType, Type};
use json::validation::Checked;

use super::{MeshFormat, ReadError, fault};
use crate::input;
use crate::mesh::text::shown;

/// Loads the bytes of all buffers. Bytes of external files also go into `hasher`.
pub(super) fn load<'a>(
    root: &json::Root,
    binary: Option<&'a [u8]>,
    format: MeshFormat,
    folder: Option<&Path>,
    hasher: &mut blake3::Hasher,
) -> Result<Vec<Cow<'a, [u8]>>, ReadError> {
    let mut buffers = Vec::new();
    for (i, buffer) in root.buffers.iter().enumerate() {
        let error = |found: String, help: &str| fault(format, format!("buffers[{i}]"), found, help);
        let bytes = match &buffer.uri {
            None => {
                let chunk = binary.filter(|_| i == 0);
                Cow::Borrowed(chunk.ok_or_else(|| {
                    error(
                        "there is no uri and no binary chunk".into(),
                        "only buffer 0 of a GLB file may have no uri",
                    )
                })?)
            }
            Some(uri) if is_inside(uri) => {
                let Some((_, text)) = uri.split_once(";base64,") else {
                    return Err(error("a data: URI that is not base64".into(), "expected ';base64,'"));
                };
                let config =
                    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent);
                let decoder = GeneralPurpose::new(&base64::alphabet::STANDARD, config);
                let bytes = decoder.decode(text).map_err(|e| error(e.to_string(), "expected base64 data"))?;
                Cow::Owned(bytes)
            }
            Some(uri) => {
                let Some(folder) = folder else {
                    let found = format!("the external file {}", shown(uri.as_bytes()));
                    return Err(error(
                        found,
                        "bytes in memory need their buffers inside: use GLB, or read from a path",
                    ));
                };
                let path = local_path(uri).ok_or_else(|| {
                    error(
                        format!("the uri {}", shown(uri.as_bytes())),
                        "expected a file next to the glTF file, or below its folder",
                    )
                })?;
                let file = folder.join(&path);
                let bytes = input::check_regular(&file).and_then(|()| input::read(&file)).map_err(|e| {
                    let name = shown(path.as_os_str().as_encoded_bytes());
                    error(format!("the file {name}: {e}"), "put the file there, or export GLB")
                })?;
                hasher.update(&bytes);
                Cow::Owned(bytes)
            }
        };
        if (bytes.len() as u64) < buffer.byte_length.0 {
            let found =
                format!("byteLength is {}, but there are {} bytes", buffer.byte_length.0, bytes.len());
            return Err(error(found, "is the file cut short?"));
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// The files in `folder` or below it that [`load`] opens.
pub(super) fn external_files(root: &json::Root, folder: &Path) -> impl Iterator<Item = PathBuf> {
    let uris = root.buffers.iter().filter_map(|buffer| buffer.uri.as_deref());
    uris.filter(|uri| !is_inside(uri)).filter_map(local_path).map(|path| folder.join(path))
}

/// Whether a URI contains the bytes itself.
fn is_inside(uri: &str) -> bool {
    uri.starts_with("data:")
}

/// The relative path that a URI names; `None` when it leaves the folder.
fn local_path(uri: &str) -> Option<PathBuf> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.bytes();
    while let Some(byte) = rest.next() {
        bytes.push(match byte {
            b'%' => {
                let hex = [rest.next()?, rest.next()?];
                u8::from_str_radix(std::str::from_utf8(&hex).ok()?, 16).ok()?
            }
            _ => byte,
        });
    }
    let path = PathBuf::from(String::from_utf8(bytes).ok()?);
    let is_local = !uri.contains("://") && path.components().all(|c| matches!(c, Component::Normal(_)));
    is_local.then_some(path)
}

/// Access to accessors over loaded buffers.
#[derive(Clone, Copy)]
pub(super) struct Data<'a> {
    pub root: &'a json::Root,
    pub buffers: &'a [Cow<'a, [u8]>],
    pub format: MeshFormat,
}

/// A sequence of equally spaced items in a buffer.
struct Items<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
    count: usize,
}

impl<'a> Items<'a> {
    fn iter(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let (bytes, stride, size) = (self.bytes, self.stride, self.size);
        (0..self.count).map(move |i| &bytes[i * stride..][..size])
    }
}

impl<'a> Data<'a> {
    /// The vertices of a POSITION accessor.
    pub fn positions(&self, accessor: usize) -> Result<Vec<DVec3>, ReadError> {
        let element = format!("accessors[{accessor}]");
        let json = &self.root.accessors[accessor];
        let component = component(json);
        if !matches!(json.type_, Checked::Valid(Type::Vec3)) || component != Some(ComponentType::F32) {
            let found = "a POSITION accessor that is not VEC3 of float";
            return Err(fault(
                self.format,
                element,
                found,
                "quantized positions are not read: export them as float",
            ));
        }
        let base = self.dense(json, 12, &element)?;
        let mut positions: Vec<_> = base.iter().map(position).collect();
        if let Some(sparse) = &json.sparse {
            let count = sparse.count.0;
            let Checked::Valid(index_type) = sparse.indices.component_type else {
                return Err(fault(
                    self.format,
                    element,
                    "an unknown type of sparse indices",
                    "expected an unsigned type",
                ));
            };
            let indices = self.items(
                sparse.indices.buffer_view.value(),
                sparse.indices.byte_offset.0,
                count,
                index_type.0.size(),
                &format!("{element}.sparse.indices"),
            )?;
            let values = self.items(
                sparse.values.buffer_view.value(),
                sparse.values.byte_offset.0,
                count,
                12,
                &format!("{element}.sparse.values"),
            )?;
            for (index, value) in indices.iter().map(unsigned).zip(values.iter()) {
                let vertices = positions.len();
                let Some(slot) = usize::try_from(index).ok().and_then(|i| positions.get_mut(i)) else {
                    let found = format!("sparse index {index} of {vertices} vertices");
                    return Err(fault(self.format, element, found, "expected a smaller index"));
                };
                *slot = position(value);
            }
        }
        Ok(positions)
    }

    /// The values of an index accessor.
    pub fn indices(&self, accessor: usize) -> Result<Vec<u64>, ReadError> {
        let element = format!("accessors[{accessor}]");
        let json = &self.root.accessors[accessor];
        let component = component(json).filter(|c| {
            matches!(json.type_, Checked::Valid(Type::Scalar))
                && matches!(c, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
        });
        let Some(component) = component else {
            let found = "an index accessor that is not SCALAR of an unsigned type";
            return Err(fault(self.format, element, found, "export the file again"));
        };
        if json.sparse.is_some() {
            return Err(fault(self.format, element, "sparse indices", "export plain indices"));
        }
        Ok(self.dense(json, component.size(), &element)?.iter().map(unsigned).collect())
    }

    fn dense(&self, json: &json::Accessor, size: usize, element: &str) -> Result<Items<'a>, ReadError> {
        // Without a view all values are zero, and only the count in the JSON would say how many.
        let Some(view) = json.buffer_view else {
            return Err(fault(self.format, element, "no bufferView", "values without bytes are not read"));
        };
        self.items(view.value(), json.byte_offset.map_or(0, |o| o.0), json.count.0, size, element)
    }

    fn items(
        &self,
        view: usize,
        offset: u64,
        count: u64,
        size: usize,
        element: &str,
    ) -> Result<Items<'a>, ReadError> {
        let json = &self.root.buffer_views[view];
        let buffer = &self.buffers[json.buffer.value()];
        let (start, length) = (json.byte_offset.map_or(0, |o| o.0), json.byte_length.0);
        let in_view = usize::try_from(start)
            .ok()
            .zip(usize::try_from(length).ok())
            .and_then(|(start, length)| buffer.get(start..)?.get(..length));
        let Some(bytes) = in_view else {
            let found = format!("bytes {start} + {length} of a buffer of {} bytes", buffer.len());
            return Err(fault(self.format, format!("bufferViews[{view}]"), found, "is the file cut short?"));
        };
        let stride = json.byte_stride.map_or(size, |s| s.0).max(1);
        let end = count
            .checked_sub(1)
            .map_or(Some(0), |last| last.checked_mul(stride as u64)?.checked_add(size as u64))
            .and_then(|end| end.checked_add(offset));
        match end {
            Some(end) if end <= length => {
                Ok(Items { bytes: &bytes[offset as usize..], stride, size, count: count as usize })
            }
            _ => {
                let found = format!(
                    "{count} values of {size} bytes from byte {offset} on do not fit bufferViews[{view}] of {length} bytes"
                );
                Err(fault(self.format, element, found, "is the file cut short?"))
            }
        }
    }
}

fn component(json: &json::Accessor) -> Option<ComponentType> {
    match json.component_type {
        Checked::Valid(GenericComponentType(component)) => Some(component),
        Checked::Invalid => None,
    }
}

fn position(bytes: &[u8]) -> DVec3 {
    let value =
        |i: usize| f64::from(f32::from_le_bytes([bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]]));
    DVec3::new(value(0), value(4), value(8))
}

fn unsigned(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |value, b| value << 8 | u64::from(*b))
}
