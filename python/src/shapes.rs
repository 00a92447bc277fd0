//! Shapes of scenes: assets, and the classes of `tesdf.shapes`.
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyType;
use tesdf::collide::Shape;
use tesdf::glam::DVec3;

use crate::asset::Asset;
use crate::errors::{argument, kind_of};
use crate::kept_assets::asset_of;
use crate::mesh::is_mesh;

/// The classes of the simple shapes, in `tesdf.shapes`.
struct Classes<'a, 'py> {
    plane: &'a Bound<'py, PyType>,
    cuboid: &'a Bound<'py, PyType>,
    sphere: &'a Bound<'py, PyType>,
    capsule: &'a Bound<'py, PyType>,
    cylinder: &'a Bound<'py, PyType>,
}

fn classes(py: Python<'_>) -> PyResult<Classes<'_, '_>> {
    static CLASSES: [PyOnceLock<Py<PyType>>; 5] = [const { PyOnceLock::new() }; 5];
    let [plane, cuboid, sphere, capsule, cylinder] = &CLASSES;
    let module = "tesdf.shapes";
    Ok(Classes {
        plane: plane.import(py, module, "Plane")?,
        cuboid: cuboid.import(py, module, "Box")?,
        sphere: sphere.import(py, module, "Sphere")?,
        capsule: capsule.import(py, module, "Capsule")?,
        cylinder: cylinder.import(py, module, "Cylinder")?,
    })
}

/// Converts an asset, an object of `tesdf.shapes`, or a mesh, which is encoded once. The library
/// checks sizes.
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
    } else if any.is_instance(classes.cylinder)? {
        Ok(Shape::Cylinder { half_height: size("half_height")?, radius: size("radius")? })
    } else {
        encoded(name, any)
    }
}

/// The asset of a path or of a mesh in memory.
fn encoded(name: &str, any: &Bound<'_, PyAny>) -> PyResult<Shape> {
    if !is_mesh(any)? {
        let expected = "an Asset, Plane, Box, Sphere, Capsule or Cylinder, or a mesh: a path, (vertices, faces), or one of \
                        trimesh, Open3D or pyvista";
        return Err(argument(name, kind_of(any), expected));
    }
    Ok(asset_of(any)?.get().shared().into())
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
        Shape::Cylinder { half_height, radius } => classes.cylinder.call1((*half_height, *radius)),
    }
}
