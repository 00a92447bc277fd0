//! Contacts as arrays, one for each field.
use numpy::{Element, IntoPyArray, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use tesdf::collide::{
    CoarseContact, Contact, Contacts, FeatureB, FeatureId, HiddenOverlap, InstanceId, PairReduction,
    TouchingFeatures,
};
use tesdf::glam::DVec3;

use crate::classes;
use crate::errors::{argument, kind_of};

/// The cell of a contact that has none.
pub const NO_CELL: u32 = u32::MAX;

/// The arrays of an object of `tesdf.contacts`, by name.
pub struct Columns<'py> {
    py: Python<'py>,
    named: Bound<'py, PyDict>,
}

impl<'py> Columns<'py> {
    /// Without an array.
    pub fn new(py: Python<'py>) -> Self {
        Self { py, named: PyDict::new(py) }
    }

    /// Adds an array of shape `[N]`.
    pub fn add<T: Element>(self, name: &str, values: impl Iterator<Item = T>) -> PyResult<Self> {
        self.named.set_item(name, values.collect::<Vec<T>>().into_pyarray(self.py))?;
        Ok(self)
    }

    /// Adds an array of shape `[N, W]`.
    pub fn add_rows<T: Element, const W: usize>(
        self,
        name: &str,
        rows: impl Iterator<Item = [T; W]>,
    ) -> PyResult<Self> {
        let flat = rows.collect::<Vec<[T; W]>>().into_flattened();
        let shape = [flat.len() / W, W];
        self.named.set_item(name, flat.into_pyarray(self.py).reshape(shape)?)?;
        Ok(self)
    }

    /// Adds any other field.
    pub fn with(self, name: &str, value: Bound<'py, PyAny>) -> PyResult<Self> {
        self.named.set_item(name, value)?;
        Ok(self)
    }

    /// The object of the class `name` of `tesdf.contacts`.
    pub fn build(self, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.build_of("tesdf.contacts", name)
    }

    /// The object of the class `name` of a module.
    pub fn build_of(self, module: &str, name: &str) -> PyResult<Bound<'py, PyAny>> {
        self.py.import(module)?.getattr(name)?.call((), Some(&self.named))
    }
}

/// An array of an object of `tesdf.contacts`.
pub struct Column<'py, T: Element>(PyReadonlyArrayDyn<'py, T>);

impl<'py, T: Element> Column<'py, T> {
    /// The array `name` of `contacts`.
    ///
    /// # Errors
    /// `ValueError` if the object does not have it.
    pub fn new(contacts: &Bound<'py, PyAny>, name: &str) -> PyResult<Self> {
        let refused = || argument("contacts", kind_of(contacts), "Contacts of Scene.detect");
        let array = contacts.getattr(name).map_err(|_| refused())?;
        let array = array.cast_into::<PyArrayDyn<T>>().map_err(|_| refused())?;
        Ok(Self(array.try_readonly()?))
    }

    /// Its numbers.
    pub fn each(&self) -> PyResult<&[T]> {
        Ok(self.0.as_slice()?)
    }

    /// Its rows of `W` numbers.
    pub fn rows<const W: usize>(&self) -> PyResult<&[[T; W]]> {
        Ok(self.0.as_slice()?.as_chunks::<W>().0)
    }
}

/// An object of `tesdf.Contacts`.
pub fn contacts<'py>(py: Python<'py>, found: &Contacts) -> PyResult<Bound<'py, PyAny>> {
    columns(py, found.as_slice())?
        .with("statistics", classes::report(py, "DetectionStatistics", &found.statistics)?)?
        .with("reductions", reductions(py, &found.reductions)?)?
        .with("hidden", hidden_overlaps(py, &found.hidden)?)?
        .build("Contacts")
}

/// An object of `tesdf.contacts.StepContacts`.
pub fn of_step<'py>(
    py: Python<'py>,
    found: &[Contact],
    overlaps: &[HiddenOverlap],
) -> PyResult<Bound<'py, PyAny>> {
    columns(py, found)?.with("hidden", hidden_overlaps(py, overlaps)?)?.build("StepContacts")
}

/// The columns of contacts. In Python each is an array.
#[derive(Default)]
struct Table {
    point_a: Vec<[f64; 3]>,
    point_b: Vec<[f64; 3]>,
    normal: Vec<[f64; 3]>,
    distance: Vec<f64>,
    face_a: Vec<u32>,
    face_b: Vec<u32>,
    tet_b: Vec<u32>,
    instance_a: Vec<u32>,
    instance_b: Vec<u32>,
    feature_a: Vec<u32>,
    feature_b_kind: Vec<u8>,
    feature_b: Vec<[u32; 2]>,
    converged: Vec<bool>,
}

