//! Looking up and setting a frame that is known allocate nothing, nor does a lookup that fails.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::hint::black_box;

use allocation_counter::measure;
use nalgebra::Isometry3;
use slate_transforms::{FrameTree, Limits};

#[test]
fn the_allocator_counts() {
    assert_eq!(measure(|| drop(black_box(Box::new(7)))).count_total, 1);
}

#[test]
fn known_frames_allocate_nothing() {
    let mut frames = FrameTree::new(Limits { history: 16, ..Limits::default() });
    frames.set_fixed("base_link", "laser", Isometry3::identity()).unwrap();
    frames.set_fixed("house", "kitchen", Isometry3::identity()).unwrap();
    frames.set("odom", "base_link", 0, Isometry3::identity()).unwrap();
    let allocated = measure(|| {
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
    });
    assert_eq!(allocated.count_total, 0);
}
