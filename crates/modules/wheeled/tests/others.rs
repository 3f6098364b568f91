//! Use of other robots that a robot sees.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate::interfaces::{
    Echo, Odometry, Orientation, Pose2, Position, Sighting, Sightings, SonarPlacement, SonarScan, Twist2,
};
use slate::mapek::{AnalyzeBlock, MonitorBlock, SensorBlock};
use slate::module::testing::Fixture;
use slate::module::{Bool, Sequence, Text, math};
use slate_wheeled::knowledge::WheeledModel;
use slate_wheeled::local_map::{LocalObstacles, MapObstacles, MarkedObstacle, TrackedRobot};
use slate_wheeled::locate_robot::{LocateRobot, Located, RobotMonitor};
use slate_wheeled::odometry_pose::{OdometryOrientation, OdometryPosition, OdometryStart};
use slate_wheeled::tracks::Tracks;
use slate_wheeled::twist_estimator::TwistEstimator;

fn sees(range: f64, bearing: f64) -> Sightings {
    Sightings { list: Sequence::new(&[Sighting { range, bearing, name: Text::new("r2") }]) }
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-9
}

/// At (1, 2), looking north.
fn observer() -> Fixture<AnalyzeBlock<LocateRobot>> {
    let mut analyze = Fixture::new();
    analyze.set("position", Position { x: 1.0, y: 2.0, z: 0.0 });
    analyze.set("orientation", Orientation { theta: std::f64::consts::FRAC_PI_2 });
    analyze
}

#[test]
fn a_robot_is_where_it_is_seen_from_where_one_is() {
    let mut analyze = observer();
    analyze.set("robots", sees(1.5, 0.0));
    analyze.tick();
    let located = analyze.output::<Located>("change").unwrap();
    assert!(near(located.x, 1.0) && near(located.y, 3.5) && located.seen.get(), "{located:?}");
}

#[test]
fn detections_beyond_the_range_of_the_robot_model_are_dropped() {
    let mut robot = WheeledModel::load("summit_xl", "real").unwrap();
    let mut monitor = Fixture::<MonitorBlock<RobotMonitor>>::new();
    let mut passes = |robot: Option<WheeledModel>, range: f64, bearing: f64| {
        if let Some(robot) = robot {
            monitor.set("robot", robot);
        }
        monitor.set("robots", sees(range, bearing));
        monitor.tick();
        !monitor.output::<Sightings>("percept").unwrap().list.is_empty()
    };
    assert!(passes(None, 9.0, 0.0), "limits are unknown before the robot model is known");
    // 8 m from the detector, which is 0.2 m in front of the middle.
    assert!(passes(Some(robot), 8.1, 0.0) && !passes(None, 8.3, 0.0) && !passes(None, 7.9, 3.1));
    robot.robot.sensors = Sequence::default();
    assert!(passes(Some(robot), 9.0, 0.0));
}

#[test]
fn only_changes_and_one_loss_are_reported() {
    let mut analyze = observer();
    let mut told = |sightings: Sightings, seconds: u64| {
        analyze.advance(seconds * 1_000_000_000);
        analyze.set("robots", sightings);
        analyze.tick();
        analyze.output::<Located>("change").map(|located| located.seen.get())
    };
    assert_eq!(told(sees(1.5, 0.0), 0), Some(true));
    assert_eq!(told(sees(1.5001, 0.0), 0), None, "no news");
    assert_eq!(told(sees(1.6, 0.0), 0), Some(true));
    assert_eq!(told(Sightings::default(), 0), None, "it may be seen again in a moment");
    assert_eq!(told(Sightings::default(), 2), Some(false));
    assert_eq!(told(Sightings::default(), 2), None, "told once");
    assert_eq!(told(sees(1.6, 0.0), 0), Some(true), "it is back where it was");
}

#[test]
fn silent_sensor_detects_no_robot() {
    let mut analyze = observer();
    analyze.set("robots", sees(1.5, 0.0));
    analyze.tick();
    let mut told = Vec::new();
    for _ in 0..10 {
        analyze.advance(100_000_000);
        // The robot itself knows on where it is.
        analyze.set("position", Position { x: 1.0, y: 2.5, z: 0.0 });
        analyze.set("orientation", Orientation { theta: 0.0 });
        analyze.tick();
        told.extend(analyze.output::<Located>("change"));
    }
    assert_eq!(told.len(), 1, "{told:?}");
    assert!(!told[0].seen.get() && near(told[0].y, 3.5), "it is where it was seen last: {told:?}");
}

