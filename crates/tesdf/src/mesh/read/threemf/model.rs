//! A model of a 3MF file: its objects and build items.
use std::borrow::Cow;

use glam::{DAffine3, DMat3, DVec3};
use quick_xml::events::{BytesStart, Event};
use quick_xml::name::ResolveResult;
use quick_xml::{NsReader, XmlVersion};

use super::package::Package;
use super::{EXPORT_AGAIN, ReadError, fault};
use crate::mesh::read::text::shown;

/// One part of the archive.
pub(super) struct Model {
    /// Name of the part.
    pub part: String,
    /// Name of the unit of length.
    pub unit: &'static str,
    pub objects: Vec<Object>,
    pub items: Vec<Component>,
}

pub(super) struct Object {
    /// Name of the part.
    part: String,
    pub id: u32,
    pub name: Option<String>,
    pub is_support: bool,
    pub shape: Shape,
}

pub(super) enum Shape {
    Mesh { positions: Vec<DVec3>, triangles: Vec<[u32; 3]> },
    Components(Vec<Component>),
}

/// An object at a place: a component or a build item.
pub(super) struct Component {
    /// Name of the part, where it is another one.
    pub part: Option<String>,
    pub object: u32,
    pub pose: DAffine3,
}

impl Object {
    pub fn place(&self) -> String {
        format!("{}, object {}", self.part, self.id)
    }
}

impl Model {
    /// The other parts that components and items name.
    pub fn parts_named(&self) -> impl Iterator<Item = &String> {
        let components = self.objects.iter().flat_map(|object| match &object.shape {
            Shape::Components(components) => components.as_slice(),
            Shape::Mesh { .. } => &[],
        });
        components.chain(&self.items).filter_map(|component| component.part.as_ref())
    }
}

/// The part of the name of an extension that changes the shape in no way, or that is read.
const KNOWN: [&str; 5] = ["/production/", "/material/", "/slice/", "/trianglesets/", "/core/"];

pub(super) fn read(package: &mut Package<'_>, part: &str) -> Result<Model, ReadError> {
    let mut reader = NsReader::from_reader(package.open(part)?);
    let model = Model { part: part.into(), unit: "mm", objects: Vec::new(), items: Vec::new() };
    let mut state = State { model, object: None, depth: 0 };
    let mut buffer = Vec::new();
    loop {
        buffer.clear();
        let at = reader.buffer_position();
        let event = reader.read_resolved_event_into(&mut buffer);
        let (space, event) = event.map_err(|e| {
            fault(format!("{part}, after byte {at}"), format!("the XML cannot be read: {e}"), EXPORT_AGAIN)
        })?;
        let is_core = match space {
            ResolveResult::Bound(space) => is_core(space.as_ref()),
            ResolveResult::Unbound => true,
            ResolveResult::Unknown(_) => false,
        };
        match event {
            Event::Start(tag) => {
                state.depth += 1;
                if is_core {
                    state.open(&Tag { tag: &tag, part, at })?;
                }
            }
            Event::Empty(tag) if is_core => {
                let name = tag.local_name();
                state.open(&Tag { tag: &tag, part, at })?;
                state.close(name.as_ref())?;
            }
            Event::End(tag) => {
                state.depth -= 1;
                if is_core {
                    state.close(tag.local_name().as_ref())?;
                }
            }
            Event::Eof if state.depth > 0 => {
                let place = format!("{part}, byte {at}");
                return Err(fault(place, "the XML ends within an element", "is the file cut short?"));
            }
            Event::Eof => return Ok(state.model),
            _ => {}
        }
    }
}

fn is_core(space: &str) -> bool {
    space.contains("/3dmanufacturing/core/") || space.ends_with("/3dmanufacturing/2013/01")
}

/// What has been read so far.
struct State {
    model: Model,
    /// The object that is open.
    object: Option<Object>,
    depth: usize,
}

impl State {
    fn open(&mut self, tag: &Tag<'_>) -> Result<(), ReadError> {
        match tag.tag.local_name().as_ref() {
            "model" => {
                tag.refuse_extensions()?;
                self.model.unit = tag.unit()?;
            }
            "object" => {
                let kind = tag.text("type")?.unwrap_or_default();
                self.object = Some(Object {
                    part: self.model.part.clone(),
                    id: tag.id("id")?,
                    name: tag.text("name")?.or(tag.text("partnumber")?).map(Cow::into_owned),
                    is_support: matches!(&*kind, "support" | "solidsupport"),
                    shape: Shape::Components(Vec::new()),
                });
            }
            "item" => {
                let item = tag.component()?;
                self.model.items.push(item);
            }
            name => {
                if let Some(object) = &mut self.object {
                    object.open(name, tag)?;
                }
            }
        }
        Ok(())
    }

    fn close(&mut self, name: &str) -> Result<(), ReadError> {
        if name == "object"
            && let Some(object) = self.object.take()
        {
            object.check()?;
            self.model.objects.push(object);
        }
        Ok(())
    }
}

impl Object {
    fn open(&mut self, name: &str, tag: &Tag<'_>) -> Result<(), ReadError> {
        match (name, &mut self.shape) {
            ("mesh", shape) => *shape = Shape::Mesh { positions: Vec::new(), triangles: Vec::new() },
            ("vertex", Shape::Mesh { positions, .. }) => {
                let [x, y, z] = ["x", "y", "z"].map(|axis| tag.number(axis));
                positions.push(DVec3::new(x?, y?, z?));
            }
            ("triangle", Shape::Mesh { triangles, .. }) => {
                let [a, b, c] = ["v1", "v2", "v3"].map(|corner| tag.id(corner));
                triangles.push([a?, b?, c?]);
            }
            ("component", Shape::Components(components)) => components.push(tag.component()?),
            _ => {}
        }
        Ok(())
    }

