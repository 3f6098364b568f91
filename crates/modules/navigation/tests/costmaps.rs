//! Obstacles around the robot, and costs of the map.
#![allow(clippy::unwrap_used, reason = "a test that fails panics")]

use slate_navigation::{
    CostmapClear, GlobalCostmap, GlobalCostmapParams, KeepOutZone, LocalCostmap, ObstaclePoints,
};
use slate_plugin::interfaces::{LaserScan, OccupancyGrid, Odometry, Point2, Pose2};
use slate_plugin::mapek::AnalyzeBlock;
use slate_plugin::module::testing::Fixture;
use slate_plugin::module::{Outcome, Sequence};

const BEAMS: usize = 181;
const CYCLE: u64 = 100_000_000;

/// Sees a wall at that range with all beams, at a heading.
fn look(block: &mut Fixture<AnalyzeBlock<LocalCostmap>>, range: f64, theta: f64) -> Outcome {
    block.set("odometry", Odometry { pose: Pose2 { x: 0.0, y: 0.0, theta }, ..Odometry::default() });
    block.write::<LaserScan>("scan", BEAMS, |scan| {
        scan.angle_min = -std::f64::consts::FRAC_PI_2;
        scan.angle_increment = std::f64::consts::PI / (BEAMS - 1) as f64;
        (scan.range_min, scan.range_max) = (0.05, 20.0);
        scan.ranges.fill(range as f32);
    });
    block.advance(CYCLE);
    block.tick().outcome().unwrap()
}

fn points(block: &Fixture<AnalyzeBlock<LocalCostmap>>) -> Vec<Point2> {
    block.read::<ObstaclePoints, _>("change", |obstacles| obstacles.points.to_vec()).unwrap_or_default()
}

#[test]
fn obstacles_behind_the_robot_are_kept_for_a_time() {
    let mut block = Fixture::<AnalyzeBlock<LocalCostmap>>::new();
    look(&mut block, 2.0, 0.0);
    assert_eq!(points(&block).len(), BEAMS);
    // It turns round: the old half circle is out of sight.
    look(&mut block, 1.0, std::f64::consts::PI);
    let behind = points(&block).iter().filter(|point| point.x > 0.1).count();
    assert!(behind > 100, "{behind}");
    block.set("clear", CostmapClear { number: 1 });
    look(&mut block, 1.0, std::f64::consts::PI);
    assert_eq!(points(&block).iter().filter(|point| point.x > 0.1).count(), 0);
    look(&mut block, 2.0, 0.0);
    for _ in 0..40 {
        look(&mut block, 1.0, std::f64::consts::PI);
    }
    assert_eq!(points(&block).iter().filter(|point| point.x > 0.1).count(), 0, "after 4 s");
}

#[test]
fn scan_clears_cells_along_its_beams() {
    let mut block = Fixture::<AnalyzeBlock<LocalCostmap>>::new();
    look(&mut block, 1.0, 0.0);
    look(&mut block, 2.0, 0.0);
    assert!(points(&block).iter().all(|point| slate_plugin::module::math::hypot(point.x, point.y) > 1.9));
}

#[test]
fn an_invalid_or_stopped_scan_is_no_obstacle() {
    let mut block = Fixture::<AnalyzeBlock<LocalCostmap>>::new();
    assert_eq!(look(&mut block, 2.0, 0.0), Outcome::Ok);
    assert_eq!(look(&mut block, f64::NAN, 0.0), Outcome::Degraded);
    assert!(!block.wrote("change"));
    assert_eq!(look(&mut block, 2.0, 0.0), Outcome::Ok);
    for _ in 0..6 {
        block.set("odometry", Odometry::default());
        block.advance(CYCLE);
        block.tick();
    }
    assert_eq!(block.tick().outcome(), Some(Outcome::Degraded));
    assert_eq!(look(&mut block, 2.0, 0.0), Outcome::Ok);
}

/// A map of 4 m by 4 m, free but for what a closure says.
fn map(block: &mut Fixture<AnalyzeBlock<GlobalCostmap>>, occupancy: impl Fn(usize, usize) -> i8) {
    block.write::<OccupancyGrid>("map", 1600, |map| {
        (map.resolution, map.width, map.height) = (0.1, 40, 40);
        for (cell, value) in map.data.iter_mut().enumerate() {
            *value = occupancy(cell % 40, cell / 40);
        }
    });
}

fn cost(block: &Fixture<AnalyzeBlock<GlobalCostmap>>, column: usize, row: usize) -> i8 {
    block.read::<OccupancyGrid, _>("change", |costs| costs.data[row * 40 + column]).unwrap()
}

#[test]
fn costs_come_from_map_obstacles_and_zones() {
    let zone = KeepOutZone { min_x: 3.0, min_y: 3.0, max_x: 3.5, max_y: 3.5 };
    let params =
        GlobalCostmapParams { keep_out_zones: Sequence::new(&[zone]), ..GlobalCostmapParams::default() };
    let mut block = Fixture::<AnalyzeBlock<GlobalCostmap>>::with(params).unwrap();
    map(&mut block, |column, row| match (column, row) {
        (0, _) => 100,
        (_, 39) => -1,
        _ => 0,
    });
    block.set("pose", Pose2 { x: 2.0, y: 2.0, theta: std::f64::consts::FRAC_PI_2 });
    block.write::<ObstaclePoints>("obstacles", 1, |obstacles| {
        // 1 m ahead of the robot, in an odometry frame that is turned.
        obstacles.pose = Pose2 { x: 5.0, y: 5.0, theta: 0.0 };
        obstacles.points[0] = Point2 { x: 6.0, y: 5.0 };
    });
    block.tick();
    assert_eq!(cost(&block, 0, 20), 100, "a wall");
    assert_eq!(cost(&block, 2, 20), 99, "too near to it");
    assert!((1..99).contains(&cost(&block, 4, 20)), "near to it");
    assert_eq!(cost(&block, 12, 10), 0, "free");
    assert_eq!(cost(&block, 20, 30), 100, "what the robot sees");
    assert_eq!(cost(&block, 32, 32), 100, "a zone");
    assert_eq!(cost(&block, 10, 39), -1, "unknown");
}

#[test]
fn a_map_without_a_free_cell_is_refused() {
    let mut block = Fixture::<AnalyzeBlock<GlobalCostmap>>::new();
    map(&mut block, |_, _| 100);
    assert_eq!(block.tick().outcome(), Some(Outcome::Degraded));
    map(&mut block, |_, _| 0);
    assert_eq!(block.tick().outcome(), Some(Outcome::Ok));
}
