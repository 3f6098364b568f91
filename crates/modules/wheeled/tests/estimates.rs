//! Analyzes of sensors that err: they are exact when the sensors are, and cope when they are not.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate::interfaces::{
    Echo, Odometry, Orientation, Point2, Pose2, PoseEstimate, Position, SensorAccuracy, Sighting, Sightings,
    SonarPlacement, SonarScan, Twist2,
};
use slate::mapek::{AnalyzeBlock, KnowledgeBlock, RobotModel};
use slate::module::testing::Fixture;
use slate::module::{Random, Sequence, Text, math};
use slate_wheeled::analyzes::{PassPosition, PassRange, Surroundings};
use slate_wheeled::estimate_pose::EstimatePose;
use slate_wheeled::knowledge::{WheeledKnowledge, WheeledKnowledgeParams, WheeledModel};
use slate_wheeled::locate_robot::{LocateRobot, Located};
use slate_wheeled::track_filter::TrackFilter;

/// Errors of a real robot's sensors.
const REAL: SensorAccuracy = SensorAccuracy {
    position_stddev: 0.1,
    orientation_stddev: 0.0524,
    odometry_translation_stddev: 0.01,
    odometry_rotation_stddev: 0.04,
    sonar_outliers: 0.015,
    sighting_range_stddev: 0.03,
    sighting_range_relative_stddev: 0.01,
    sighting_bearing_stddev: 0.02,
};

fn model(pose: Pose2, accuracy: SensorAccuracy) -> WheeledModel {
    let robot = RobotModel { pose, ..RobotModel::default() };
    WheeledModel { robot, accuracy, ..WheeledModel::default() }
}

/// A robot on a circle of 1 m at 0.3 m/s, whose odometry turns too far.
fn on_circle(time: f64, turn_error: f64) -> Pose2 {
    let theta = 0.3 * time * (1.0 + turn_error);
    Pose2 {
        x: math::sin(theta) / (1.0 + turn_error),
        y: (1.0 - math::cos(theta)) / (1.0 + turn_error),
        theta,
    }
}

/// Root of the mean squared error of x and y, and of the heading, over a minute; of the estimate and of the measurements.
fn errors_of_estimate(seed: u64) -> [f64; 4] {
    let mut random = Random::new(seed, "estimates");
    let mut analyze = Fixture::<AnalyzeBlock<EstimatePose>>::new();
    analyze.set("robot", model(Pose2::default(), REAL));
    let (mut sums, mut estimates, mut fixes) = ([0.0; 4], 0.0, 0.0);
    for cycle in 0..3000_u32 {
        let time = f64::from(cycle) * 0.02;
        let truth = on_circle(time, 0.0);
        analyze.advance(20_000_000);
        let pose = on_circle(time, 0.03);
        analyze.set(
            "odometry",
            Odometry { pose: Pose2 { theta: math::wrap_angle(pose.theta), ..pose }, twist: Twist2::ZERO },
        );
        let square = |error: f64| error * error;
        if cycle % 10 == 0 && random.unit() > 0.1 {
            let (x, y) = (truth.x + 0.1 * random.normal(), truth.y + 0.1 * random.normal());
            let theta = math::wrap_angle(truth.theta + 0.0524 * random.normal());
            analyze.set("position", Position { x, y, z: 0.0 });
            analyze.set("orientation", Orientation { theta });
            sums[2] += square(x - truth.x) + square(y - truth.y);
            sums[3] += square(math::angle_between(truth.theta, theta));
            fixes += 1.0;
        }
        analyze.tick();
        // It needs some measurements to begin with.
        if let Some(PoseEstimate { pose, .. }) = analyze.output("estimate").filter(|_| time > 5.0) {
            sums[0] += square(pose.x - truth.x) + square(pose.y - truth.y);
            sums[1] += square(math::angle_between(truth.theta, pose.theta));
            estimates += 1.0;
        }
    }
    assert!(estimates > 2700.0, "an estimate in each cycle: {estimates}");
    [sums[0] / estimates, sums[1] / estimates, sums[2] / fixes, sums[3] / fixes].map(f64::sqrt)
}

#[test]
fn the_estimate_is_better_than_what_is_measured() {
    for seed in 0..10 {
        let [position, heading, fixes, compass] = errors_of_estimate(seed);
        assert!(position < 0.45 * fixes, "seed {seed}: {position} m, measured {fixes} m");
        assert!(heading < 0.7 * compass, "seed {seed}: {heading} rad, measured {compass} rad");
    }
}

