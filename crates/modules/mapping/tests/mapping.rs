//! Estimates, maps and paths of a robot in a room, and manual corrections.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test that fails panics")]

use proptest::prelude::*;
use slate_interfaces::{
    LaserScan, MapMark, MapStroke, OccupancyGrid, Odometry, Orientation, Path, Point2, Pose2, PoseEstimate,
    Position, Twist2,
};
use slate_mapek::{AnalyzeBlock, Device, RobotModel};
use slate_mapping::{OccupancyMapper, OdometryNoise, PathPlanner, PoseBelief, PoseEstimator};
use slate_module::testing::Fixture;
use slate_module::{Sequence, Text, math};

const SECOND: u64 = 1_000_000_000;

fn odometry(x: f64, y: f64, theta: f64) -> Odometry {
    Odometry { pose: Pose2 { x, y, theta }, twist: Twist2 { linear: 0.0, angular: 0.0 } }
}

/// Variances of x and y.
fn spread(estimate: &PoseEstimate) -> (f64, f64) {
    (estimate.covariance[0], estimate.covariance[4])
}

#[test]
fn odometry_alone_lets_the_covariance_grow_most_across() {
    let mut robot = Fixture::<AnalyzeBlock<PoseEstimator>>::new();
    let mut last = (0.0, 0.0);
    for step in 0..=40 {
        robot.set("odometry", odometry(f64::from(step) * 0.05, 0.0, 0.0));
        robot.tick();
        let estimate: PoseEstimate = robot.output("change").unwrap();
        assert!((estimate.pose.x - f64::from(step) * 0.05).abs() < 1e-12);
        let now = spread(&estimate);
        assert!(now.0 >= last.0 && now.1 >= last.1, "{last:?} {now:?}");
        last = now;
    }
    // A small heading error is a large lateral error after two meters.
    assert!(last.1 > 2.0 * last.0, "{last:?}");
}

#[test]
fn a_belief_drops_outliers_and_begins_anew() {
    let mut belief = PoseBelief::default();
    assert!(!belief.update_heading(1.0, 0.1, 4.0) && belief.estimate().is_none(), "it is nowhere yet");
    let noise = OdometryNoise { translation_stddev: 0.05, rotation_stddev: 0.05 };
    let at = |x| Pose2 { x, y: 0.0, theta: 0.0 };
    assert!(belief.predict(at(3.0), Some(&noise)), "the first pose of the odometry is no motion");
    belief.begin(at(1.0), [0.1, 0.1]);
    assert!(belief.predict(at(3.5), Some(&noise)) && !belief.predict(at(f64::NAN), Some(&noise)));
    assert_eq!(belief.estimate().map(|of| of.pose), Some(at(1.5)));
    assert!(
        !belief.update_position([2.5, 0.0], 0.1, 4.0) && belief.estimate().map(|of| of.pose) == Some(at(1.5))
    );
    assert!(belief.update_position([1.6, 0.0], 0.1, 4.0));
    let x = belief.estimate().unwrap().pose.x;
    assert!(x > 1.5 && x < 1.6, "{x}");
    assert!(belief.update_position([2.5, 0.0], 0.1, f64::INFINITY), "without a gate");
    assert!(
        belief.update_heading(0.1, 0.0, 4.0) && belief.estimate().unwrap().pose.theta == 0.1,
        "an exact one is never an outlier"
    );
}

#[test]
fn the_estimate_begins_at_the_start_and_is_reset_manually() {
    let mut robot = Fixture::<AnalyzeBlock<PoseEstimator>>::new();
    robot.set("odometry", odometry(3.0, 4.0, 1.0));
    robot.tick();
    // The first pose of the odometry is no motion.
    let estimate: PoseEstimate = robot.output("change").unwrap();
    assert_eq!(estimate.pose, Pose2 { x: 0.0, y: 0.0, theta: 0.0 });
    robot.push("initial_pose", Pose2 { x: 1.0, y: -1.0, theta: 0.5 });
    robot.tick();
    let estimate: PoseEstimate = robot.output("change").unwrap();
    assert_eq!(estimate.pose, Pose2 { x: 1.0, y: -1.0, theta: 0.5 });
    for (x, theta) in [(f64::NAN, 0.0), (1e9, 0.0), (0.0, 1e300), (0.0, f64::INFINITY)] {
        robot.push("initial_pose", Pose2 { x, y: 0.0, theta });
        robot.tick();
        assert!(robot.output::<PoseEstimate>("change").is_none(), "{x} {theta}");
    }
}

