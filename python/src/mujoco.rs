//! `tesdf._native.fill_mujoco_contacts`: the rows of MuJoCo's `data.contact`, from the contacts of
//! a detection.
use std::marker::PhantomData;
use std::ops::Range;

use numpy::{
    Element, IntoPyArray, PyArray1, PyArray3, PyArrayDyn, PyArrayMethods, PyReadonlyArray2, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use crate::arrays::{self, Rows};
use crate::contacts::Column;
use crate::errors::argument;

/// Writes contacts into the rows of `data.contact` of MuJoCo from `start` on.
///
/// - fields: `data.contact`. Its arrays are written in place, whatever their strides. No other
///   thread may use the data meanwhile.
/// - start: the row of the first contact.
/// - contacts: Contacts of Scene.detect, in the frame and unit of the model.
/// - geoms: the geom of each instance, [G].
/// - parameters: is called once, with the first and the second geoms of the kinds of contacts, [K]
///   and [K], int64. It returns an object with condim [K], friction [K, 5], solref [K, 2] and
///   solimp [K, 5].
///
/// A contact gets the middle of its two points as `pos`, and the geom of instance_b as its first
/// one, because MuJoCo's normal points from the first geom to the second one. `includemargin` and
/// all that MuJoCo's solver fills in are 0, `efc_address` and the ids of flexes are -1.
///
/// Raises ValueError if an array has another type or shape, lacks rows or cannot be written.
/// Nothing has been written then.
#[pyfunction]
pub fn fill_mujoco_contacts(
    py: Python<'_>,
    fields: &Bound<'_, PyAny>,
    start: usize,
    contacts: &Bound<'_, PyAny>,
    geoms: &Bound<'_, PyAny>,
    parameters: &Bound<'_, PyAny>,
) -> PyResult<()> {
    let vectors = |name| Column::<f64>::new(contacts, name);
    let ids = |name| Column::<u32>::new(contacts, name);
    let (point_a, point_b, normal) = (vectors("point_a")?, vectors("point_b")?, vectors("normal")?);
    let (distance, instance_a, instance_b) = (vectors("distance")?, ids("instance_a")?, ids("instance_b")?);
    let found = Found {
        point_a: point_a.rows()?,
        point_b: point_b.rows()?,
        normal: normal.rows()?,
        distance: distance.each()?,
        first: instance_b.each()?,
        second: instance_a.each()?,
    };
    found.check()?;
    let kinds = Kinds::of(&found, &geom_ids(geoms)?)?;
    let of = |place: usize| PyArray1::from_iter(py, kinds.geoms.iter().map(|pair| i64::from(pair[place])));
    let parameters = Parameters::new(&parameters.call1((of(0), of(1)))?, kinds.geoms.len())?;
    let fields = Fields::new(fields, start..start.saturating_add(found.distance.len()))?;
    py.detach(|| {
        for run in &kinds.runs {
            for row in run.rows.clone() {
                fields.set(row, &found, kinds.geoms[run.kind], &parameters, run.kind);
            }
        }
    });
    Ok(())
}

/// The frames of contacts in MuJoCo, [N, 3, 3]: each normal [N, 3], and two directions that make a
/// right-handed frame with it.
#[pyfunction]
pub fn contact_frames<'py>(
    py: Python<'py>,
    normals: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let rows = Rows::new("normals", normals)?;
    let normals = rows.as_slice()?;
    let found: Vec<f64> = py.detach(|| normals.iter().flat_map(|n| frame(n.to_array())).collect());
    found.into_pyarray(py).reshape([normals.len(), 3, 3])
}

/// A unit normal, and two directions that make a right-handed frame with it, one after the other.
fn frame(normal: [f64; 3]) -> [f64; 9] {
    let [x, y, z] = normal;
    // The normal and the axis x, or y where the normal is along x.
    let is_across = x.abs() < 0.7;
    let other = if is_across { y } else { x };
    let length = (other * other + z * z).sqrt();
    let across = if is_across { [0.0, z, -y] } else { [-z, 0.0, x] };
    let [u, v, w] = across.map(|component| component / length);
    [x, y, z, u, v, w, y * w - z * v, z * u - x * w, x * v - y * u]
}

