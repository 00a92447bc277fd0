//! Number of allocations of a detection between simple shapes.
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use tesdf::collide::{CollideOptions, ContactsPer, Instance, Mode, Pose, Scene, Shape, detect};
use tesdf::glam::{DQuat, DVec3};

thread_local! {
    /// Number of allocations of this thread.
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

/// An allocator that counts.
struct Counting;

// SAFETY: every call is passed on to `System` unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller's guarantees are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // SAFETY: the caller's guarantees are passed on.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's guarantees are passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Allocations and contacts of a detection between a shape and a plane, after the first one. A
/// detection of so few faces runs on the calling thread.
fn on_plane(shape: Shape, pose: Pose) -> (usize, usize) {
    let mut scene = Scene::new();
    for (shape, pose) in [(Shape::Plane, Pose::IDENTITY), (shape, pose)] {
        let shape = scene.add_shape(shape).expect("valid sizes");
        scene.add(Instance::new(shape, pose)).expect("a valid pose");
    }
    let options = CollideOptions {
        contact_distance: 0.01,
        ..CollideOptions::with_mode(Mode::exact().per(ContactsPer::Minimum))
    };
    detect(&scene, &options).expect("detects");
    let before = ALLOCATIONS.get();
    let contacts = detect(&scene, &options).expect("detects");
    (ALLOCATIONS.get() - before, contacts.len())
}

/// Lists of pairs, of candidates and of contacts are made, and grow. A box has twelve faces and some
/// 20 contacts before those that are alike become one.
#[test]
fn faces_and_contacts_need_no_allocation_of_their_own() {
    let flat = DQuat::from_rotation_y(0.25 * std::f64::consts::TAU);
    let at = |height: f64, rotation: DQuat| Pose { translation: DVec3::new(0.3, 0.2, height), rotation };
    let half_extents = DVec3::new(1.0, 0.7, 0.5);
    let (sphere, of_sphere) = on_plane(Shape::Sphere { radius: 0.5 }, at(0.5, DQuat::IDENTITY));
    let (capsule, of_capsule) = on_plane(Shape::Capsule { half_height: 1.0, radius: 0.5 }, at(0.5, flat));
    let (of_box, contacts) = on_plane(Shape::Box { half_extents }, at(0.5, DQuat::IDENTITY));
    assert!(of_sphere == 1 && of_capsule >= 2 && contacts >= 4, "{of_sphere} {of_capsule} {contacts}");
    assert!(sphere <= 31 && capsule <= 32 && of_box <= 31, "{sphere} {capsule} {of_box}");
}
