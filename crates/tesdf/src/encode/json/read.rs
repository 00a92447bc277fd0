//! Reads the text of a file. Memory is allocated for elements that are there, never by a count, and
//! arrays are as deep as they should be or an error.
use std::fmt;
use std::marker::PhantomData;

use serde::de::{
    Deserialize, DeserializeSeed, Deserializer, Error as _, IgnoredAny, MapAccess, SeqAccess, Visitor,
};

use super::error::ImportJsonError;
use super::file::{COUNT, Encoded, FACES, GROUPS, NODES};

/// The arrays and counts of a file, unchecked.
#[derive(Default)]
struct Document {
    nodes: [Option<Vec<[f64; 3]>>; 3],
    faces: Option<Vec<[u32; 3]>>,
    tetrahedra: [Option<Vec<[u32; 4]>>; 4],
    lengths: [Option<Vec<u32>>; 4],
    lists: [Option<Lists>; 4],
    /// The counts that the file gives, with the keys of their arrays.
    counts: Vec<(&'static str, u64)>,
}

/// The lists of a group.
#[derive(Default)]
struct Lists {
    faces: Vec<u32>,
    /// Where each list ends. Empty where the file does not tell lists apart.
    ends: Vec<usize>,
    is_nested: bool,
}

/// Reads and checks a file.
pub fn read(bytes: &[u8]) -> Result<Encoded, ImportJsonError> {
    let mut text = serde_json::Deserializer::from_slice(bytes);
    let document = Document::deserialize(&mut text).and_then(|found| text.end().map(|()| found));
    document.map_err(|e| ImportJsonError::Text(e.to_string()))?.checked()
}

impl Document {
    fn checked(self) -> Result<Encoded, ImportJsonError> {
        let nodes = NODES.into_iter().zip(self.nodes.iter().map(|n| n.as_ref().map(Vec::len)));
        let faces = [(FACES, self.faces.as_ref().map(Vec::len))];
        let lengths = self.tetrahedra.iter().map(|t| t.as_ref().map(Vec::len));
        let tetrahedra = GROUPS.iter().map(|group| group.tetrahedra).zip(lengths);
        for (key, found) in nodes.chain(faces).chain(tetrahedra) {
            let Some(length) = found else { return Err(ImportJsonError::Missing { key }) };
            if let Some((_, count)) =
                self.counts.iter().find(|(of, count)| *of == key && *count != length as u64)
            {
                let expected = format!("{length}, the length of {key}");
                return Err(value(format!("{COUNT}{key}"), count.to_string(), expected));
            }
        }
        let mut encoded = Encoded {
            vertices: Vec::new(),
            surface_vertices: self.nodes[0].as_ref().map_or(0, Vec::len),
            faces: self.faces.unwrap_or_default(),
            tetrahedra: Vec::new(),
            group_sizes: [0; 4],
            lists: Vec::new(),
        };
        encoded.vertices.extend(self.nodes.into_iter().flatten().flatten().map(glam::DVec3::from_array));
        in_range(FACES, "node", &encoded.faces, encoded.surface_vertices)?;
        let groups = self.tetrahedra.into_iter().zip(self.lengths).zip(self.lists).zip(&GROUPS);
        for (at, (((tetrahedra, lengths), lists), group)) in groups.enumerate() {
            let tetrahedra = tetrahedra.unwrap_or_default();
            in_range(group.tetrahedra, "node", &tetrahedra, encoded.vertices.len())?;
            let lists = match (lists, tetrahedra.len()) {
                (Some(lists), _) => lists,
                (None, 0) => Lists::default(),
                (None, _) => return Err(ImportJsonError::Missing { key: group.lists }),
            };
            let lists =
                lists.split([group.lists, group.lengths], lengths, tetrahedra.len(), encoded.faces.len())?;
            encoded.group_sizes[at] = tetrahedra.len();
            encoded.tetrahedra.extend(tetrahedra);
            encoded.lists.extend(lists);
        }
        Ok(encoded)
    }
}

impl Lists {
    /// One list for each of `count` tetrahedra. `keys` are those of the lists and of their lengths.
    fn split(
        mut self,
        keys: [&'static str; 2],
        lengths: Option<Vec<u32>>,
        count: usize,
        faces: usize,
    ) -> Result<Vec<Vec<u32>>, ImportJsonError> {
        let [key, key_of_lengths] = keys;
        let of_tetrahedra = |what: &str| format!("{count} {what}, one for each tetrahedron");
        if let Some(lengths) = lengths {
            if lengths.len() != count {
                let found = format!("{} numbers", lengths.len());
                return Err(value(key_of_lengths, found, of_tetrahedra("numbers")));
            }
            let total: u64 = lengths.iter().map(|&n| u64::from(n)).sum();
            if self.is_nested {
                let own = |i: usize| self.ends[i] - if i == 0 { 0 } else { self.ends[i - 1] };
                let differs = |i: &usize| own(*i) as u64 != u64::from(lengths[*i]);
                if let Some(i) = (0..self.ends.len().min(count)).find(differs) {
                    let expected = format!("{}, the length of {key}[{i}]", own(i));
                    return Err(value(format!("{key_of_lengths}[{i}]"), lengths[i].to_string(), expected));
                }
            } else if total != self.faces.len() as u64 {
                let found = format!("{} faces", self.faces.len());
                return Err(value(key, found, format!("{total}, the sum of {key_of_lengths}")));
            } else {
                let mut end = 0;
                self.ends.extend(lengths.iter().map(|&n| {
                    end += n as usize;
                    end
                }));
            }
        } else if !self.is_nested && count > 0 {
            return Err(ImportJsonError::Missing { key: key_of_lengths });
        }
        if self.ends.len() != count {
            return Err(value(key, format!("{} lists", self.ends.len()), of_tetrahedra("lists")));
        }
        let mut start = 0;
        let mut lists = Vec::with_capacity(count);
        for (i, &end) in self.ends.iter().enumerate() {
            let mut list = self.faces[start..end].to_vec();
            if let Some(at) = list.iter().position(|&face| face as usize >= faces) {
                let place = if self.is_nested { i } else { start + at };
                return Err(value(
                    format!("{key}[{place}]"),
                    format!("face {}", list[at]),
                    format!("below {faces}"),
                ));
            }
            if list.is_empty() {
                return Err(value(key, format!("list {i} is empty"), "at least one face"));
            }
            list.sort_unstable();
            list.dedup();
            lists.push(list);
            start = end;
        }
        Ok(lists)
    }
}

fn value(place: impl Into<String>, found: impl Into<String>, expected: impl Into<String>) -> ImportJsonError {
    ImportJsonError::Value { place: place.into(), found: found.into(), expected: expected.into() }
}

/// Checks that all ids of an array are below `count`.
fn in_range<const N: usize>(
    key: &str,
    what: &str,
    rows: &[[u32; N]],
    count: usize,
) -> Result<(), ImportJsonError> {
    let bad =
        rows.iter().enumerate().find_map(|(i, row)| Some((i, row.iter().find(|&&id| id as usize >= count)?)));
    match bad {
        Some((i, id)) => Err(value(format!("{key}[{i}]"), format!("{what} {id}"), format!("below {count}"))),
        None => Ok(()),
    }
}

impl<'de> Deserialize<'de> for Document {
    fn deserialize<D: Deserializer<'de>>(text: D) -> Result<Self, D::Error> {
        struct OfDocument;
        impl<'de> Visitor<'de> for OfDocument {
            type Value = Document;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object with surface_nodes, faces and tetrahedra")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Document, A::Error> {
                let mut document = Document::default();
                while let Some(key) = map.next_key::<String>()? {
                    document.take(&key, &mut map)?;
                }
                Ok(document)
            }
        }
        text.deserialize_map(OfDocument)
    }
}