/// The columns of the contacts that MuJoCo gets.
struct Found<'a> {
    point_a: &'a [[f64; 3]],
    point_b: &'a [[f64; 3]],
    normal: &'a [[f64; 3]],
    distance: &'a [f64],
    first: &'a [u32],
    second: &'a [u32],
}

impl Found<'_> {
    fn check(&self) -> PyResult<()> {
        let lengths =
            [self.point_a.len(), self.point_b.len(), self.normal.len(), self.first.len(), self.second.len()];
        if lengths.iter().any(|&length| length != self.distance.len()) {
            return Err(argument("contacts", "arrays of different lengths", "a row for each contact"));
        }
        Ok(())
    }
}

fn geom_ids(geoms: &Bound<'_, PyAny>) -> PyResult<Vec<i32>> {
    let numbers = arrays::integers("geoms", geoms, "shape (G,)", |shape| shape.len() == 1)?;
    let id = |&number: &i64| {
        let expected = "ids from 0 to 2^31 - 1 (0-based)";
        let id = i32::try_from(number).ok().filter(|&id| id >= 0);
        id.ok_or_else(|| argument("geoms", format!("the id {number}"), expected))
    };
    numbers.as_slice()?.iter().map(id).collect()
}

/// Contacts with the same two geoms have the same parameters.
struct Kinds {
    /// The first and the second geom of each kind, in the order of the instances.
    geoms: Vec<[i32; 2]>,
    runs: Vec<Run>,
}

/// Contacts that follow each other and are of one kind.
struct Run {
    rows: Range<usize>,
    kind: usize,
}

impl Kinds {
    fn of(found: &Found<'_>, geoms: &[i32]) -> PyResult<Self> {
        let pair = |row: usize| [found.first[row], found.second[row]];
        let mut starts: Vec<usize> =
            (0..found.distance.len()).filter(|&row| row == 0 || pair(row) != pair(row - 1)).collect();
        let mut pairs: Vec<[u32; 2]> = starts.iter().map(|&row| pair(row)).collect();
        pairs.sort_unstable();
        pairs.dedup();
        starts.push(found.distance.len());
        let run = |bounds: &[usize]| Run {
            rows: bounds[0]..bounds[1],
            kind: pairs.partition_point(|other| *other < pair(bounds[0])),
        };
        let runs = starts.windows(2).map(run).collect();
        let geom = |instance: u32| {
            let expected = format!("instances of the {} geoms", geoms.len());
            let geom = geoms.get(instance as usize).copied();
            geom.ok_or_else(|| argument("contacts", format!("the instance {instance}"), &expected))
        };
        let of_pair = |pair: &[u32; 2]| Ok([geom(pair[0])?, geom(pair[1])?]);
        Ok(Self { geoms: pairs.iter().map(of_pair).collect::<PyResult<_>>()?, runs })
    }
}

/// What the geoms of a contact decide, a row for each kind.
struct Parameters {
    condim: Vec<i32>,
    friction: Vec<[f64; 5]>,
    solref: Vec<[f64; 2]>,
    solimp: Vec<[f64; 5]>,
}

impl Parameters {
    fn new(given: &Bound<'_, PyAny>, kinds: usize) -> PyResult<Self> {
        let condim =
            arrays::integers("condim", &given.getattr("condim")?, &format!("shape ({kinds},)"), |s| {
                s == [kinds]
            })?;
        let dimension = |&number: &i64| {
            let expected = "1, 3, 4 or 6";
            i32::try_from(number).map_err(|_| argument("condim", number, expected))
        };
        Ok(Self {
            condim: condim.as_slice()?.iter().map(dimension).collect::<PyResult<_>>()?,
            friction: table(given, "friction", kinds)?,
            solref: table(given, "solref", kinds)?,
            solimp: table(given, "solimp", kinds)?,
        })
    }
}

