//! A tick of the modules allocates nothing, once they know how large the map is.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_interfaces::{
    LaserScan, MapMark, MapStroke, OccupancyGrid, Odometry, Path, Point2, Pose2, PoseEstimate,
};
use slate_mapek::{AnalyzeBlock, Device, RobotModel};
use slate_mapping::{OccupancyMapper, PathPlanner, PoseEstimator};
use slate_module::testing::Fixture;
use slate_module::{Sequence, Text, math};
use slate_testing::{Counted, allocations};

#[test]
fn ticks_allocate_only_when_the_map_changes_its_size() {
    let mut estimator = Fixture::<Counted<AnalyzeBlock<PoseEstimator>>>::new();
    let mut mapper = Fixture::<Counted<AnalyzeBlock<OccupancyMapper>>>::new();
    let mut planner = Fixture::<Counted<AnalyzeBlock<PathPlanner>>>::new();
    let (mut first, mut longest) = (None, 0.0);
    for cycle in 0..60_u32 {
        let turn = f64::from(cycle) * 0.1;
        let pose = Pose2 { x: math::cos(turn), y: math::sin(turn), theta: math::wrap_angle(turn) };
        estimator.set("odometry", Odometry { pose, ..Odometry::default() });
        mapper.set("pose", pose);
        let laser = Device { name: Text::new("laser"), ..Device::default() };
        mapper.set("robot", RobotModel { sensors: Sequence::new(&[laser]), ..RobotModel::default() });
        mapper.write::<LaserScan>("scan", 181, |scan| {
            (scan.angle_min, scan.angle_increment) = (-1.57, 0.01745);
            (scan.range_min, scan.range_max) = (0.05, 4.0);
            for (beam, range) in scan.ranges.iter_mut().enumerate() {
                *range = 1.0 + (beam as u32 * cycle % 29) as f32 * 0.1;
            }
        });
        let mark = if cycle % 5 == 4 { MapMark::UNDO } else { MapMark::OCCUPIED };
        let (from, to) = (Point2 { x: -3.0, y: 0.1 * f64::from(cycle % 20) }, Point2 { x: 2.0, y: 1.0 });
        let points = Sequence::new(&[from, to]);
        mapper.push("strokes", MapStroke { width: 0.2, mark, points });
        let grid: Vec<i8> = {
            mapper.advance(1_000_000_000);
            mapper.tick();
            mapper.read("change", |map: &OccupancyGrid| map.data.to_vec()).unwrap()
        };
        planner.write::<OccupancyGrid>("map", grid.len(), |map| {
            (map.origin, map.resolution) = (Pose2 { x: -5.0, y: -5.0, theta: 0.0 }, 0.05);
            (map.width, map.height) = (200, 200);
            map.data.copy_from_slice(&grid);
        });
        planner.set("pose", pose);
        planner.set("goal", Point2 { x: 4.5, y: 4.0 - 0.15 * f64::from(cycle) });
        planner.tick();
        longest = math::max(longest, planner.read("change", |path: &Path| path.length).unwrap());
        estimator.tick();
        assert!(estimator.output::<PoseEstimate>("change").is_some());
        first.get_or_insert(allocations());
    }
    assert!(longest > 4.0, "a path of {longest} m");
    assert!(first > Some(0), "the counter counts");
    assert_eq!(Some(allocations()), first, "of the first tick alone");
}