#[test]
fn position_and_compass_updates_shrink_the_covariance() {
    let mut robot = Fixture::<AnalyzeBlock<PoseEstimator>>::new();
    for step in 0..100 {
        robot.set("odometry", odometry(f64::from(step) * 0.1, 0.0, 0.0));
        robot.tick();
    }
    let lost: PoseEstimate = robot.output("change").unwrap();
    for _ in 0..50 {
        robot.set("position", Position { x: 9.5, y: 0.4, z: 0.0 });
        robot.set("orientation", Orientation { theta: 0.05 });
        robot.tick();
    }
    let found: PoseEstimate = robot.output("change").unwrap();
    assert!((found.pose.x - 9.5).abs() < 0.05 && (found.pose.y - 0.4).abs() < 0.05, "{found:?}");
    assert!((found.pose.theta - 0.05).abs() < 0.01, "{found:?}");
    assert!(spread(&found).0 < spread(&lost).0 / 10.0 && spread(&found).1 < spread(&lost).1 / 10.0);
}

proptest! {
    #[test]
    fn the_covariance_stays_symmetric_and_positive(
        steps in prop::collection::vec((-0.3..0.3_f64, -0.3..0.3_f64, -1.0..1.0_f64, 0..4_u8), 1..60),
    ) {
        let mut robot = Fixture::<AnalyzeBlock<PoseEstimator>>::new();
        let (mut x, mut y, mut theta) = (0.0, 0.0, 0.0);
        for (dx, dy, turn, what) in steps {
            (x, y, theta) = (x + dx, y + dy, math::wrap_angle(theta + turn));
            robot.set("odometry", odometry(x, y, theta));
            match what {
                1 => robot.set("position", Position { x, y, z: 0.0 }),
                2 => robot.set("orientation", Orientation { theta }),
                3 => robot.push("initial_pose", Pose2 { x, y, theta }),
                _ => {}
            }
            robot.tick();
            let estimate: PoseEstimate = robot.output("change").unwrap();
            let [a, b, c, d, e, f, g, h, i] = estimate.covariance;
            let near = |one: f64, other: f64| (one - other).abs() < 1e-9;
            prop_assert!(near(b, d) && near(c, g) && near(f, h), "{estimate:?}");
            prop_assert!(a >= -1e-12 && e >= -1e-12 && i >= -1e-12, "{estimate:?}");
            prop_assert!(a * e - b * d >= -1e-9, "{estimate:?}");
            let determinant = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g);
            prop_assert!(determinant >= -1e-9, "{estimate:?}");
        }
    }
}

/// A mapper of ten by ten meters about the origin, whose robot looks to the east from there.
fn mapper() -> Fixture<AnalyzeBlock<OccupancyMapper>> {
    let mut mapper = Fixture::<AnalyzeBlock<OccupancyMapper>>::new();
    mapper.set("pose", Pose2 { x: 0.0, y: 0.0, theta: 0.0 });
    mapper.set("robot", robot_with("laser", Pose2::default()));
    mapper
}

/// The model of a robot with that sensor.
fn robot_with(sensor: &str, mount: Pose2) -> RobotModel {
    let device = Device { mount, name: Text::new(sensor), ..Device::default() };
    RobotModel { sensors: Sequence::new(&[device]), ..RobotModel::default() }
}

/// What a laser of 181 beams from right to left sees, by the range of each direction.
fn scan(mapper: &mut Fixture<AnalyzeBlock<OccupancyMapper>>, range: impl Fn(f64) -> f64) {
    mapper.write::<LaserScan>("scan", 181, |scan| {
        scan.angle_min = -std::f64::consts::FRAC_PI_2;
        scan.angle_increment = std::f64::consts::PI / 180.0;
        scan.range_min = 0.05;
        scan.range_max = 4.0;
        for (beam, out) in scan.ranges.iter_mut().enumerate() {
            *out = range(scan.angle_min + beam as f64 * scan.angle_increment) as f32;
        }
    });
    mapper.advance(SECOND);
    assert_eq!(mapper.tick(), slate_module::Outcome::Ok);
}