/// Contacts of a block. They stay in the cache while they are spread over the columns; otherwise
/// each column would read all contacts from memory.
const BLOCK: usize = 256;

impl Table {
    fn new(found: &[Contact]) -> Self {
        let mut table = Self::default();
        table.reserve(found.len());
        found.chunks(BLOCK).for_each(|block| table.push(block));
        table
    }

    fn reserve(&mut self, rows: usize) {
        for points in [&mut self.point_a, &mut self.point_b, &mut self.normal] {
            points.reserve_exact(rows);
        }
        for ids in [&mut self.face_a, &mut self.face_b, &mut self.tet_b] {
            ids.reserve_exact(rows);
        }
        for ids in [&mut self.instance_a, &mut self.instance_b, &mut self.feature_a] {
            ids.reserve_exact(rows);
        }
        self.distance.reserve_exact(rows);
        self.feature_b_kind.reserve_exact(rows);
        self.feature_b.reserve_exact(rows);
        self.converged.reserve_exact(rows);
    }

    fn push(&mut self, block: &[Contact]) {
        let of = || block.iter();
        let feature_b = |c: &Contact| kind_and_ids(c.feature.b);
        self.point_a.extend(of().map(|c| c.point_a.to_array()));
        self.point_b.extend(of().map(|c| c.point_b.to_array()));
        self.normal.extend(of().map(|c| c.normal.to_array()));
        self.distance.extend(of().map(|c| c.distance));
        self.face_a.extend(of().map(|c| c.face_a));
        self.face_b.extend(of().map(|c| c.face_b));
        self.tet_b.extend(of().map(|c| c.tet_b.unwrap_or(NO_CELL)));
        self.instance_a.extend(of().map(|c| c.instance_a.0));
        self.instance_b.extend(of().map(|c| c.instance_b.0));
        self.feature_a.extend(of().map(|c| c.feature.a));
        self.feature_b_kind.extend(of().map(|c| feature_b(c).0));
        self.feature_b.extend(of().map(|c| feature_b(c).1));
        self.converged.extend(of().map(|c| c.converged));
    }
}

/// A feature as a number of its kind, and two ids of which an edge alone uses the second one.
fn kind_and_ids(feature: FeatureB) -> (u8, [u32; 2]) {
    match feature {
        FeatureB::Vertex(vertex) => (0, [vertex, NO_CELL]),
        FeatureB::Edge(low, high) => (1, [low, high]),
        FeatureB::Face(face) => (2, [face, NO_CELL]),
    }
}

/// An object of `tesdf.TouchingFeatures`.
pub fn touching<'py>(py: Python<'py>, found: &[TouchingFeatures]) -> PyResult<Bound<'py, PyAny>> {
    let (a, b) = (|| found.iter().map(|f| kind_and_ids(f.a)), || found.iter().map(|f| kind_and_ids(f.b)));
    Columns::new(py)
        .add("a_kind", a().map(|(kind, _)| kind))?
        .add_rows("a", a().map(|(_, ids)| ids))?
        .add("b_kind", b().map(|(kind, _)| kind))?
        .add_rows("b", b().map(|(_, ids)| ids))?
        .build("TouchingFeatures")
}

fn columns<'py>(py: Python<'py>, found: &[Contact]) -> PyResult<Columns<'py>> {
    let table = py.detach(|| Table::new(found));
    Columns::new(py)
        .add_rows("point_a", table.point_a.into_iter())?
        .add_rows("point_b", table.point_b.into_iter())?
        .add_rows("normal", table.normal.into_iter())?
        .add("distance", table.distance.into_iter())?
        .add("face_a", table.face_a.into_iter())?
        .add("face_b", table.face_b.into_iter())?
        .add("tet_b", table.tet_b.into_iter())?
        .add("instance_a", table.instance_a.into_iter())?
        .add("instance_b", table.instance_b.into_iter())?
        .add("feature_a", table.feature_a.into_iter())?
        .add("feature_b_kind", table.feature_b_kind.into_iter())?
        .add_rows("feature_b", table.feature_b.into_iter())?
        .add("converged", table.converged.into_iter())
}