#[test]
fn moving_robot_measures_velocities_of_others() {
    let mut tracks = Tracks::default();
    for step in 0..200 {
        let time = f64::from(step) * 0.02;
        // This one turns on the spot; the other one goes east at 0.4 m/s from (1, 1).
        let pose = Pose2 { x: 0.0, y: 0.0, theta: time };
        let (x, y) = (1.0 + 0.4 * time, 1.0);
        tracks.update(pose, &sees(math::hypot(x, y), math::atan2(y, x) - time), time);
    }
    let track = tracks.iter().next().unwrap();
    assert!((track.velocity[0] - 0.4).abs() < 0.01 && track.velocity[1].abs() < 0.01, "{track:?}");
    tracks.update(Pose2::default(), &Sightings::default(), 10.0);
    assert_eq!(tracks.iter().count(), 0, "forgotten");
    tracks.update(Pose2::default(), &sees(f64::NAN, 0.0), 10.0);
    assert_eq!(tracks.iter().count(), 0, "no place");
}

#[test]
fn odometry_that_began_elsewhere_is_placed_in_the_map() {
    let odometry = Odometry { pose: Pose2 { x: 1.0, y: 0.0, theta: 0.5 }, twist: Twist2::ZERO };
    let start_theta = std::f64::consts::FRAC_PI_2;
    let start = OdometryStart { start_x: 2.0, start_y: 3.0, start_theta };
    let mut position = Fixture::<SensorBlock<OdometryPosition>>::with(start).unwrap();
    position.set("source", odometry);
    position.tick();
    let place = position.output::<Position>("value").unwrap();
    assert!(near(place.x, 2.0) && near(place.y, 4.0), "{place:?}");
    let mut orientation = Fixture::<SensorBlock<OdometryOrientation>>::with(start).unwrap();
    orientation.set("source", odometry);
    orientation.tick();
    assert!(near(orientation.output::<Orientation>("value").unwrap().theta, start_theta + 0.5));
}

#[test]
fn twist_is_estimated_from_poses() {
    let mut motion = TwistEstimator::default();
    let mut moves = Twist2::ZERO;
    for step in 0..=100 {
        let time = f64::from(step) * 0.02;
        // A circle of 2 m: back at 0.4 m/s.
        let theta = -0.2 * time;
        moves = motion.update(Pose2 { x: 2.0 * math::sin(theta), y: -2.0 * math::cos(theta), theta }, time);
    }
    assert!((moves.linear + 0.4).abs() < 1e-3 && (moves.angular + 0.2).abs() < 1e-3, "{moves:?}");
    assert_eq!(motion.update(Pose2 { x: f64::NAN, ..Pose2::default() }, 3.0), Twist2::ZERO);
    assert_eq!(motion.update(Pose2::default(), 3.1), Twist2::ZERO, "and it begins anew");
}

/// A local map in short.
#[derive(Debug)]
struct Mapped {
    obstacles: usize,
    robots: Vec<TrackedRobot>,
    sees_robots: bool,
    bytes: usize,
}

/// The obstacles that an Analyze maps of one echo 0.1 m to the left of a Summit at (0, 2), whose room is so wide.
fn mapped(room: f64, robots: Option<Sightings>) -> Mapped {
    let mut analyze = Fixture::<AnalyzeBlock<MapObstacles>>::new();
    analyze.params().room_half_width = room;
    let placement = SonarPlacement { x: 0.3, y: 0.3, theta: std::f64::consts::FRAC_PI_2 };
    let echo = Echo { range: 0.1, heard: Bool::from(true) };
    analyze.set(
        "range",
        SonarScan {
            field_of_view: 0.5,
            range_max: 1.0,
            placements: Sequence::new(&[placement]),
            echoes: Sequence::new(&[echo]),
            ..SonarScan::default()
        },
    );
    analyze.set("position", Position { x: 0.0, y: 2.0, z: 0.0 });
    analyze.set("orientation", Orientation { theta: 0.0 });
    analyze.set("robot", WheeledModel::load("summit_xl", "vrep").unwrap());
    if let Some(robots) = robots {
        analyze.set("robots", robots);
    }
    analyze.tick();
    let short = |map: &LocalObstacles| Mapped {
        obstacles: map.obstacles.len(),
        robots: map.robots.to_vec(),
        sees_robots: map.sees_robots.get(),
        bytes: size_of_val(map),
    };
    analyze.read("change", short).unwrap()
}

#[test]
fn echoes_of_walls_and_robots_mark_no_obstacle() {
    let obstacles = |room| mapped(room, None).obstacles;
    assert!(obstacles(1e6) > 0, "something is beside it");
    assert_eq!(obstacles(2.4), 0, "the wall of the room is there");
    assert!(obstacles(3.0) > 0, "the wall is elsewhere");
    let seen = mapped(1e6, Some(sees(0.7, 1.2)));
    assert_eq!((seen.obstacles, seen.robots.len()), (0, 1), "the robot is there");
    assert!(seen.sees_robots && (seen.robots[0].radius - 0.28).abs() < 1e-9);
}

#[test]
fn local_map_is_as_large_as_what_is_marked_in_it() {
    let (none, some) = (mapped(2.4, None), mapped(1e6, None));
    assert_eq!(some.bytes - none.bytes, some.obstacles * size_of::<MarkedObstacle>());
    assert!(none.bytes < 500 && some.bytes < 2000, "{none:?}, {some:?}");
}