/// Looks at the newest map.
fn look(mapper: &Fixture<AnalyzeBlock<OccupancyMapper>>, look: impl FnOnce(&OccupancyGrid)) {
    mapper.read("change", look).unwrap();
}

/// Looks at the newest path.
fn path(planner: &Fixture<AnalyzeBlock<PathPlanner>>, look: impl FnOnce(&Path)) {
    planner.read("change", look).unwrap();
}

/// Value of the cell at a point.
fn at(map: &OccupancyGrid, x: f64, y: f64) -> i8 {
    let cell = |from: f64, to: f64| ((to - from) / map.resolution).floor() as usize;
    map.data[cell(map.origin.y, y) * map.width as usize + cell(map.origin.x, x)]
}

/// A wall two meters to the east.
fn wall(direction: f64) -> f64 {
    let range = 2.02 / math::cos(direction);
    if range > 0.0 && range < 4.0 { range } else { 4.0 }
}

#[test]
fn a_wall_is_occupied_before_it_free_behind_it_unknown() {
    let mut mapper = mapper();
    for _ in 0..5 {
        scan(&mut mapper, wall);
    }
    look(&mapper, |map| {
        assert_eq!((map.width, map.height, map.data.len()), (200, 200, 40_000));
        assert!(at(map, 2.02, 0.0) > 90, "{}", at(map, 2.02, 0.0));
        assert!(at(map, 1.0, 0.2) < 30 && at(map, 1.0, 0.2) >= 0, "{}", at(map, 1.0, 0.2));
        assert_eq!(at(map, 3.0, 0.0), -1);
        assert_eq!(at(map, -1.0, 0.0), -1);
    });
}

#[test]
fn scans_are_taken_from_where_the_robot_model_has_the_laser() {
    let mut mapper = mapper();
    // Half a meter ahead of the robot and turned to its left.
    let mount = Pose2 { x: 0.5, y: 0.0, theta: std::f64::consts::FRAC_PI_2 };
    mapper.set("robot", robot_with("laser", mount));
    for _ in 0..10 {
        scan(&mut mapper, |_| 2.0);
    }
    look(&mapper, |map| {
        assert!(at(map, 0.5, 2.02) > 90, "ahead of the laser");
        assert!(at(map, 0.5, 1.0) < 10);
        assert_eq!(at(map, 2.02, -1.0), -1, "behind it nothing is known");
    });
    // A model without the laser maps nothing.
    let mut mapper = self::mapper();
    mapper.set("robot", robot_with("sonar", mount));
    scan(&mut mapper, |_| 2.0);
    look(&mapper, |map| assert!(map.data.iter().all(|cell| *cell == -1)));
}

#[test]
fn moving_objects_fade_and_invalid_ranges_change_nothing() {
    let mut mapper = mapper();
    for _ in 0..5 {
        scan(&mut mapper, wall);
    }
    for _ in 0..20 {
        scan(&mut mapper, |_| f64::NAN);
    }
    look(&mapper, |map| assert!(at(map, 2.02, 0.0) > 90));
    for _ in 0..20 {
        scan(&mut mapper, |_| 4.0);
    }
    look(&mapper, |map| assert!(at(map, 2.02, 0.0) < 10));
}

#[test]
fn strokes_override_measured_cells_until_they_are_undone() {
    let mut mapper = mapper();
    for _ in 0..5 {
        scan(&mut mapper, wall);
    }
    let stroke = |mark, points: &[Point2]| MapStroke { width: 0.2, mark, points: Sequence::new(points) };
    mapper
        .push("strokes", stroke(MapMark::OCCUPIED, &[Point2 { x: 1.0, y: -0.5 }, Point2 { x: 1.0, y: 0.5 }]));
    mapper.push("strokes", stroke(MapMark::FREE, &[Point2 { x: 2.0, y: 0.0 }]));
    mapper.tick();
    look(&mapper, |map| {
        assert_eq!((at(map, 1.0, 0.3), at(map, 2.02, 0.0)), (100, 0));
        assert!(at(map, 2.02, 0.5) > 90);
    });
    mapper.push("strokes", stroke(MapMark::UNDO, &[]));
    mapper.push("strokes", stroke(MapMark::UNDO, &[]));
    mapper.tick();
    look(&mapper, |map| assert!(at(map, 1.0, 0.3) < 30 && at(map, 2.02, 0.0) > 90));
}

