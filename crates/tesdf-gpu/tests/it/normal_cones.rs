//! Normals of contacts that are read from the device are in the normal cones of both bodies.
use crate::compare::{ROUNDING, found};
use crate::support::blocks::edges_are_pushed_along_the_normal_of_the_floor;
use tesdf::collide::{CollideOptions, Scene};
use tesdf_gpu::DetectorOptions;

#[test]
fn edges_are_pushed_along_the_normal_of_the_floor_in_each_mode() {
    let detect =
        |scene: &Scene, options: &CollideOptions| found(scene, options, DetectorOptions::default()).0;
    // The diagonal of the floor is 3.
    edges_are_pushed_along_the_normal_of_the_floor(&detect, [3.0 * ROUNDING; 2]);
}
