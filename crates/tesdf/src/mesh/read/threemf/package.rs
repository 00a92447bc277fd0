//! The ZIP archive of a 3MF file.
use std::io::{self, BufReader, Cursor, Read};

use quick_xml::events::Event;
use quick_xml::{Reader, XmlVersion};
use zip::ZipArchive;

use super::{EXPORT_AGAIN, ReadError, fault};

/// All parts together may unpack to this many times the bytes of the archive, and [`ALWAYS`] bytes
/// more. Models that we know unpack to some 5 to 30 times, and DEFLATE allows 1032 times.
const MAX_RATIO: u64 = 100;
const ALWAYS: u64 = 1 << 16;

/// The type of the relationship that names the model.
const MODEL: &str = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";

pub(super) struct Package<'a> {
    archive: ZipArchive<Cursor<&'a [u8]>>,
    /// Bytes that may still be unpacked.
    left: u64,
}

impl<'a> Package<'a> {
    pub fn new(bytes: &'a [u8]) -> Result<Self, ReadError> {
        let archive = ZipArchive::new(Cursor::new(bytes)).map_err(|e| {
            let found = format!("it is not a whole ZIP archive: {e}");
            fault("archive", found, "is the file cut short, or of another kind?")
        })?;
        Ok(Self { archive, left: ALWAYS + MAX_RATIO * bytes.len() as u64 })
    }

    /// Opens a part by its name without the first `/`. Names differ by more than their case.
    pub fn open(&mut self, name: &str) -> Result<impl io::BufRead + use<'_, 'a>, ReadError> {
        let index = self.index(name).ok_or_else(|| {
            fault(name, "the archive has no such part", "expected it in the archive: export the file again")
        })?;
        let part = self.archive.by_index(index);
        let part = part.map_err(|e| fault(name, format!("it cannot be unpacked: {e}"), EXPORT_AGAIN))?;
        Ok(BufReader::with_capacity(1 << 12, Budget { part, left: &mut self.left }))
    }

    fn index(&self, name: &str) -> Option<usize> {
        let names = || self.archive.file_names().filter_map(Result::ok).enumerate();
        self.archive.index_for_name(name).or_else(|| {
            let same = |at: &str| at.trim_start_matches('/').eq_ignore_ascii_case(name);
            names().find(|(_, at)| same(at)).and_then(|(_, at)| self.archive.index_for_name(&at))
        })
    }

    /// The name of the part with the build items.
    pub fn start(&mut self) -> Result<String, ReadError> {
        const RELATIONS: &str = "_rels/.rels";
        const USUAL: &str = "3D/3dmodel.model";
        if self.index(RELATIONS).is_none() {
            return Ok(USUAL.into());
        }
        let mut reader = Reader::from_reader(self.open(RELATIONS)?);
        let mut buffer = Vec::new();
        loop {
            buffer.clear();
            let event = reader.read_event_into(&mut buffer);
            let event =
                event.map_err(|e| fault(RELATIONS, format!("the XML is broken: {e}"), EXPORT_AGAIN))?;
            let (Event::Start(tag) | Event::Empty(tag)) = event else {
                if matches!(event, Event::Eof) {
                    return Ok(USUAL.into());
                }
                continue;
            };
            let value = |name: &str| {
                let found = tag.attributes().flatten().find(|a| a.key.local_name().as_ref() == name);
                found.and_then(|a| Some(a.normalized_value(XmlVersion::Implicit1_0).ok()?.into_owned()))
            };
            if value("Type").as_deref() == Some(MODEL)
                && let Some(target) = value("Target")
            {
                return Ok(target.trim_start_matches('/').to_owned());
            }
        }
    }
}

/// A part that gives an error when the archive unpacks to too many bytes.
struct Budget<'b, R> {
    part: R,
    left: &'b mut u64,
}

impl<R: Read> Read for Budget<'_, R> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let read = self.part.read(into)?;
        *self.left = self.left.checked_sub(read as u64).ok_or_else(|| {
            io::Error::other(format!(
                "the archive unpacks to more than {MAX_RATIO} times its size, as a ZIP bomb does"
            ))
        })?;
        Ok(read)
    }
}