impl Document {
    /// Reads the value of a key. Other keys are passed over.
    fn take<'de, A: MapAccess<'de>>(&mut self, key: &str, map: &mut A) -> Result<(), A::Error> {
        if let Some(at) = NODES.iter().position(|k| *k == key) {
            return rows(NODES[at], &mut self.nodes[at], map);
        }
        if key == FACES {
            return rows(FACES, &mut self.faces, map);
        }
        for (at, group) in GROUPS.iter().enumerate() {
            if key == group.tetrahedra {
                return rows(group.tetrahedra, &mut self.tetrahedra[at], map);
            } else if key == group.lengths {
                return rows(group.lengths, &mut self.lengths[at], map);
            } else if key == group.lists {
                once(group.lists, self.lists[at].is_some())?;
                self.lists[at] = Some(map.next_value_seed(OfLists(group.lists))?);
                return Ok(());
            }
        }
        let arrays = NODES.into_iter().chain([FACES]).chain(GROUPS.iter().map(|group| group.tetrahedra));
        match key.strip_prefix(COUNT).and_then(|of| arrays.into_iter().find(|array| *array == of)) {
            Some(array) => {
                let count = map.next_value().map_err(|e| A::Error::custom(format!("{key}: {e}")))?;
                self.counts.push((array, count));
            }
            None => _ = map.next_value::<IgnoredAny>()?,
        }
        Ok(())
    }
}