#[test]
fn the_estimate_of_exact_sensors_is_the_measurement_bit_for_bit() {
    let mut analyze = Fixture::<AnalyzeBlock<EstimatePose>>::new();
    analyze.set("robot", model(Pose2::default(), SensorAccuracy::default()));
    for cycle in 0..500_u32 {
        let Pose2 { x, y, theta } = on_circle(f64::from(cycle) * 0.1, 0.0);
        let theta = math::wrap_angle(theta);
        analyze.advance(20_000_000);
        analyze.set("position", Position { x, y, z: 0.0 });
        analyze.set("orientation", Orientation { theta });
        let pose = on_circle(f64::from(cycle) * 0.1, 0.05);
        analyze.set("odometry", Odometry { pose, twist: Twist2::ZERO });
        analyze.tick();
        let estimate = analyze.output::<PoseEstimate>("estimate").unwrap();
        let bits = |pose: Pose2| [pose.x.to_bits(), pose.y.to_bits(), pose.theta.to_bits()];
        assert_eq!(bits(estimate.pose), bits(Pose2 { x, y, theta }));
    }
}

#[test]
fn a_pose_without_measurements_is_unknown_after_a_while() {
    let mut analyze = Fixture::<AnalyzeBlock<EstimatePose>>::new();
    analyze.set("robot", model(Pose2::default(), REAL));
    analyze.set("position", Position::default());
    analyze.set("orientation", Orientation::default());
    analyze.tick();
    let mut estimates = 0;
    for cycle in 1..=250_u32 {
        analyze.advance(20_000_000);
        let pose = Pose2 { x: 0.001 * f64::from(cycle), ..Pose2::default() };
        analyze.set("odometry", Odometry { pose, twist: Twist2::ZERO });
        analyze.tick();
        let estimate = analyze.output::<PoseEstimate>("estimate").unwrap();
        estimates += u32::from(estimate.pose.x.is_finite());
    }
    assert!((99..=101).contains(&estimates), "two seconds by odometry alone, not {estimates} cycles");
}

#[test]
fn an_outlier_is_dropped_and_a_kidnapped_robot_is_found() {
    let mut analyze = Fixture::<AnalyzeBlock<EstimatePose>>::new();
    analyze.set("robot", model(Pose2::default(), REAL));
    let mut fix = |x: f64| {
        analyze.advance(200_000_000);
        analyze.set("odometry", Odometry::default());
        analyze.set("position", Position { x, y: 0.0, z: 0.0 });
        analyze.set("orientation", Orientation { theta: 0.0 });
        analyze.tick();
        analyze.output::<PoseEstimate>("estimate").map(|estimate| estimate.pose.x)
    };
    for _ in 0..20 {
        fix(0.0);
    }
    assert!(fix(2.0).unwrap().abs() < 0.01, "one is an outlier");
    assert!(fix(0.0).unwrap().abs() < 0.01);
    let carried: Vec<_> = (0..8).filter_map(|_| fix(2.0)).collect();
    assert!(carried[0] < 0.01 && (carried.last().unwrap() - 2.0).abs() < 0.05, "{carried:?}");
}

#[test]
fn knowledge_has_the_estimate_and_before_it_the_measurement() {
    let params = WheeledKnowledgeParams { robot: Text::new("pioneer_p3dx"), ..Default::default() };
    let mut knowledge = Fixture::<KnowledgeBlock<WheeledKnowledge>>::with(params).unwrap();
    let pose = |knowledge: &mut Fixture<KnowledgeBlock<WheeledKnowledge>>| {
        knowledge.tick();
        let model = knowledge.output::<WheeledModel>("robot").unwrap();
        Some(model.robot.pose).filter(Pose2::is_known).map(|pose| pose.x)
    };
    knowledge.set("position", Position { x: 1.0, y: 0.0, z: 0.0 });
    knowledge.set("orientation", Orientation::default());
    assert_eq!(pose(&mut knowledge), Some(1.0));
    let estimate = Pose2 { x: 1.1, ..Pose2::default() };
    knowledge.set("pose", PoseEstimate { pose: estimate, ..PoseEstimate::default() });
    assert_eq!(pose(&mut knowledge), Some(1.1));
    knowledge.expire("pose");
    knowledge.set("position", Position { x: 1.0, y: 0.0, z: 0.0 });
    assert_eq!(pose(&mut knowledge), None, "the robot is lost, whatever single measurements say");
}

#[test]
fn plan_receives_estimated_position() {
    let mut analyze = Fixture::<AnalyzeBlock<PassPosition>>::new();
    analyze.set("position", Position { x: 1.0, y: 2.0, z: 0.0 });
    analyze.set("robot", model(Pose2 { x: 1.1, y: 2.1, theta: 0.0 }, REAL));
    analyze.tick();
    let change = analyze.output::<Position>("change").unwrap();
    assert_eq!((change.x, change.y), (1.1, 2.1));
}