    /// Checks the ids of vertices: they count within the object.
    fn check(&self) -> Result<(), ReadError> {
        let Shape::Mesh { positions, triangles } = &self.shape else { return Ok(()) };
        let outside = |corners: &[u32; 3]| corners.iter().copied().find(|&v| v as usize >= positions.len());
        match triangles.iter().enumerate().find_map(|(i, corners)| Some((i, outside(corners)?))) {
            None => Ok(()),
            Some((i, vertex)) => {
                let found = format!(
                    "triangle {i} (0-based) uses vertex {vertex}, but the object has {} vertices (0-based)",
                    positions.len()
                );
                Err(fault(self.place(), found, "expected a smaller id: export the file again"))
            }
        }
    }
}

/// A tag with its place.
struct Tag<'a> {
    tag: &'a BytesStart<'a>,
    /// Name of the part.
    part: &'a str,
    /// Offset in the unpacked part.
    at: u64,
}

impl Tag<'_> {
    fn error(&self, found: String, help: &str) -> ReadError {
        let name = self.tag.local_name().as_ref().to_owned();
        fault(format!("{}, byte {}", self.part, self.at), format!("<{name}>: {found}"), help)
    }

    fn text(&self, name: &str) -> Result<Option<Cow<'_, str>>, ReadError> {
        for attribute in self.tag.attributes() {
            let broken = |e: String| self.error(format!("broken attributes: {e}"), EXPORT_AGAIN);
            let attribute = attribute.map_err(|e| broken(e.to_string()))?;
            if attribute.key.local_name().as_ref() == name && !attribute.key.as_ref().starts_with("xmlns:") {
                let value = attribute.normalized_value(XmlVersion::Implicit1_0);
                return Ok(Some(value.map_err(|e| broken(e.to_string()))?));
            }
        }
        Ok(None)
    }

    fn needed(&self, name: &str) -> Result<Cow<'_, str>, ReadError> {
        self.text(name)?.ok_or_else(|| {
            self.error(
                format!("the attribute {} is missing", shown(name.as_bytes())),
                "expected it: export the file again",
            )
        })
    }

    fn number(&self, name: &str) -> Result<f64, ReadError> {
        let text = self.needed(name)?;
        text.trim().parse().map_err(|_| {
            let found = format!("{} is {}", shown(name.as_bytes()), shown(text.as_bytes()));
            self.error(found, "expected a decimal number such as -1.5e-3")
        })
    }

    fn id(&self, name: &str) -> Result<u32, ReadError> {
        let text = self.needed(name)?;
        text.trim().parse().map_err(|_| {
            let found = format!("{} is {}", shown(name.as_bytes()), shown(text.as_bytes()));
            self.error(found, "expected a whole number from 0")
        })
    }

    fn component(&self) -> Result<Component, ReadError> {
        let part = self.text("path")?.map(|path| path.trim_start_matches('/').to_owned());
        Ok(Component { part, object: self.id("objectid")?, pose: self.pose()? })
    }

    /// The attribute `transform`: the rows of a matrix that multiplies row vectors, so the columns
    /// of one that multiplies column vectors.
    fn pose(&self) -> Result<DAffine3, ReadError> {
        let Some(text) = self.text("transform")? else { return Ok(DAffine3::IDENTITY) };
        let numbers: Option<Vec<f64>> = text.split_ascii_whitespace().map(|word| word.parse().ok()).collect();
        let help = "expected 12 numbers that keep the mesh a volume: m00 m01 m02 m10 m11 m12 m20 m21 m22 m30 m31 m32";
        let found = || format!("the transform is {}", shown(text.as_bytes()));
        let Some(Ok(m)) = numbers.map(<[f64; 12]>::try_from) else { return Err(self.error(found(), help)) };
        let linear = DMat3::from_cols_slice(&m[..9]);
        let pose = DAffine3::from_mat3_translation(linear, DVec3::from_slice(&m[9..]));
        let size = linear.determinant();
        if size == 0.0 || !size.is_finite() || !pose.translation.is_finite() {
            return Err(self.error(found(), help));
        }
        Ok(pose)
    }

    fn unit(&self) -> Result<&'static str, ReadError> {
        let Some(text) = self.text("unit")? else { return Ok("mm") };
        let units = [
            ("micron", "um"),
            ("millimeter", "mm"),
            ("centimeter", "cm"),
            ("inch", "in"),
            ("foot", "ft"),
            ("meter", "m"),
        ];
        units.iter().find(|(name, _)| *name == text.trim()).map(|(_, unit)| *unit).ok_or_else(|| {
            let found = format!("the unit is {}", shown(text.as_bytes()));
            self.error(found, "expected micron, millimeter, centimeter, inch, foot or meter")
        })
    }

    /// Refuses a model that says that it cannot be read without an extension that is not read.
    fn refuse_extensions(&self) -> Result<(), ReadError> {
        let needed = self.text("requiredextensions")?.unwrap_or_default();
        for prefix in needed.split_ascii_whitespace() {
            let declaration = format!("xmlns:{prefix}");
            let space = self.tag.attributes().flatten().find(|a| a.key.as_ref() == declaration);
            let space = space.map(|a| a.value.into_owned()).unwrap_or_default();
            if !KNOWN.iter().any(|known| space.contains(known)) {
                let found = format!(
                    "the model needs the extension {} ({}), which is not read",
                    shown(prefix.as_bytes()),
                    shown(space.as_bytes())
                );
                return Err(self.error(found, "export the file without it, as plain meshes"));
            }
        }
        Ok(())
    }
}