/// Rows of `W` numbers of an attribute.
fn table<const W: usize>(of: &Bound<'_, PyAny>, name: &str, rows: usize) -> PyResult<Vec<[f64; W]>> {
    let py = of.py();
    let array = py.import("numpy")?.call_method1("asarray", (of.getattr(name)?, numpy::dtype::<f64>(py)))?;
    match array.extract::<PyReadonlyArray2<'_, f64>>() {
        Ok(numbers) if numbers.shape() == [rows, W] => {
            let numbers = numbers.as_array();
            Ok(numbers.rows().into_iter().map(|row| std::array::from_fn(|k| row[k])).collect())
        }
        _ => {
            let found = format!("an array of shape {}", array.getattr("shape")?);
            Err(argument(name, found, &format!("shape ({rows}, {W})")))
        }
    }
}

/// The fields of `data.contact`. Each row has them side by side, so they are written row by row:
/// one field after the other would pass through the memory of all rows as many times.
struct Fields {
    dist: Field<f64, 1>,
    pos: Field<f64, 3>,
    frame: Field<f64, 9>,
    friction: Field<f64, 5>,
    solref: Field<f64, 2>,
    solimp: Field<f64, 5>,
    dim: Field<i32, 1>,
    geom1: Field<i32, 1>,
    geom2: Field<i32, 1>,
    geom: Field<i32, 2>,
    /// flex, elem, vert: -1
    no_flex: [Field<i32, 2>; 3],
    /// -1
    efc_address: Field<i32, 1>,
    /// 0
    exclude: Field<i32, 1>,
    /// includemargin, mu, adhesion: 0
    numbers: [Field<f64, 1>; 3],
    /// 0
    solreffriction: Field<f64, 2>,
    /// 0
    surfacevel: Field<f64, 3>,
    /// 0
    hessian: Field<f64, 36>,
}

impl Fields {
    fn new(of: &Bound<'_, PyAny>, rows: Range<usize>) -> PyResult<Self> {
        let rows = &rows;
        Ok(Self {
            dist: Field::new(of, "dist", rows)?,
            pos: Field::new(of, "pos", rows)?,
            frame: Field::new(of, "frame", rows)?,
            friction: Field::new(of, "friction", rows)?,
            solref: Field::new(of, "solref", rows)?,
            solimp: Field::new(of, "solimp", rows)?,
            dim: Field::new(of, "dim", rows)?,
            geom1: Field::new(of, "geom1", rows)?,
            geom2: Field::new(of, "geom2", rows)?,
            geom: Field::new(of, "geom", rows)?,
            no_flex: [
                Field::new(of, "flex", rows)?,
                Field::new(of, "elem", rows)?,
                Field::new(of, "vert", rows)?,
            ],
            efc_address: Field::new(of, "efc_address", rows)?,
            exclude: Field::new(of, "exclude", rows)?,
            numbers: [
                Field::new(of, "includemargin", rows)?,
                Field::new(of, "mu", rows)?,
                Field::new(of, "adhesion", rows)?,
            ],
            solreffriction: Field::new(of, "solreffriction", rows)?,
            surfacevel: Field::new(of, "surfacevel", rows)?,
            hessian: Field::new(of, "H", rows)?,
        })
    }

