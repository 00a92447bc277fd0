//! Contacts in the frame of the world.
use cubecl::prelude::*;

use crate::kernels::geometry::vector::{Row, V3};
use crate::kernels::report::contact::Contacts;
use crate::kernels::scene::pose::pose;

/// Contacts in the frame and unit of the world, in `f32`. A vector takes three numbers.
#[derive(CubeType, CubeLaunch)]
pub struct WorldContacts {
    pub points_a: Box<[f32]>,
    pub points_b: Box<[f32]>,
    pub normals: Box<[f32]>,
    pub distances: Box<[f32]>,
    /// The ids of both instances of each contact.
    pub instances: Box<[u32]>,
}

#[cube]
fn put(to: &mut [f32], contact: usize, v: V3) {
    to[3 * contact] = v.x;
    to[3 * contact + 1] = v.y;
    to[3 * contact + 2] = v.z;
}

/// Writes one contact per thread, in the given order. `poses` are those of the instances, and `ids`
/// their ids.
#[cube(launch, create_dummy_kernel)]
pub fn to_world(
    contacts: &Contacts,
    order: &[u32],
    poses: &[Row],
    ids: &[u32],
    out: &mut WorldContacts,
    count: u32,
) {
    let at = ABSOLUTE_POS;
    if at < count as usize {
        let contact = order[at];
        let both = contacts.instances(contact);
        let field = pose(poses, both.b);
        put(&mut out.points_a, at, field.to_world(contacts.point(contact)));
        put(&mut out.points_b, at, field.to_world(contacts.closest(contact)));
        put(&mut out.normals, at, field.rotation.rotate(contacts.gradient(contact)));
        out.distances[at] = contacts.distance(contact) * field.unit;
        out.instances[2 * at] = ids[both.a as usize];
        out.instances[2 * at + 1] = ids[both.b as usize];
    }
}
