//! What the arguments of `Scene.add` and `Scene.update` say about instances.
use pyo3::prelude::*;
use tesdf::collide::{self, Groups, Instance, Pose};

use crate::errors::argument;
use crate::poses;

/// What the arguments of `add` and `update` say about rows of instances.
pub struct InstanceColumns {
    poses: Option<Vec<Pose>>,
    velocities: Option<Vec<collide::Velocity>>,
    scale: Option<Vec<f64>>,
    world: Option<Vec<u32>>,
    memberships: Option<Vec<u32>>,
    filter: Option<Vec<u32>>,
}

/// Arguments that have one value, or one for each instance.
pub struct PerInstance<'a, 'py> {
    pub scale: Option<&'a Bound<'py, PyAny>>,
    pub world: Option<&'a Bound<'py, PyAny>>,
    pub memberships: Option<&'a Bound<'py, PyAny>>,
    pub filter: Option<&'a Bound<'py, PyAny>>,
}

impl InstanceColumns {
    /// Converts the arguments for this number of rows.
    ///
    /// # Errors
    /// `ValueError` names the argument, and what was found and expected.
    pub fn new(
        rows: usize,
        poses: Option<Vec<Pose>>,
        velocities: Option<Vec<collide::Velocity>>,
        each: &PerInstance<'_, '_>,
    ) -> PyResult<Self> {
        let lengths =
            [("poses", poses.as_ref().map(Vec::len)), ("velocities", velocities.as_ref().map(Vec::len))];
        for (name, length) in lengths {
            if let Some(length) = length
                && length != rows
            {
                return Err(argument(
                    name,
                    format!("{length} rows"),
                    &format!("{rows}, one for each instance"),
                ));
            }
        }
        let words =
            |name, any: Option<&Bound<'_, PyAny>>| any.map(|any| poses::words(name, any, rows)).transpose();
        Ok(Self {
            poses,
            velocities,
            scale: each.scale.map(|any| poses::numbers("scale", any, rows)).transpose()?,
            world: words("world", each.world)?,
            memberships: words("memberships", each.memberships)?,
            filter: words("filter", each.filter)?,
        })
    }

    /// `instance` with what is given for `row`.
    pub fn row(&self, row: usize, instance: Instance) -> Instance {
        fn given<T: Copy>(column: &Option<Vec<T>>, row: usize, other: T) -> T {
            column.as_ref().map_or(other, |column| column[row])
        }
        let Groups { memberships, filter } = instance.groups;
        Instance {
            pose: given(&self.poses, row, instance.pose),
            velocity: given(&self.velocities, row, instance.velocity),
            scale: given(&self.scale, row, instance.scale),
            world: given(&self.world, row, instance.world),
            groups: Groups {
                memberships: given(&self.memberships, row, memberships),
                filter: given(&self.filter, row, filter),
            },
            ..instance
        }
    }
}