/// Refuses a key that was read already.
fn once<E: serde::de::Error>(key: &str, known: bool) -> Result<(), E> {
    if known { Err(E::custom(format!("{key} is given twice"))) } else { Ok(()) }
}

/// Reads an array, whose errors name the key and the element.
fn rows<'de, T: Deserialize<'de>, A: MapAccess<'de>>(
    key: &'static str,
    to: &mut Option<Vec<T>>,
    map: &mut A,
) -> Result<(), A::Error> {
    once(key, to.is_some())?;
    *to = Some(map.next_value_seed(Rows(key, PhantomData))?);
    Ok(())
}

/// An array of rows, by its key.
struct Rows<T>(&'static str, PhantomData<T>);

impl<'de, T: Deserialize<'de>> DeserializeSeed<'de> for Rows<T> {
    type Value = Vec<T>;

    fn deserialize<D: Deserializer<'de>>(self, text: D) -> Result<Vec<T>, D::Error> {
        let key = self.0;
        text.deserialize_seq(self).map_err(|e| named(key, e))
    }
}

impl<'de, T: Deserialize<'de>> Visitor<'de> for Rows<T> {
    type Value = Vec<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an array")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut array: A) -> Result<Vec<T>, A::Error> {
        let mut rows = Vec::new();
        loop {
            match array.next_element() {
                Ok(Some(row)) => rows.push(row),
                Ok(None) => return Ok(rows),
                Err(e) => return Err(A::Error::custom(format!("{}[{}]: {e}", self.0, rows.len()))),
            }
        }
    }
}

/// Names the key in an error that does not name it yet.
fn named<E: serde::de::Error>(key: &str, error: E) -> E {
    let text = error.to_string();
    if text.starts_with(key) { error } else { E::custom(format!("{key}: {text}")) }
}

/// Lists by their key: one flat array of faces, or an array for each tetrahedron.
struct OfLists(&'static str);

impl<'de> DeserializeSeed<'de> for OfLists {
    type Value = Lists;

    fn deserialize<D: Deserializer<'de>>(self, text: D) -> Result<Lists, D::Error> {
        let key = self.0;
        text.deserialize_seq(self).map_err(|e| named(key, e))
    }
}

impl<'de> Visitor<'de> for OfLists {
    type Value = Lists;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an array of faces, or of lists of faces")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut array: A) -> Result<Lists, A::Error> {
        let (mut lists, mut at) = (Lists::default(), 0);
        loop {
            match array.next_element_seed(Entry(&mut lists, at)) {
                Ok(Some(())) => at += 1,
                Ok(None) => return Ok(lists),
                Err(e) => return Err(A::Error::custom(format!("{}[{at}]: {e}", self.0))),
            }
        }
    }
}

/// An entry of the lists, by its place: a face, or a list.
struct Entry<'a>(&'a mut Lists, usize);

impl Entry<'_> {
    /// Refuses an entry of the other kind than the first.
    fn is_of_one_kind<E: serde::de::Error>(&mut self, is_nested: bool) -> Result<(), E> {
        if self.1 > 0 && self.0.is_nested != is_nested {
            return Err(E::custom("faces and lists are mixed, expected either"));
        }
        self.0.is_nested = is_nested;
        Ok(())
    }
}

impl<'de> DeserializeSeed<'de> for Entry<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, text: D) -> Result<(), D::Error> {
        text.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Entry<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a face or a list of faces")
    }

    fn visit_u64<E: serde::de::Error>(mut self, face: u64) -> Result<(), E> {
        self.is_of_one_kind(false)?;
        let face = u32::try_from(face).map_err(|_| E::custom(format!("face {face} is too large")))?;
        self.0.faces.push(face);
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(mut self, mut list: A) -> Result<(), A::Error> {
        self.is_of_one_kind(true)?;
        while let Some(face) = list.next_element()? {
            self.0.faces.push(face);
        }
        self.0.ends.push(self.0.faces.len());
        Ok(())
    }
}