/// A room of six by six meters with a wall across it, which has a door, at those y.
fn plan(door: std::ops::Range<f64>, goal: Point2) -> Fixture<AnalyzeBlock<PathPlanner>> {
    let mut planner = Fixture::<AnalyzeBlock<PathPlanner>>::new();
    planner.write::<OccupancyGrid>("map", 3600, |map| {
        (map.origin, map.resolution) = (Pose2 { x: -3.0, y: -3.0, theta: 0.0 }, 0.1);
        (map.width, map.height) = (60, 60);
        for (cell, out) in map.data.iter_mut().enumerate() {
            let y = -3.0 + (cell / 60) as f64 * 0.1 + 0.05;
            *out = if cell % 60 == 30 && !door.contains(&y) { 100 } else { -1 };
        }
    });
    planner.set("pose", Pose2 { x: -2.0, y: 0.0, theta: 0.0 });
    planner.set("goal", goal);
    planner.tick();
    planner
}

#[test]
fn the_path_leads_through_the_door_with_clearance() {
    let goal = Point2 { x: 2.0, y: 0.0 };
    path(&plan(1.0..2.4, goal), |path| {
        let (first, last) = (path.points[0], *path.points.last().unwrap());
        assert_eq!((first, last), (Point2 { x: -2.0, y: 0.0 }, goal));
        assert!(path.length > 4.8 && path.length < 5.6, "{path:?}");
        for pair in path.points.windows(2) {
            for part in 0..=50 {
                let share = f64::from(part) / 50.0;
                let x = pair[0].x + share * (pair[1].x - pair[0].x);
                let y = pair[0].y + share * (pair[1].y - pair[0].y);
                // The ends of the wall beside the door.
                for end in [0.95, 2.45] {
                    assert!(math::hypot(x - 0.05, y - end) > 0.25, "{x} {y} {path:?}");
                }
                assert!(x.abs() > 0.25 || (1.2..2.2).contains(&y), "{x} {y} {path:?}");
            }
        }
    });
}

#[test]
fn without_a_door_the_path_is_empty_and_the_robot_stays() {
    let planner = plan(0.0..0.0, Point2 { x: 2.0, y: 0.0 });
    path(&planner, |path| assert!(path.points.is_empty() && path.length == 0.0));
    assert_eq!(planner.output::<Point2>("waypoint"), Some(Point2 { x: -2.0, y: 0.0 }));
    // Nor to a goal outside of the map.
    let planner = plan(1.0..2.4, Point2 { x: 20.0, y: 0.0 });
    path(&planner, |path| assert!(path.points.is_empty()));
}

#[test]
fn a_robot_too_close_to_an_obstacle_can_leave() {
    let goal = Point2 { x: -2.0, y: -1.0 };
    let mut planner = plan(1.0..2.4, goal);
    // Nearer to the wall than its radius.
    planner.set("pose", Pose2 { x: -0.12, y: -1.0, theta: 0.0 });
    planner.advance(SECOND);
    planner.tick();
    path(&planner, |path| {
        assert_eq!((path.points.len(), *path.points.last().unwrap()), (2, goal), "{path:?}");
    });
    // Even where the map says that something stands, such as its own shadow; but never through the wall.
    planner.set("pose", Pose2 { x: 0.05, y: -1.0, theta: 0.0 });
    planner.advance(SECOND);
    planner.tick();
    path(&planner, |path| assert_eq!(path.points.last(), Some(&goal)));
}

#[test]
fn the_waypoint_is_at_the_lookahead_distance_on_the_path() {
    let goal = Point2 { x: 2.0, y: 0.0 };
    let planner = plan(1.0..2.4, goal);
    let next: Point2 = planner.output("waypoint").unwrap();
    assert!((math::hypot(next.x + 2.0, next.y) - 0.8).abs() < 1e-9, "{next:?}");
    let mut planner = plan(1.0..2.4, goal);
    planner.set("pose", Pose2 { x: 1.8, y: 0.0, theta: 0.0 });
    planner.advance(SECOND);
    planner.tick();
    assert_eq!(planner.output::<Point2>("waypoint"), Some(goal));
}
