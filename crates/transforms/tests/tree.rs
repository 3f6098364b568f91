//! The frame tree through its public face.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use slate_interfaces::{Position, Transform};
use slate_transforms::{FrameTree, Limits, Placement, SetError, TransformError, stamped};

const MILLISECOND: u64 = 1_000_000;

fn shift(x: f64) -> Isometry3<f64> {
    Isometry3::translation(x, 0.0, 0.0)
}

fn turn(angle: f64) -> Isometry3<f64> {
    Isometry3::rotation(Vector3::z() * angle)
}

fn x(transform: Isometry3<f64>) -> f64 {
    transform.translation.x
}

/// `map -> odom -> base_link -> laser`, and `kitchen` beside them.
fn robot() -> FrameTree {
    let mut frames = FrameTree::default();
    frames.set_fixed("base_link", "laser", shift(0.25)).unwrap();
    frames.set_fixed("map", "odom", shift(10.0)).unwrap();
    for step in 0..10 {
        frames.set("odom", "base_link", step * 100 * MILLISECOND, shift(step as f64)).unwrap();
    }
    frames.set_fixed("house", "kitchen", shift(3.0)).unwrap();
    frames
}

#[test]
fn a_frame_is_found_in_any_other_of_its_tree() {
    let frames = robot();
    assert_eq!(x(frames.lookup("map", "laser", 500 * MILLISECOND).unwrap()), 15.25);
    assert_eq!(x(frames.lookup("laser", "map", 500 * MILLISECOND).unwrap()), -15.25);
    assert_eq!(x(frames.lookup("map", "laser", 550 * MILLISECOND).unwrap()), 15.75);
    assert_eq!(frames.lookup("odom", "odom", 0).unwrap(), Isometry3::identity());
    assert_eq!(x(frames.lookup_latest("map", "laser").unwrap()), 19.25);
    assert_eq!(frames.latest_common_time("map", "laser").unwrap(), Some(900 * MILLISECOND));
    assert_eq!(frames.latest_common_time("base_link", "laser").unwrap(), None);
}

#[test]
fn siblings_do_not_need_what_moves_above_them() {
    let mut frames = robot();
    frames.set_fixed("base_link", "camera", shift(-0.5)).unwrap();
    assert_eq!(x(frames.lookup("camera", "laser", 77_000 * MILLISECOND).unwrap()), 0.75);
}

#[test]
fn the_latest_common_time_is_that_of_the_slowest_edge() {
    let mut frames = FrameTree::default();
    frames.set("map", "odom", 100, shift(1.0)).unwrap();
    frames.set("map", "odom", 300, shift(3.0)).unwrap();
    frames.set("odom", "base_link", 200, shift(10.0)).unwrap();
    frames.set("odom", "base_link", 900, shift(20.0)).unwrap();
    assert_eq!(frames.latest_common_time("base_link", "map").unwrap(), Some(300));
    let expected = 3.0 + 10.0 + 10.0 / 7.0;
    assert!((x(frames.lookup_latest("map", "base_link").unwrap()) - expected).abs() < 1e-12);
    // One edge ended before the other began.
    frames.set("base_link", "arm", 1000, shift(0.0)).unwrap();
    let error = frames.lookup_latest("map", "arm").unwrap_err();
    assert_eq!(error.to_string(), "at 0.0000003 s: the oldest kept of `base_link` -> `arm` is 0.000001 s");
}

#[test]
fn errors_name_frames_and_times() {
    let frames = robot();
    let error =
        |target: &str, source: &str, time| frames.lookup(target, source, time).unwrap_err().to_string();
    assert_eq!(error("map", "lasr", 0), "there is no frame `lasr` yet");
    assert_eq!(
        error("map", "kitchen", 0),
        "`kitchen` is not connected to `map`: it is in the tree of `house`, and `map` in that of `map`"
    );
    assert_eq!(
        error("map", "laser", 1000 * MILLISECOND),
        "at 1 s: the newest of `odom` -> `base_link` is 0.9 s"
    );
    assert_eq!(
        frames.latest_common_time("laser", "house"),
        Err(TransformError::NotConnected {
            target: "laser".into(),
            source_frame: "house".into(),
            target_root: "map".into(),
            source_root: "house".into(),
        })
    );
    assert_eq!(frames.to_string(), "house\n  kitchen\nmap\n  odom\n    base_link\n      laser\n");
}

