//! Conditions of a robot on wheels.

use slate_executive::conditions::{ConditionValues, KnownConditions};
use slate_executive::wheeled_conditions::WheeledConditions;
use slate_plugin::interfaces::{Echo, Orientation, Position, SonarScan};
use slate_plugin::mapek::AnalyzeBlock;
use slate_plugin::module::Sequence;
use slate_plugin::module::testing::Fixture;

type Analyzing = Fixture<AnalyzeBlock<WheeledConditions>>;

/// Reports of a scan with an echo at that range, if it changes something.
fn scan(analyze: &mut Analyzing, range: f64) -> Option<(Option<bool>, Option<bool>)> {
    let echoes = Sequence::new(&[Echo { range, heard: true.into() }]);
    analyze.set("range", SonarScan { range_max: 5.0, echoes, ..SonarScan::default() });
    analyze.tick();
    let mut known = KnownConditions::default();
    known.update(&analyze.output::<ConditionValues>("change")?).unwrap();
    Some((known.get("obstacle"), known.get("localized")))
}

#[test]
fn an_obstacle_is_reported_after_scans_that_agree() {
    let mut analyze = Analyzing::new();
    assert_eq!(scan(&mut analyze, 2.0), Some((Some(false), Some(false))));
    assert_eq!(scan(&mut analyze, 0.3), None);
    assert_eq!(scan(&mut analyze, 2.0), None);
    assert_eq!(
        [0.3, 0.3, 0.3].map(|range| scan(&mut analyze, range)).last(),
        Some(&Some((Some(true), Some(false))))
    );
    // Hysteresis: farther than what is near is not yet far.
    assert_eq!([0.7; 4].map(|range| scan(&mut analyze, range)), [None; 4]);
    assert_eq!([1.0; 3].map(|range| scan(&mut analyze, range))[2], Some((Some(false), Some(false))));
}

#[test]
fn a_robot_is_localized_once_position_and_heading_are_known() {
    let mut analyze = Analyzing::new();
    scan(&mut analyze, 2.0);
    analyze.set("position", Position::default());
    assert_eq!(scan(&mut analyze, 2.0), None);
    analyze.set("orientation", Orientation::default());
    assert_eq!(scan(&mut analyze, 2.0), Some((Some(false), Some(true))));
}