fn scan(range: f64) -> SonarScan {
    SonarScan {
        range_max: 5.0,
        placements: Sequence::new(&[SonarPlacement::default()]),
        echoes: Sequence::new(&[Echo { range, heard: (range < 5.0).into() }]),
        ..SonarScan::default()
    }
}

/// The change that these ranges cause.
fn crowded(ranges: &[f64], accuracy: SensorAccuracy) -> Vec<bool> {
    let mut analyze = Fixture::<AnalyzeBlock<PassRange>>::new();
    analyze.set("robot", model(Pose2::default(), accuracy));
    let told = ranges.iter().filter_map(|range| {
        analyze.set("range", scan(*range));
        analyze.tick();
        analyze.output::<Surroundings>("change").map(|surroundings| surroundings.crowded.get())
    });
    told.collect()
}

#[test]
fn the_median_over_time_drops_single_ranges_of_sonars_that_err() {
    let crosstalk = [3.0, 3.0, 3.0, 0.2, 3.0, 0.3, 3.0, 3.0, 3.0];
    assert_eq!(crowded(&crosstalk, REAL), [false]);
    assert_eq!(
        crowded(&crosstalk, SensorAccuracy::default()),
        [false, true, false, true, false],
        "an exact one is believed"
    );
    let dropout = [0.4, 0.4, 0.4, 5.0, 0.4, 5.0, 0.4, 0.4];
    assert_eq!(crowded(&dropout, REAL), [true]);
    assert_eq!(crowded(&[3.0, 3.0, 3.0, 0.4, 0.4, 0.4], REAL), [false, true], "what stays is there");
}

/// The errors of a robot's position, meters, as it is seen and as it is located: it goes by at 0.3 m/s, and every fifth detection
/// is missing.
fn errors_of_track(seed: u64) -> (f64, f64, usize) {
    let mut random = Random::new(seed, "track");
    let mut analyze = Fixture::<AnalyzeBlock<LocateRobot>>::new();
    analyze.set("robot", model(Pose2::default(), REAL));
    let (mut measured, mut located, mut count, mut lost) = (0.0, 0.0, 0.0, 0);
    for cycle in 0..200_u32 {
        let (x, y) = (1.2, -3.0 + 0.03 * f64::from(cycle));
        let range = math::hypot(x, y) + (0.03 + 0.01 * math::hypot(x, y)) * random.normal();
        let bearing = math::atan2(y, x) + 0.02 * random.normal();
        let seen = Sighting { range, bearing, name: Text::new("r2") };
        let missing = cycle % 5 == 4;
        analyze.advance(100_000_000);
        analyze.set("robot", model(Pose2::default(), REAL));
        let list: &[Sighting] = if missing { &[] } else { &[seen] };
        analyze.set("robots", Sightings { list: Sequence::new(list) });
        analyze.tick();
        let Some(change) = analyze.output::<Located>("change") else { continue };
        lost += usize::from(!change.seen.get());
        if cycle > 20 {
            let squared = |error: f64| error * error;
            located += squared(change.x - x) + squared(change.y - y);
            measured += squared(range * math::cos(bearing) - x) + squared(range * math::sin(bearing) - y);
            count += 1.0;
        }
    }
    ((located / count).sqrt(), (measured / count).sqrt(), lost)
}

#[test]
fn a_robot_is_tracked_over_noise_and_missing_detections() {
    for seed in 0..10 {
        let (located, measured, lost) = errors_of_track(seed);
        assert!(located < 0.95 * measured, "seed {seed}: {located} m, measured {measured} m");
        assert_eq!(lost, 0, "seed {seed}");
    }
}

#[test]
fn a_detection_of_something_else_does_not_move_the_track() {
    let mut track = TrackFilter::new(Point2 { x: 1.0, y: 0.0 }, 0.05, 0.0);
    for step in 1..20 {
        track.predict(f64::from(step) * 0.1, 0.6);
        assert!(track.update(Point2 { x: 1.0 + 0.03 * f64::from(step), y: 0.0 }, 0.05, 4.0));
    }
    let [east, north] = track.velocity();
    assert!((east - 0.3).abs() < 0.05 && north.abs() < 0.01, "{east} {north}");
    track.predict(2.0, 0.6);
    let before = track;
    assert!(!track.update(Point2 { x: 3.0, y: 1.0 }, 0.05, 4.0));
    assert!(!track.update(Point2 { x: f64::NAN, y: 1.0 }, 0.05, 4.0));
    assert_eq!(track, before);
}
