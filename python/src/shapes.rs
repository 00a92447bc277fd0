//! Shapes of scenes: assets, and the classes of `tesdf.shapes`.
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyTuple, PyType};
use tesdf::collide::Shape;
use tesdf::glam::DVec3;

use crate::asset::Asset;
use crate::errors::{argument, kind_of};

/// The classes of the simple shapes, in `tesdf.shapes`.
struct Classes<'a, 'py> {
    plane: &'a Bound<'py, PyType>,
    cuboid: &'a Bound<'py, PyType>,
    sphere: &'a Bound<'py, PyType>,
    capsule: &'a Bound<'py, PyType>,
}

fn classes(py: Python<'_>) -> PyResult<Classes<'_, '_>> {
    static CLASSES: [PyOnceLock<Py<PyType>>; 4] = [const { PyOnceLock::new() }; 4];
    let [plane, cuboid, sphere, capsule] = &CLASSES;
    let module = "tesdf.shapes";
    Ok(Classes {
        plane: plane.import(py, module, "Plane")?,
        cuboid: cuboid.import(py, module, "Box")?,
        sphere: sphere.import(py, module, "Sphere")?,
        capsule: capsule.import(py, module, "Capsule")?,
    })
}

/// Converts an asset, an object of `tesdf.shapes`, or a mesh in memory, which is encoded. The
/// library checks sizes.
///
/// # Errors
/// `ValueError` names the argument and what was found; those of `tesdf.encode`.
pub fn shape(name: &str, any: &Bound<'_, PyAny>) -> PyResult<Shape> {
    if let Ok(asset) = any.cast::<Asset>() {
        return Ok(asset.get().shared().into());
    }
    let classes = classes(any.py())?;
    let size = |field: &str| -> PyResult<f64> {
        let size = any.getattr(field)?;
        size.extract().map_err(|_| argument(&format!("{name}.{field}"), kind_of(&size), "a number"))
    };
    if any.is_instance(classes.plane)? {
        Ok(Shape::Plane)
    } else if any.is_instance(classes.cuboid)? {
        let half = any.getattr("half_extents")?;
        let half = half.extract::<[f64; 3]>().map_err(|_| {
            argument(&format!("{name}.half_extents"), kind_of(&half), "three numbers, along x, y and z")
        })?;
        Ok(Shape::Box { half_extents: DVec3::from_array(half) })
    } else if any.is_instance(classes.sphere)? {
        Ok(Shape::Sphere { radius: size("radius")? })
    } else if any.is_instance(classes.capsule)? {
        Ok(Shape::Capsule { half_height: size("half_height")?, radius: size("radius")? })
    } else {
        encoded(name, any)
    }
}

/// The asset of a pair (vertices, faces), or of an object that has both.
fn encoded(name: &str, any: &Bound<'_, PyAny>) -> PyResult<Shape> {
    let is_mesh = any.hasattr("vertices")? && any.hasattr("faces")?;
    if !is_mesh && any.cast::<PyTuple>().map_or(true, |pair| pair.len() != 2) {
        let expected = "an Asset, Plane, Box, Sphere or Capsule, or a mesh: (vertices, faces), or an object that has \
                        both";
        return Err(argument(name, kind_of(any), expected));
    }
    let asset = any.py().import("tesdf._native")?.call_method1("encode", (any, "fast"))?;
    Ok(asset.cast::<Asset>()?.get().shared().into())
}

/// The Python object of a shape. An asset is shared, not copied.
pub fn object<'py>(py: Python<'py>, shape: &Shape) -> PyResult<Bound<'py, PyAny>> {
    let classes = classes(py)?;
    match shape {
        Shape::Mesh(asset) => Ok(Bound::new(py, Asset::of(asset.clone()))?.into_any()),
        Shape::Plane => classes.plane.call0(),
        Shape::Box { half_extents: half } => classes.cuboid.call1(((half.x, half.y, half.z),)),
        Shape::Sphere { radius } => classes.sphere.call1((*radius,)),
        Shape::Capsule { half_height, radius } => classes.capsule.call1((*half_height, *radius)),
    }
}
