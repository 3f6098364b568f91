//! Graph SLAM of a drive.

use slate_interfaces::Pose2;
use slate_module::math;
use slate_slam::{
    GraphSlam, GraphSlamParameters, LoopClosureParameters, MatchingParameters, occupancy_map, se2,
};

use crate::world::{Step, drive, largest_error};

fn run(steps: &[Step], parameters: GraphSlamParameters) -> GraphSlam {
    let mut slam = GraphSlam::new(parameters).unwrap();
    for step in steps {
        slam.insert(step.odometry, &step.points);
    }
    slam
}

#[test]
fn loop_closure_corrects_the_drift_of_odometry() {
    let steps = drive(2, 1);
    let odometry: Vec<Pose2> = steps.iter().map(|step| step.odometry).collect();
    assert!(largest_error(&odometry, &steps) > 5.0);
    let mut slam = run(&steps, GraphSlamParameters::default());
    slam.finish();
    let error = largest_error(slam.poses(), &steps);
    assert!(error < 0.05, "{error}");
    assert!(slam.graph().constraints.iter().any(|constraint| constraint.is_robust));
}

#[test]
fn restored_state_goes_on_as_the_saved_one() {
    let steps = drive(1, 2);
    let (first, rest) = steps.split_at(60);
    let mut slam = run(first, GraphSlamParameters::default());
    let bytes = postcard::to_allocvec(&slam).unwrap();
    let mut restored: GraphSlam = postcard::from_bytes(&bytes).unwrap();
    for step in rest {
        let expected = slam.insert(step.odometry, &step.points);
        assert_eq!(restored.insert(step.odometry, &step.points), expected);
    }
    slam.finish();
    restored.finish();
    assert!(restored == slam);
}

#[test]
fn bad_scans_and_odometry_do_no_harm() {
    let steps = drive(1, 3);
    let mut slam = GraphSlam::new(GraphSlamParameters::default()).unwrap();
    for (at, step) in steps.iter().enumerate() {
        let mut points = step.points.clone();
        points[at % 180] = [f64::NAN, 1.0];
        points[at % 90] = [f64::INFINITY, f64::NEG_INFINITY];
        match at % 20 {
            // A scan that sees nothing, and one of something else.
            7 => points.clear(),
            13 => points.iter_mut().for_each(|point| *point = [point[1] * 0.3, -point[0] * 0.3]),
            _ => {}
        }
        slam.insert(step.odometry, &points);
    }
    slam.insert(Pose2::UNKNOWN, &steps[0].points);
    slam.finish();
    assert!(slam.poses().iter().all(Pose2::is_known));
    let error = largest_error(slam.poses(), &steps);
    assert!(error < 0.5, "{error}");
}

#[test]
fn map_has_the_walls_where_they_are() {
    let steps = drive(1, 4);
    let mut slam = run(&steps, GraphSlamParameters::default());
    slam.finish();
    let scans = (0..slam.scans()).map(|scan| (slam.poses()[scan], slam.points(scan)));
    let map = occupancy_map(scans.clone(), 0.05, 1 << 20).unwrap();
    // The first pose is at (1.6, 1.6) in the building, and looks along x but for 0.0079 rad.
    let heading = math::atan2(-0.1, 12.7);
    let cell = |x: f64, y: f64| {
        let (right, up) = (x - 1.6, y - 1.6);
        let (sine, cosine) = (math::sin(heading), math::cos(heading));
        let place = map.geometry.cell(right * cosine + up * sine, up * cosine - right * sine);
        place.map(|(column, row)| map.cells[map.geometry.index(column, row)])
    };
    let near = |x: f64, y: f64| [-0.05, 0.0, 0.05].map(|by| cell(x, y + by).unwrap_or(-1)).into_iter().max();
    assert!((4..12).all(|x| near(f64::from(x) + 0.5, 3.0) > Some(30)));
    assert!((4..12).all(|x| cell(f64::from(x), 2.0) == Some(0)));
    assert_eq!(cell(8.0, 6.0), Some(-1));
    assert!(occupancy_map(scans, 0.001, 1 << 20).is_none());
}

#[test]
fn invalid_parameters_are_named() {
    let refused = |parameters| GraphSlam::new(parameters).unwrap_err().to_string();
    let mut parameters = GraphSlamParameters { scans_per_submap: 1, ..GraphSlamParameters::default() };
    assert_eq!(refused(parameters), "invalid `scans_per_submap`: expected 2 to 1000");
    parameters = GraphSlamParameters::default();
    parameters.matching.resolution = 0.0;
    assert_eq!(refused(parameters), "invalid `resolution`: expected a length above 0 m");
    let loops = LoopClosureParameters { search_angle: f64::NAN, ..LoopClosureParameters::default() };
    parameters = GraphSlamParameters { loops, ..GraphSlamParameters::default() };
    assert_eq!(refused(parameters), "invalid `loops.search_angle`: expected 0 to pi rad");
    let matching = |change: fn(&mut MatchingParameters)| {
        let mut parameters = GraphSlamParameters::default();
        change(&mut parameters.matching);
        refused(parameters)
    };
    let range = matching(|matching| matching.max_laser_range = 1e12);
    assert_eq!(range, "invalid `max_laser_range`: expected at most 2000 times `resolution`");
    let fine = matching(|matching| matching.resolution = 0.001);
    assert_eq!(fine, "invalid `max_laser_range`: expected at most 2000 times `resolution`");
    let increment = matching(|matching| matching.max_odometry_increment = 500.0);
    assert_eq!(increment, "invalid `max_odometry_increment`: expected at most 2000 times `resolution`");
    let near = matching(|matching| matching.correspondence_distance = 6.0);
    assert_eq!(near, "invalid `correspondence_distance`: expected at most 100 times `resolution`");
}

#[test]
fn scans_after_finish_go_on_in_the_map() {
    let mut steps = drive(2, 1);
    // The wheels slip to a side by 0.3 m before the first scan after it.
    let last = steps[164].odometry;
    let slipped = se2::compose(last, Pose2 { y: 0.3, ..Pose2::default() });
    let slip = |step: &mut Step| step.odometry = se2::compose(slipped, se2::relative(last, step.odometry));
    steps[165..].iter_mut().for_each(slip);
    let (first, rest) = steps.split_at(165);
    let mut slam = run(first, GraphSlamParameters::default());
    slam.finish();
    for (at, step) in rest.iter().enumerate() {
        let pose = slam.insert(step.odometry, &step.points);
        let error = math::hypot(pose.x - step.truth.x, pose.y - step.truth.y);
        assert!(error < 0.15, "scan {at} after finish: {error}");
    }
    slam.finish();
    slam.finish();
    let error = largest_error(slam.poses(), &steps);
    assert!(error < 0.05, "{error}");
}

#[test]
fn odometry_jump_is_no_motion() {
    let mut steps = drive(1, 5);
    let far = Pose2 { x: 500.0, y: -300.0, theta: 1.0 };
    steps[50..].iter_mut().for_each(|step| step.odometry = se2::compose(far, step.odometry));
    let mut slam = run(&steps, GraphSlamParameters::default());
    slam.insert(Pose2 { x: f64::MAX, y: f64::MAX, theta: 0.0 }, &steps[0].points);
    slam.finish();
    assert_eq!(slam.odometry_jumps(), 2);
    let error = largest_error(slam.poses(), &steps);
    assert!(error < 0.1, "{error}");
}
