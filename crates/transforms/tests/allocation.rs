//! Looking up and setting a frame that is known allocate nothing, nor does a lookup that fails.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::hint::black_box;

use nalgebra::Isometry3;
use slate_transforms::{FrameTree, Limits};

/// Counts what this thread allocates.
struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

fn count() {
    // A thread that ends may allocate when its counter is gone.
    let _ = ALLOCATIONS.try_with(|count| count.set(count.get() + 1));
}

#[allow(unsafe_code, reason = "an allocator that counts")]
// SAFETY: everything is passed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: passed on.
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: passed on.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn the_allocator_counts() {
    let before = ALLOCATIONS.get();
    drop(black_box(Box::new(7)));
    assert_eq!(ALLOCATIONS.get(), before + 1);
}

#[test]
fn known_frames_allocate_nothing() {
    let mut frames = FrameTree::new(Limits { history: 16, ..Limits::default() });
    frames.set_fixed("base_link", "laser", Isometry3::identity()).unwrap();
    frames.set_fixed("house", "kitchen", Isometry3::identity()).unwrap();
    frames.set("odom", "base_link", 0, Isometry3::identity()).unwrap();
    let before = ALLOCATIONS.get();
    for step in 1..1000_u64 {
        let transform = Isometry3::translation(step as f64, 0.0, 0.0);
        frames.set("odom", "base_link", step * 10, transform).unwrap();
        // A late one goes between.
        frames.set("odom", "base_link", step * 10 - 5, transform).unwrap();
        frames.set_fixed("base_link", "laser", transform).unwrap();
        assert!(frames.lookup("odom", "laser", step * 10 - 2).is_ok());
        assert!(frames.lookup_latest("laser", "odom").is_ok());
        assert!(frames.lookup("odom", "laser", step * 10 + 2).is_err());
        assert!(frames.lookup("odom", "kitchen", step * 10).is_err());
        assert!(frames.lookup("odom", "camera", step * 10).is_err());
    }
    assert_eq!(ALLOCATIONS.get(), before);
}
