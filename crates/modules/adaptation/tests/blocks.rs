//! The blocks one by one.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use slate::interfaces::{Echo, Odometry, Pose2, SonarScan};
use slate::mapek::{AnalyzeBlock, MonitorBlock, PlanBlock, Planned};
use slate::module::testing::Fixture;
use slate::prelude::*;
use slate_adaptation::alternatives::{Alternative, Alternatives};
use slate_adaptation::condition::{Condition, ReportCondition, SensorCondition};
use slate_adaptation::context_subsystem::{ContextAdvice, ContextSubsystem, TerrainReading};
use slate_adaptation::planner::AdaptationPlanner;
use slate_adaptation::range_health::{RangeHealthMonitor, SensorHealth};

const CYCLE: u64 = 20_000_000;

fn scan(ranges: &[f64], heard: bool) -> SonarScan {
    let echo = |range: &f64| Echo { range: *range, heard: heard.into() };
    let echoes: Vec<_> = ranges.iter().map(echo).collect();
    SonarScan { range_max: 5.0, echoes: Sequence::new(&echoes), ..SonarScan::default() }
}

/// A robot that is at `x`.
fn at(x: f64) -> Odometry {
    Odometry { pose: Pose2 { x, y: 0.0, theta: 0.0 }, ..Odometry::default() }
}

/// A monitor, and what it says when the robot goes a centimeter in each cycle and measures what `measured` says.
fn health(cycles: u32, measured: impl Fn(u32) -> Option<SonarScan>) -> SensorHealth {
    let mut monitor = Fixture::<MonitorBlock<RangeHealthMonitor>>::new();
    for cycle in 0..cycles {
        monitor.set("odometry", at(0.01 * f64::from(cycle)));
        if let Some(scan) = measured(cycle) {
            monitor.set("ranges", scan);
        }
        monitor.tick();
        monitor.advance(CYCLE);
    }
    monitor.output("percept").unwrap()
}

#[test]
fn a_sensor_that_measures_is_well() {
    let health = health(10, |cycle| Some(scan(&[1.0 - 0.01 * f64::from(cycle), 2.0], true)));
    assert_eq!(health, SensorHealth { age: 0.0, invalid: 0.0, unchanged: 0.0 });
}

#[test]
fn travel_without_changed_reading_is_reported() {
    let same = health(10, |_| Some(scan(&[1.0, 2.0], true)));
    assert!((same.unchanged - 0.09).abs() < 1e-9, "{same:?}");
    let again = health(10, |cycle| Some(scan(&[if cycle < 5 { 1.0 } else { 1.1 }, 2.0], true)));
    assert!((again.unchanged - 0.04).abs() < 1e-9, "{again:?}");
}

#[test]
fn ring_without_echoes_is_not_frozen() {
    assert_eq!(health(10, |_| Some(scan(&[5.0, 5.0], false))).unchanged, 0.0);
}

#[test]
fn between_two_measurements_nothing_is_the_same() {
    let health = health(10, |cycle| (cycle == 0).then(|| scan(&[1.0, 2.0], true)));
    assert_eq!(health.unchanged, 0.0);
    assert!((health.age - 0.18).abs() < 1e-9, "{health:?}");
}

#[test]
fn share_of_invalid_ranges_is_reported() {
    let health = health(2, |_| Some(scan(&[1.0, f64::NAN, f64::INFINITY, 2.0], true)));
    assert_eq!(health.invalid, 0.5);
    let nothing = |_| Some(scan(&[], false));
    assert_eq!(self::health(2, nothing).invalid, 1.0, "who tells nothing at all");
    assert_eq!(self::health(2, |_| None).invalid, 0.0, "who has not begun is late, and nothing else");
}

/// Reported conditions for a sequence of sensor faults with their lengths in cycles.
fn told(healths: &[(u32, SensorHealth)]) -> Vec<(u32, Condition)> {
    let mut analyze = Fixture::<AnalyzeBlock<ReportCondition>>::new();
    let (mut told, mut change, mut cycle) = (Vec::new(), 0, 0);
    for (cycles, health) in healths {
        for _ in 0..*cycles {
            analyze.set("health", *health);
            analyze.tick();
            analyze.advance(CYCLE);
            if let Some(news) =
                analyze.output::<SensorCondition>("change").filter(|news| news.change > change)
            {
                assert_eq!(news.change, change + 1);
                change = news.change;
                told.push((cycle, news.condition));
            }
            cycle += 1;
        }
    }
    told
}

const WELL: SensorHealth = SensorHealth { age: 0.0, invalid: 0.0, unchanged: 0.0 };

