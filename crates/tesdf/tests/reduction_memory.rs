//! The bytes that a detection reports for a reduction are those that it holds.
#[path = "it/support/mod.rs"]
mod support;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use support::bodies::body;
use tesdf::collide::{
    CollideOptions, ContactsPer, FaceOptions, Instance, Mode, Pose, Reduction, Scene, detect, reduce_pairs,
};
use tesdf::glam::DVec3;

/// Bytes that the program holds, and the largest value so far.
static HELD: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

/// An allocator that counts bytes.
struct Counting;

// SAFETY: every call is passed on to `System` unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let held = HELD.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        MOST.fetch_max(held, Ordering::Relaxed);
        // SAFETY: the caller's guarantees are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's guarantees are passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A torus against itself, a little aside. The number of contacts is so large that few of them are
/// candidates.
#[test]
fn the_reported_bytes_are_those_held() {
    let body = body("torus_quads");
    let (torus, diagonal) = (body.asset.clone(), body.diagonal());
    let mut scene = Scene::new();
    let shape = scene.add_shape(torus).expect("fits");
    for pose in [Pose::IDENTITY, Pose::at(1e-3 * diagonal * DVec3::ONE)] {
        scene.add(Instance::new(shape, pose)).expect("fits");
    }
    let all = CollideOptions {
        contact_distance: 0.3 * diagonal,
        ..CollideOptions::with_mode(Mode::Face {
            iterations: 1,
            faces: FaceOptions { contacts_per: ContactsPer::Cell, ..FaceOptions::default() },
        })
    };
    for n in [16, 1000] {
        let reduction = Reduction::PerPair(n);
        let unreduced = detect(&scene, &all).expect("detects");
        let reduced = detect(&scene, &CollideOptions { reduction, ..all }).expect("detects");
        let reported = reduced.statistics.bytes - unreduced.statistics.bytes;
        let contacts = unreduced.into_vec();
        assert!(contacts.len() > 2048, "{}", contacts.len());
        let before = HELD.load(Ordering::Relaxed);
        MOST.store(before, Ordering::Relaxed);
        let (kept, _) = reduce_pairs(contacts, reduction);
        assert_eq!(kept, reduced.into_vec());
        let held = MOST.load(Ordering::Relaxed) - before;
        assert!(held.abs_diff(reported) * 20 <= held, "{held} bytes held, {reported} reported");
    }
}
