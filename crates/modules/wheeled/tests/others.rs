//! What a robot makes of others that it sees.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate::interfaces::{
    Echo, Odometry, Orientation, Pose2, Position, Sighting, Sightings, SonarPlacement, SonarScan, Twist2,
};
use slate::mapek::{AnalyzeBlock, SensorBlock};
use slate::module::testing::Fixture;
use slate::module::{Bool, Sequence, Text, math};
use slate_wheeled::knowledge::WheeledModel;
use slate_wheeled::local_map::{LocalObstacles, MapObstacles};
use slate_wheeled::locate_robot::{LocateRobot, Located};
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
fn only_what_changed_is_told_and_who_is_lost_once() {
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
fn a_sensor_that_falls_silent_sees_nobody() {
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
fn how_others_move_is_seen_from_a_robot_that_moves_itself() {
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
fn how_a_robot_moves_is_known_from_where_it_is() {
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

/// The obstacles that an Analyze maps of one echo 0.1 m to the left of a Summit at (0, 2), whose room is so wide.
fn mapped(room: f64, robots: Option<Sightings>) -> LocalObstacles {
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
    analyze.output::<LocalObstacles>("change").unwrap()
}

#[test]
fn echoes_of_walls_and_robots_mark_no_obstacle() {
    let obstacles = |room| mapped(room, None).obstacles.len();
    assert!(obstacles(1e6) > 0, "something is beside it");
    assert_eq!(obstacles(2.4), 0, "the wall of the room is there");
    assert!(obstacles(3.0) > 0, "the wall is elsewhere");
    let seen = mapped(1e6, Some(sees(0.7, 1.2)));
    assert_eq!((seen.obstacles.len(), seen.robots.len()), (0, 1), "the robot is there");
    assert!(seen.sees_robots.get() && (seen.robots[0].radius - 0.28).abs() < 1e-9);
}