#[test]
fn failure_is_reported_at_once_and_recovery_after_two_seconds() {
    for (health, condition) in [
        (SensorHealth { age: 0.2, ..WELL }, Condition::LATE),
        (SensorHealth { age: 1.1, ..WELL }, Condition::SILENT),
        (SensorHealth { invalid: 0.5, ..WELL }, Condition::INVALID),
        (SensorHealth { unchanged: 0.04, ..WELL }, Condition::FROZEN),
    ] {
        let expected = [(0, Condition::HEALTHY), (10, condition), (120, Condition::HEALTHY)];
        assert_eq!(told(&[(10, WELL), (10, health), (200, WELL)]), expected);
    }
}

#[test]
fn short_recovery_does_not_count() {
    let late = SensorHealth { age: 0.2, ..WELL };
    let to_and_fro = [(10, WELL), (10, late), (50, WELL), (10, late), (50, WELL), (10, late)];
    assert_eq!(told(&to_and_fro), [(0, Condition::HEALTHY), (10, Condition::LATE)]);
}

#[test]
fn fault_of_sensor_may_change() {
    let late = SensorHealth { age: 0.2, ..WELL };
    let silent = SensorHealth { age: 1.1, ..WELL };
    let expected = [(0, Condition::HEALTHY), (1, Condition::LATE), (2, Condition::SILENT)];
    assert_eq!(told(&[(1, WELL), (1, late), (1, silent), (1, late)]), expected);
}

/// A planner that knows three alternatives.
fn planner() -> Fixture<PlanBlock<AdaptationPlanner>> {
    let mut planner = Fixture::new();
    let alternative = |name: &str| Alternative { name: Text::new(name), ..Alternative::default() };
    let list = ["sonar", "laser", "stand"].map(alternative);
    planner.set("alternatives", Alternatives { list: Sequence::new(&list) });
    planner
}

/// The alternatives that are planned after that news of a sensor.
fn plans(
    planner: &mut Fixture<PlanBlock<AdaptationPlanner>>,
    sensor: &str,
    condition: Condition,
) -> Vec<f64> {
    planner.push(sensor, SensorCondition { change: 1, condition });
    planner.tick();
    planner.advance(CYCLE);
    let sent = planner.sent::<Planned>("plan");
    sent.iter().map(|planned| planned.action.arguments[0]).collect()
}

#[test]
fn the_best_alternative_with_a_healthy_sensor_is_chosen_once() {
    let mut planner = planner();
    let news = [
        ("first", Condition::HEALTHY, &[][..]),
        ("second", Condition::HEALTHY, &[]),
        ("first", Condition::LATE, &[1.0]),
        ("first", Condition::SILENT, &[]),
        ("second", Condition::FROZEN, &[2.0]),
        ("first", Condition::HEALTHY, &[0.0]),
        ("second", Condition::HEALTHY, &[]),
    ];
    for (sensor, condition, expected) in news {
        assert_eq!(plans(&mut planner, sensor, condition), expected, "{sensor} is {condition:?}");
    }
}

#[test]
fn an_alternative_is_the_file_and_its_own_changes() {
    let changes = |list: &[&str]| {
        let list: Vec<Text<124>> = list.iter().map(|change| Text::new(change)).collect();
        Alternative { changes: Sequence::new(&list), ..Alternative::default() }
    };
    let alternatives = Alternatives {
        list: Sequence::new(&[changes(&[]), changes(&["a.b=1", "c=\"x=y\""]), changes(&["a.b=2"])]),
    };
    let asked = |number| alternatives.changes(number).collect::<Vec<_>>();
    assert_eq!(asked(0), ["a.b", "c", "a.b"]);
    assert_eq!(asked(1), ["a.b", "c", "a.b", "a.b=1", "c=\"x=y\""]);
    assert_eq!(asked(2), ["a.b", "c", "a.b", "a.b=2"]);
}

#[test]
fn a_context_slows_a_robot_on_rough_ground_and_tells_the_blur() {
    let mut context = Fixture::<ContextSubsystem>::new();
    let mut advice = |linear: f64, roughness: f64, seconds: u32| {
        let mut advice = ContextAdvice::default();
        for _ in 0..20 * seconds {
            context.set("actual_speed", Twist2 { linear, angular: 1.0 });
            context.set("terrain", TerrainReading { roughness });
            context.advance(50_000_000);
            context.tick();
            advice = context.output("advice").unwrap();
        }
        advice
    };
    let smooth = advice(0.5, 0.0, 3);
    assert_eq!(smooth.max_linear_velocity, 0.5);
    // 10 ms at 1 rad/s, and at 0.5 m/s before what is 2 m away, with 277 pixels a radian: 3.5 pixels.
    assert_eq!(smooth.deblur_length, 3.5);
    let rough = advice(0.2, 1.0, 6);
    assert!(rough.max_linear_velocity < 0.26 && rough.roughness > 0.9, "{rough:?}");
    let halted = advice(0.0, f64::NAN, 1);
    assert!(halted.max_linear_velocity < 0.26, "no number changes nothing: {halted:?}");
}