#[test]
fn the_nearest_holds_within_the_tolerance_and_not_beyond() {
    let mut frames = FrameTree::new(Limits { tolerance: 50, ..Limits::default() });
    frames.set("odom", "base_link", 1000, shift(1.0)).unwrap();
    frames.set("odom", "base_link", 2000, shift(2.0)).unwrap();
    let at = |time| frames.lookup("odom", "base_link", time).map(x);
    assert_eq!(at(2050), Ok(2.0));
    assert_eq!(at(950), Ok(1.0));
    assert!(matches!(at(2051), Err(TransformError::TooNew { time: 2051, newest: 2000, .. })));
    assert!(matches!(at(949), Err(TransformError::TooOld { time: 949, oldest: 1000, .. })));
}

#[test]
fn the_oldest_makes_room_for_the_newest() {
    let mut frames = FrameTree::new(Limits { history: 4, ..Limits::default() });
    for time in [10, 20, 30, 40, 50, 60] {
        frames.set("odom", "base_link", time, shift(time as f64)).unwrap();
    }
    assert_eq!(frames.edges().next().unwrap().times, Some((30, 60)));
    assert!(matches!(frames.lookup("odom", "base_link", 29), Err(TransformError::TooOld { .. })));
    // A late one finds its place, in the place of the oldest.
    assert_eq!(frames.set("odom", "base_link", 45, shift(100.0)), Ok(Placement::Same));
    assert_eq!(x(frames.lookup("odom", "base_link", 45).unwrap()), 100.0);
    assert_eq!(x(frames.lookup("odom", "base_link", 60).unwrap()), 60.0);
    assert_eq!(frames.edges().next().unwrap().times, Some((40, 60)));
    let error = frames.set("odom", "base_link", 39, shift(0.0)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "`odom` -> `base_link` at 0.000000039 s is too late: 0.00000004 s is known"
    );
    // The last word on one time counts.
    frames.set("odom", "base_link", 60, shift(7.0)).unwrap();
    assert_eq!(x(frames.lookup("odom", "base_link", 60).unwrap()), 7.0);
}

#[test]
fn a_frame_changes_its_parent_with_all_below_it() {
    let mut frames = FrameTree::default();
    assert_eq!(frames.set("table", "cup", 100, shift(1.0)), Ok(Placement::New));
    frames.set_fixed("cup", "handle", shift(0.5)).unwrap();
    frames.set_fixed("world", "table", shift(10.0)).unwrap();
    frames.set_fixed("world", "gripper", shift(20.0)).unwrap();
    assert_eq!(frames.set("gripper", "cup", 200, shift(0.0)), Ok(Placement::Changed));
    assert_eq!(x(frames.lookup("world", "handle", 200).unwrap()), 20.5);
    assert!(frames.lookup("world", "handle", 100).is_err(), "earlier places are forgotten");
    // What the table's camera saw before the grasp does not take the cup back.
    let straggler = frames.set("table", "cup", 150, shift(1.0));
    assert!(matches!(straggler, Err(SetError::TooLate { time: 150, known: 200, .. })));
    assert_eq!(frames.set("table", "cup", 300, shift(1.0)), Ok(Placement::Changed));
    // So it does with a frame that ceases to move.
    assert_eq!(frames.set_fixed("table", "cup", shift(2.0)), Ok(Placement::Changed));
    assert_eq!(frames.set_fixed("table", "cup", shift(3.0)), Ok(Placement::Same));
    assert_eq!(x(frames.lookup("world", "handle", 0).unwrap()), 13.5);
}