fn reductions<'py>(py: Python<'py>, found: &[PairReduction]) -> PyResult<Bound<'py, PyAny>> {
    let of = || found.iter();
    Columns::new(py)
        .add("instance_a", ids(of().map(|r| r.instance_a)))?
        .add("instance_b", ids(of().map(|r| r.instance_b)))?
        .add("contacts", of().map(|r| r.contacts as u64))?
        .add("kept", of().map(|r| r.kept as u64))?
        .add("wrench_error", of().map(|r| r.wrench_error))?
        .add_rows("center", of().map(|r| r.center.to_array()))?
        .add("length", of().map(|r| r.length))?
        .add("left_out_above", of().map(|r| r.left_out_above.unwrap_or(f64::NAN)))?
        .build("Reductions")
}

pub fn hidden_overlaps<'py>(py: Python<'py>, found: &[HiddenOverlap]) -> PyResult<Bound<'py, PyAny>> {
    let of = || found.iter();
    Columns::new(py)
        .add("instance_a", ids(of().map(|h| h.instance_a)))?
        .add("instance_b", ids(of().map(|h| h.instance_b)))?
        .add("depth", of().map(|h| h.depth))?
        .build("HiddenOverlaps")
}

/// An object of `tesdf.contacts.CoarseContacts`.
pub fn coarse<'py>(py: Python<'py>, found: &[CoarseContact]) -> PyResult<Bound<'py, PyAny>> {
    let of = || found.iter();
    Columns::new(py)
        .add("instance_a", ids(of().map(|c| c.instance_a)))?
        .add("instance_b", ids(of().map(|c| c.instance_b)))?
        .add("face_a", of().map(|c| c.face_a))?
        .add("corner_reach", of().map(|c| c.corner_reach))?
        .add("distance", of().map(|c| c.distance))?
        .build("CoarseContacts")
}

fn ids(ids: impl Iterator<Item = InstanceId>) -> impl Iterator<Item = u32> {
    ids.map(|id| id.0)
}

/// The contacts whose columns an object of `tesdf.Contacts` has.
pub fn contacts_of(of: &Bound<'_, PyAny>) -> PyResult<Vec<Contact>> {
    let vectors = |name| Column::<f64>::new(of, name);
    let ids = |name| Column::<u32>::new(of, name);
    let (point_a, point_b, normal) = (vectors("point_a")?, vectors("point_b")?, vectors("normal")?);
    let (face_a, face_b, tet_b) = (ids("face_a")?, ids("face_b")?, ids("tet_b")?);
    let (instance_a, instance_b) = (ids("instance_a")?, ids("instance_b")?);
    let (feature_a, feature_b) = (ids("feature_a")?, ids("feature_b")?);
    let (distance, kind) = (vectors("distance")?, Column::<u8>::new(of, "feature_b_kind")?);
    let converged = Column::<bool>::new(of, "converged")?;
    let (point_a, point_b, normal) = (point_a.rows::<3>()?, point_b.rows::<3>()?, normal.rows::<3>()?);
    let (face_a, face_b, tet_b) = (face_a.each()?, face_b.each()?, tet_b.each()?);
    let (instance_a, instance_b) = (instance_a.each()?, instance_b.each()?);
    let (feature_a, feature_b) = (feature_a.each()?, feature_b.rows::<2>()?);
    let (distance, kind, converged) = (distance.each()?, kind.each()?, converged.each()?);
    let lengths = [point_a.len(), point_b.len(), normal.len(), face_a.len(), face_b.len(), tet_b.len()];
    let more =
        [instance_a.len(), instance_b.len(), feature_a.len(), feature_b.len(), kind.len(), converged.len()];
    if lengths.iter().chain(&more).any(|&length| length != distance.len()) {
        return Err(argument("contacts", "arrays of different lengths", "a row for each contact"));
    }
    let contact = |i: usize| Contact {
        point_a: DVec3::from_array(point_a[i]),
        point_b: DVec3::from_array(point_b[i]),
        normal: DVec3::from_array(normal[i]),
        distance: distance[i],
        face_a: face_a[i],
        face_b: face_b[i],
        tet_b: Some(tet_b[i]).filter(|&cell| cell != NO_CELL),
        instance_a: InstanceId(instance_a[i]),
        instance_b: InstanceId(instance_b[i]),
        feature: FeatureId {
            a: feature_a[i],
            b: match (kind[i], feature_b[i]) {
                (0, [vertex, _]) => FeatureB::Vertex(vertex),
                (1, [low, high]) => FeatureB::Edge(low, high),
                (_, [face, _]) => FeatureB::Face(face),
            },
        },
        converged: converged[i],
    };
    Ok((0..distance.len()).map(contact).collect())
}
