//! Properties of every tree: composition, inverse, interpolation, and that it is a tree.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use slate_transforms::{FrameTree, Limits, SetError};

fn transform() -> impl Strategy<Value = Isometry3<f64>> {
    let number = || -10.0..10.0_f64;
    ((number(), number(), number()), (-3.0..3.0_f64, -3.0..3.0_f64, -3.0..3.0_f64)).prop_map(
        |((x, y, z), (a, b, c))| {
            Isometry3::from_parts(
                Translation3::new(x, y, z),
                UnitQuaternion::from_scaled_axis(Vector3::new(a, b, c)),
            )
        },
    )
}

fn near(a: &Isometry3<f64>, b: &Isometry3<f64>) -> bool {
    (a.translation.vector - b.translation.vector).norm() < 1e-9 && a.rotation.angle_to(&b.rotation) < 1e-7
}

/// The name of a frame of the tests.
fn name(index: usize) -> String {
    format!("frame_{index}")
}

proptest! {
    #[test]
    fn any_two_frames_compose_by_way_of_any_third(
        edges in prop::collection::vec((any::<prop::sample::Index>(), transform(), transform()), 1..12),
        picks in prop::array::uniform3(any::<prop::sample::Index>()),
        time in 0_u64..=1000,
    ) {
        let mut frames = FrameTree::default();
        for (child, (parent, first, last)) in edges.iter().enumerate() {
            let (parent, child) = (name(parent.index(child + 1)), name(child + 1));
            frames.set(&parent, &child, 0, *first).unwrap();
            frames.set(&parent, &child, 1000, *last).unwrap();
        }
        let [a, b, c] = picks.map(|pick| name(pick.index(edges.len() + 1)));
        let lookup = |target: &str, source: &str| frames.lookup(target, source, time).unwrap();
        prop_assert!(near(&lookup(&a, &c), &(lookup(&a, &b) * lookup(&b, &c))));
        prop_assert!(near(&lookup(&a, &b), &lookup(&b, &a).inverse()));
        prop_assert!(near(&lookup(&a, &a), &Isometry3::identity()));
    }

    #[test]
    fn interpolation_lies_between_its_samples(
        first in transform(), last in transform(), start in 0_u64..1000, length in 1_u64..1000, part in 0.0..=1.0_f64,
    ) {
        let mut frames = FrameTree::default();
        frames.set("odom", "base_link", start, first).unwrap();
        frames.set("odom", "base_link", start + length, last).unwrap();
        let time = start + (length as f64 * part) as u64;
        let part = (time - start) as f64 / length as f64;
        let between = frames.lookup("odom", "base_link", time).unwrap();
        let straight = first.translation.vector.lerp(&last.translation.vector, part);
        prop_assert!((between.translation.vector - straight).norm() < 1e-9);
        // Even speed along the shorter arc: the angles to both ends add up and stand in that relation.
        let (whole, done, left) = (
            first.rotation.angle_to(&last.rotation),
            first.rotation.angle_to(&between.rotation),
            between.rotation.angle_to(&last.rotation),
        );
        prop_assert!((done - whole * part).abs() < 1e-6, "{done} of {whole} at {part}");
        prop_assert!((done + left - whole).abs() < 1e-6);
        prop_assert!((between.rotation.norm() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn nearly_equal_rotations_interpolate_as_well(first in transform(), angle in 0.0..1e-2_f64, time in 0_u64..=1000) {
        let last = first * Isometry3::rotation(Vector3::x() * angle);
        let mut frames = FrameTree::default();
        frames.set("odom", "base_link", 0, first).unwrap();
        frames.set("odom", "base_link", 1000, last).unwrap();
        let between = frames.lookup("odom", "base_link", time).unwrap();
        let expected = first * Isometry3::rotation(Vector3::x() * (angle * time as f64 / 1000.0));
        let difference = between.rotation.coords - expected.rotation.coords;
        prop_assert!(difference.norm() < 1e-9, "{}", difference.norm());
    }

    /// Samples in any order, against a sorted map of all of them.
    #[test]
    fn the_history_keeps_the_newest(
        capacity in 1_usize..20,
        samples in prop::collection::vec((0_u64..100, -10.0..10.0_f64), 1..60),
    ) {
        let mut frames = FrameTree::new(Limits { history: capacity, ..Limits::default() });
        let mut model = BTreeMap::new();
        for (time, x) in samples {
            let is_full = model.len() == capacity;
            let is_late = is_full && model.keys().next().is_some_and(|oldest| time < *oldest);
            let result = frames.set("odom", "base_link", time, Isometry3::translation(x, 0.0, 0.0));
            prop_assert_eq!(matches!(result, Err(SetError::TooLate { .. })), is_late);
            if is_late {
                continue;
            }
            if model.insert(time, x).is_none() && is_full {
                model.pop_first();
            }
        }
        for (time, x) in &model {
            prop_assert_eq!(frames.lookup("odom", "base_link", *time).unwrap().translation.x, *x);
        }
        let times = Some((*model.keys().next().unwrap(), *model.keys().last().unwrap()));
        prop_assert_eq!(frames.edges().next().unwrap().times, times);
    }

    /// Frames are hung about at random; each keeps one parent, and going up always ends.
    #[test]
    fn it_is_always_a_tree(moves in prop::collection::vec((0_usize..6, 0_usize..6), 1..60)) {
        let mut frames = FrameTree::default();
        let mut parents: BTreeMap<String, String> = BTreeMap::new();
        for (parent, child) in moves {
            let (parent, child) = (name(parent), name(child));
            let mut above = Some(&parent);
            let mut is_cycle = false;
            while let Some(frame) = above {
                is_cycle |= *frame == child;
                above = parents.get(frame);
            }
            let result = frames.set_fixed(&parent, &child, Isometry3::identity());
            prop_assert_eq!(result.is_err(), is_cycle);
            if !is_cycle {
                parents.insert(child, parent);
            }
            let edges: BTreeMap<_, _> =
                frames.edges().map(|edge| (edge.child.to_owned(), edge.parent.to_owned())).collect();
            prop_assert_eq!(&edges, &parents);
        }
    }
}
