//! Forces as arrays.
use pyo3::prelude::*;
use tesdf::glam::DVec3;
use tesdf_sim::{ContactForce, JointForce};

use crate::contacts::Columns;

/// An object of `tesdf.ContactForces`.
pub fn of_contacts<'py>(py: Python<'py>, forces: &[ContactForce]) -> PyResult<Bound<'py, PyAny>> {
    let vectors = |of: fn(&ContactForce) -> DVec3| forces.iter().map(move |force| of(force).to_array());
    Columns::new(py)
        .add_rows("bodies", forces.iter().map(|force| force.bodies.map(|body| body as u32)))?
        .add_rows("points", vectors(|force| force.point))?
        .add_rows("normals", vectors(|force| force.normal))?
        .add("normal_forces", forces.iter().map(|force| force.normal_force))?
        .add_rows("frictions", vectors(|force| force.friction))?
        .add("torques", forces.iter().map(|force| force.torque))?
        .build("ContactForces")
}

/// An object of `tesdf.JointForces`.
pub fn of_joints<'py>(py: Python<'py>, forces: &[JointForce]) -> PyResult<Bound<'py, PyAny>> {
    Columns::new(py)
        .add_rows("forces", forces.iter().map(|joint| joint.force.to_array()))?
        .add_rows("torques", forces.iter().map(|joint| joint.torque.to_array()))?
        .add("motors", forces.iter().map(|joint| joint.motor))?
        .add("couplings", forces.iter().map(|joint| joint.coupling))?
        .build("JointForces")
}