#[test]
fn mismatch_changes_nothing() {
    let mut frames = FrameTree::new(Limits { frames: 3, ..Limits::default() });
    frames.set_fixed("a", "b", shift(1.0)).unwrap();
    frames.set_fixed("b", "c", shift(1.0)).unwrap();
    let long = "x".repeat(65);
    let cases = [
        ("c", "a", "`c` can't be the parent of `a`, as it is below it"),
        ("a", "a", "`a` can't be its own parent"),
        ("a", "d", "no room for the frame `d`: the tree has 3 frames, which is its limit"),
        ("", "a", "`` is not a name of a frame: expected 1 to 64 bytes without `/`"),
        ("a", "/b", "`/b` is not a name of a frame: expected 1 to 64 bytes without `/`"),
    ];
    for (parent, child, expected) in cases {
        assert_eq!(frames.set_fixed(parent, child, shift(2.0)).unwrap_err().to_string(), expected);
        assert_eq!(frames.set(parent, child, 1, shift(2.0)).unwrap_err().to_string(), expected);
    }
    assert!(matches!(frames.set_fixed("a", &long, shift(0.0)), Err(SetError::Name { limit: 64, .. })));
    let broken = [
        shift(f64::NAN),
        shift(f64::INFINITY),
        Isometry3::from_parts(
            Translation3::identity(),
            UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(f64::NAN, 0.0, 0.0, 0.0)),
        ),
        Isometry3::from_parts(
            Translation3::identity(),
            UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(0.0, 0.0, 0.0, 0.0)),
        ),
    ];
    for transform in broken {
        assert!(matches!(frames.set_fixed("a", "b", transform), Err(SetError::NoTransform { .. })));
    }
    assert_eq!(frames.to_string(), "a\n  b\n    c\n");
    assert_eq!(x(frames.lookup("a", "c", 0).unwrap()), 2.0);
}

#[test]
fn a_detached_frame_is_the_root_of_its_own_tree() {
    let mut frames = robot();
    assert!(frames.detach("base_link"));
    assert!(!frames.detach("base_link"));
    assert!(!frames.detach("nothing"));
    assert!(matches!(frames.lookup("map", "laser", 0), Err(TransformError::NotConnected { .. })));
    assert_eq!(x(frames.lookup("base_link", "laser", 0).unwrap()), 0.25);
    frames.clear();
    assert_eq!(frames.frames().count(), 0);
    assert!(matches!(frames.lookup("map", "laser", 0), Err(TransformError::UnknownFrame { .. })));
}

#[test]
fn a_property_sets_a_frame() {
    let mut frames = FrameTree::default();
    let mut transform = stamped("odom", "base_link", 100, &(shift(1.0) * turn(0.5)));
    assert_eq!(frames.apply(&transform), Ok(Placement::New));
    let place = frames.lookup("odom", "base_link", 100).unwrap();
    assert!((place.rotation.angle() - 0.5).abs() < 1e-12 && x(place) == 1.0);
    transform.fixed = true.into();
    transform.translation = Position { x: 2.0, ..Position::default() };
    assert_eq!(frames.apply(&transform), Ok(Placement::Changed));
    assert_eq!(x(frames.lookup("odom", "base_link", 0).unwrap()), 2.0);
    // A transform of zeros has no rotation.
    let error = frames.apply(&Transform { parent: "a".into(), child: "b".into(), ..Transform::default() });
    assert_eq!(
        error.unwrap_err().to_string(),
        "`a` -> `b` is not a transform: its numbers must be finite and its quaternion's length 1, which is 0"
    );
}

#[test]
fn a_rotation_goes_the_shorter_way() {
    let mut frames = FrameTree::default();
    frames.set("odom", "base_link", 0, turn(3.0)).unwrap();
    frames.set("odom", "base_link", 100, turn(-3.0)).unwrap();
    let half = frames.lookup("odom", "base_link", 50).unwrap();
    assert!((half.rotation.angle() - std::f64::consts::PI).abs() < 1e-9);
    // Half a turn has no shorter way; either is right, and it is not a failure.
    frames.set("odom", "base_link", 100, turn(3.0 + std::f64::consts::PI)).unwrap();
    let half = frames.lookup("odom", "base_link", 50).unwrap();
    assert!((half.rotation.angle_to(&turn(3.0).rotation) - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
}
