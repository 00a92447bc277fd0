//! The hull of kept wrenches.
use cubecl::prelude::*;
use tesdf::collide::internal;

use super::{device, read, upload};
use crate::kernels::geometry::vector::v3;
use crate::kernels::report::hull::empty_hull;
use crate::kernels::report::wrench::{Residual, Wrench};

#[cube]
fn read_wrench(numbers: &[f32], at: u32) -> Wrench {
    let k = (6u32 * at) as usize;
    Wrench {
        force: v3(numbers[k], numbers[k + 1], numbers[k + 2]),
        torque: v3(numbers[k + 3], numbers[k + 4], numbers[k + 5]),
    }
}

/// Adds all vertices to a hull, and shortens the residual of a target per thread in `rounds`
/// rounds.
#[cube(launch)]
fn shorten(vertices: &[f32], count: u32, targets: &[f32], found: &mut [f32], rounds: u32) {
    let mut hull = empty_hull();
    let mut kept = 0u32;
    while kept < count {
        if UNIT_POS == 0u32 {
            hull.add(kept, read_wrench(vertices, kept));
        }
        sync_cube();
        kept += 1u32;
    }
    let w = read_wrench(targets, UNIT_POS);
    let to_newest = w - hull.newest();
    let mut x = Residual { wrench: to_newest, rounding: 0.0f32 };
    let mut round = 0u32;
    while round < rounds {
        x = hull.shortened(x, w, to_newest, count);
        round += 1u32;
    }
    let at = (2u32 * UNIT_POS) as usize;
    found[at] = x.wrench.dot(x.wrench).sqrt();
    found[at + 1] = x.rounding;
}

const TARGETS: usize = 64;

/// Residuals are upper bounds of the distances to the hull, and close to them: one vertex,
/// coincident vertices, vertices on a line or plane, vertices around the target, and more vertices
/// than a block holds.
#[test]
fn residuals_approach_the_distance_to_the_hull_from_above() {
    let mut random = fastrand::Rng::with_seed(4);
    let device = device();
    let mut worst = 0.0f64;
    for case in 0..60usize {
        let count = [1, 2, 3, 7, 8, 9, 40, 64][case % 8];
        let rank = [6, 1, 2, 3, 5, 6][case % 6];
        let mut wrench = |size: f32| -> [f32; 6] {
            std::array::from_fn(|k| if k < rank { size * (random.f32() - 0.5) } else { 0.25 })
        };
        let mut vertices: Vec<[f32; 6]> = (0..count).map(|_| wrench(2.0)).collect();
        if case % 5 == 0 {
            // Each vertex twice.
            (1..count).step_by(2).for_each(|k| vertices[k] = vertices[k - 1]);
        }
        let mut targets: Vec<[f32; 6]> = (0..TARGETS).map(|_| wrench(3.0)).collect();
        targets[0] = vertices[0];
        targets[1] = vertices[count - 1];
        let buffers = [
            upload(&device, vertices.as_flattened()),
            upload(&device, targets.as_flattened()),
            upload(&device, &[0.0f32; 2 * TARGETS]),
        ];
        shorten::launch(
            device.client(),
            CubeCount::Static(1, 1, 1),
            CubeDim::new_1d(TARGETS as u32),
            buffers[0].words(),
            count as u32,
            buffers[1].words(),
            buffers[2].words(),
            64,
        );
        let found: Vec<[f32; 2]> = read(&device, &buffers[2], TARGETS);
        let hull: Vec<internal::Wrench> = vertices.iter().map(|v| v.map(f64::from)).collect();
        for (target, [length, rounding]) in targets.iter().zip(found) {
            let nearest = internal::residual(&hull, &target.map(f64::from));
            let distance = nearest.iter().map(|x| x * x).sum::<f64>().sqrt();
            let (length, rounding) = (f64::from(length), f64::from(rounding));
            assert!(length + rounding + 1e-6 >= distance, "{length} of {distance}, {count} vertices");
            worst = worst.max(length - 1.05 * distance);
        }
    }
    assert!(worst < 0.02, "a residual is {worst} above the distance");
}