    fn set(&self, row: usize, found: &Found<'_>, geoms: [i32; 2], parameters: &Parameters, kind: usize) {
        let (a, b) = (found.point_a[row], found.point_b[row]);
        self.dist.set(row, [found.distance[row]]);
        self.pos.set(row, std::array::from_fn(|k| 0.5 * (a[k] + b[k])));
        self.frame.set(row, frame(found.normal[row]));
        self.friction.set(row, parameters.friction[kind]);
        self.solref.set(row, parameters.solref[kind]);
        self.solimp.set(row, parameters.solimp[kind]);
        self.dim.set(row, [parameters.condim[kind]]);
        self.geom1.set(row, [geoms[0]]);
        self.geom2.set(row, [geoms[1]]);
        self.geom.set(row, geoms);
        self.no_flex.iter().for_each(|field| field.set(row, [-1; 2]));
        self.efc_address.set(row, [-1]);
        self.exclude.set(row, [0]);
        self.numbers.iter().for_each(|field| field.set(row, [0.0]));
        self.solreffriction.set(row, [0.0; 2]);
        self.surfacevel.set(row, [0.0; 3]);
        self.hessian.set(row, [0.0; 36]);
    }
}

/// Rows of `W` numbers in memory of MuJoCo.
///
/// The fields of a row lie within each other's strides, which the borrows of the crate `numpy` take
/// for an overlap. So this has a pointer.
struct Field<T, const W: usize> {
    first: *mut u8,
    /// Bytes from row to row, and from number to number.
    strides: [isize; 2],
    rows: usize,
    /// Keeps the memory.
    _array: Py<PyAny>,
    numbers: PhantomData<T>,
}

// SAFETY: the pointer is to plain numbers, whose array lives as long as the field. Writing them
// without the interpreter's lock is what numpy does as well.
unsafe impl<T: Send, const W: usize> Sync for Field<T, W> {}

impl<T: Element + Copy, const W: usize> Field<T, W> {
    /// The rows `rows` of the field `name` of `data.contact`.
    fn new(of: &Bound<'_, PyAny>, name: &str, rows: &Range<usize>) -> PyResult<Self> {
        let name = format!("contact.{name}");
        let any = of.getattr(&name["contact.".len()..])?;
        let refused = |found: String| {
            let shape = if W == 1 { "(N,)".to_string() } else { format!("(N, {W})") };
            let dtype = numpy::dtype::<T>(of.py());
            argument(&name, found, &format!("a numpy array of {dtype} of shape {shape} to write to"))
        };
        let Ok(untyped) = any.cast::<PyUntypedArray>() else {
            return Err(refused(crate::errors::kind_of(&any)));
        };
        let shape = untyped.shape();
        let fits = if W == 1 { shape.len() == 1 } else { matches!(shape, [_, width] if *width == W) };
        if !fits {
            return Err(refused(format!("an array of shape {}", any.getattr("shape")?)));
        }
        let Ok(array) = any.cast::<PyArrayDyn<T>>() else {
            return Err(refused(format!("an array of {}", untyped.dtype())));
        };
        if array.try_readwrite().is_err() {
            return Err(refused("an array that cannot be written".into()));
        }
        if shape[0] < rows.end {
            let expected = format!("at least {}", rows.end);
            return Err(argument(&name, format!("{} rows", shape[0]), &expected));
        }
        let strides = [untyped.strides()[0], untyped.strides().get(1).copied().unwrap_or(0)];
        let start = rows.start as isize * strides[0];
        // SAFETY: the array has the row `rows.start`, or this is one past the last one.
        let first = unsafe { array.data().cast::<u8>().offset(start) };
        Ok(Self { first, strides, rows: rows.len(), _array: any.unbind(), numbers: PhantomData })
    }

    fn set(&self, row: usize, numbers: [T; W]) {
        assert!(row < self.rows, "the rows of all fields are those of the contacts");
        // SAFETY: `new` has checked that the array has this row, `W` numbers in it, and this type.
        // Nothing refers to its memory, and numpy may lay numbers out without alignment.
        unsafe {
            let at = self.first.offset(row as isize * self.strides[0]);
            if W == 1 || self.strides[1] == size_of::<T>() as isize {
                at.cast::<[T; W]>().write_unaligned(numbers);
            } else {
                for (k, number) in (0..).zip(numbers) {
                    at.offset(k * self.strides[1]).cast::<T>().write_unaligned(number);
                }
            }
        }
    }
}
