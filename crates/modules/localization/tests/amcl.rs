//! The block `amcl` in a room: good inputs, and bad ones.

use slate_grid::{Geometry, RayCaster};
use slate_interfaces::{
    LaserScan, OccupancyGrid, Odometry, ParticleCloud, Pose2, PoseEstimate, Transform, Twist2,
};
use slate_localization::{Amcl, AmclParams, GlobalLocalization};
use slate_mapek::{AnalyzeBlock, Device, RobotModel};
use slate_module::testing::Fixture;
use slate_module::{Outcome, Sequence, Text, math};

const CYCLE: u64 = 100_000_000;
const BEAMS: usize = 181;

/// A room of 6 m by 4 m with a pillar.
fn geometry() -> Geometry {
    Geometry::new([0.0, 0.0], [6.0, 4.0], 0.05, 100_000).unwrap()
}

fn is_wall(cell: usize) -> bool {
    let Geometry { width, height, .. } = geometry();
    let (column, row) = (cell % width, cell / width);
    let is_edge = column == 0 || row == 0 || column == width - 1 || row == height - 1;
    is_edge || ((20..30).contains(&column) && (50..56).contains(&row))
}

/// A robot in the room, which drives in a circle.
struct Scene {
    block: Fixture<AnalyzeBlock<Amcl>>,
    caster: RayCaster,
    truth: Pose2,
    odometry: Pose2,
    cycle: u32,
}

impl Scene {
    fn new() -> Self {
        let params = AmclParams {
            set_initial_pose: true.into(),
            initial_pose_x: 2.0,
            initial_pose_y: 1.0,
            initial_position_stddev: 0.1,
            initial_heading_stddev: 0.1,
            laser_model_type: Text::new("likelihood_field_prob"),
            sigma_hit: 0.1,
            global_candidates: 5_000,
            ..AmclParams::default()
        };
        let block = Fixture::<AnalyzeBlock<Amcl>>::with(params).unwrap();
        let truth = Pose2 { x: 2.0, y: 1.0, theta: 0.0 };
        let caster = RayCaster::new(geometry(), is_wall);
        let mut scene = Self { block, caster, truth, odometry: Pose2::default(), cycle: 0 };
        scene.set_map(|cell| if is_wall(cell) { 100 } else { 0 });
        scene
    }

    /// Sets a map with that occupancy of each cell.
    fn set_map(&mut self, occupancy: impl Fn(usize) -> i8) {
        let geometry = geometry();
        self.block.write::<OccupancyGrid>("map", geometry.cells(), |map| {
            map.resolution = geometry.resolution;
            (map.width, map.height) = (geometry.width as u32, geometry.height as u32);
            for (cell, value) in map.data.iter_mut().enumerate() {
                *value = occupancy(cell);
            }
        });
    }

    /// Drives on by a cycle.
    fn drive(&mut self) {
        self.cycle += 1;
        for pose in [&mut self.truth, &mut self.odometry] {
            pose.theta = math::wrap_angle(pose.theta + 0.05);
            pose.x += 0.05 * math::cos(pose.theta);
            pose.y += 0.05 * math::sin(pose.theta);
        }
    }

    fn set_odometry(&mut self) {
        let odometry = Odometry { pose: self.odometry, twist: Twist2 { linear: 0.5, angular: 0.5 } };
        self.block.set("odometry", odometry);
    }

    /// Sets a scan of that many beams, each as `change` makes it of the exact range.
    fn set_scan(&mut self, beams: usize, change: impl Fn(usize, f64) -> f64) {
        let (truth, caster) = (self.truth, &self.caster);
        self.block.write::<LaserScan>("scan", beams, |scan| {
            scan.angle_min = -std::f64::consts::FRAC_PI_2;
            scan.angle_increment = std::f64::consts::PI / (beams - 1) as f64;
            (scan.range_min, scan.range_max) = (0.05, 20.0);
            for (beam, range) in scan.ranges.iter_mut().enumerate() {
                let angle = truth.theta + scan.angle_min + beam as f64 * scan.angle_increment;
                let exact = caster.range([truth.x, truth.y], [math::cos(angle), math::sin(angle)], 20.0);
                *range = change(beam, exact) as f32;
            }
        });
    }

    fn tick(&mut self) -> Outcome {
        self.block.advance(CYCLE);
        self.block.tick().outcome().unwrap()
    }

    /// A cycle in which all is well.
    fn step(&mut self) -> Outcome {
        self.drive();
        self.set_odometry();
        let cycle = self.cycle;
        self.set_scan(BEAMS, |beam, range| range + 0.001 * f64::from(cycle % 3) * (beam % 2) as f64);
        self.tick()
    }

    fn estimate(&self) -> Option<PoseEstimate> {
        self.block.output("change")
    }

    fn error(&self) -> f64 {
        self.estimate().map_or(f64::INFINITY, |estimate| {
            math::hypot(estimate.pose.x - self.truth.x, estimate.pose.y - self.truth.y)
        })
    }
}

/// A scene in which the robot has driven for a while.
fn driven() -> Scene {
    let mut scene = Scene::new();
    for _ in 0..60 {
        assert_eq!(scene.step(), Outcome::Ok);
    }
    assert!(scene.error() < 0.1, "{}", scene.error());
    scene
}

/// Drives with a bad input, which degrades the block without a pose, and then with a good one again.
fn spoil(scene: &mut Scene, cycles: usize, spoil: impl Fn(&mut Scene)) {
    let mut was_degraded = false;
    for _ in 0..cycles {
        scene.drive();
        spoil(scene);
        let outcome = scene.tick();
        if outcome == Outcome::Degraded {
            was_degraded = true;
            assert!(scene.estimate().is_none());
        }
    }
    assert!(was_degraded);
    for _ in 0..20 {
        scene.step();
    }
    assert_eq!(scene.step(), Outcome::Ok);
    assert!(scene.error() < 0.15, "{}", scene.error());
}

#[test]
fn the_block_follows_a_robot_with_covariance_and_frames() {
    let scene = driven();
    let covariance = scene.estimate().unwrap().covariance;
    assert!(covariance[0] > 0.0 && covariance[0] < 0.01 && covariance[8] > 0.0, "{covariance:?}");
    let frame: Transform = scene.block.output("map_to_odom").unwrap();
    assert_eq!((frame.parent.as_str(), frame.child.as_str()), ("map", "odom"));
    assert!((frame.translation.x - 2.0).abs() < 0.15 && (frame.translation.y - 1.0).abs() < 0.15);
}

#[test]
fn particles_are_shown_after_an_update() {
    let mut scene = Scene::new();
    scene.step();
    let count = scene.block.read::<ParticleCloud, usize>("particles", |cloud| cloud.particles.len());
    assert!(count.unwrap() >= 500);
}

#[test]
fn scans_with_a_wrong_count_are_bad() {
    spoil(&mut driven(), 5, |scene| {
        scene.set_odometry();
        scene.set_scan(90, |_, range| range);
    });
}

#[test]
fn scans_without_numbers_are_bad() {
    spoil(&mut driven(), 5, |scene| {
        scene.set_odometry();
        scene.set_scan(BEAMS, |_, _| f64::NAN);
    });
}

#[test]
fn a_stuck_laser_is_bad() {
    spoil(&mut driven(), 12, |scene| {
        scene.set_odometry();
        scene.set_scan(BEAMS, |beam, _| 1.0 + 0.001 * beam as f64);
    });
}

#[test]
fn a_stuck_laser_recovers_while_the_robot_stands() {
    let mut scene = driven();
    for _ in 0..12 {
        scene.drive();
        scene.set_odometry();
        scene.set_scan(BEAMS, |_, _| 1.0);
        scene.tick();
    }
    // Also where ranges came first, none has changed.
    scene.odometry = Pose2::default();
    for _ in 0..3 {
        scene.set_odometry();
        scene.set_scan(BEAMS, |_, _| 1.0);
        assert_eq!(scene.tick(), Outcome::Degraded);
    }
    scene.set_odometry();
    scene.set_scan(BEAMS, |_, range| range);
    assert_eq!(scene.tick(), Outcome::Ok);
}

#[test]
fn scans_without_a_return_are_good() {
    let mut scene = driven();
    for _ in 0..30 {
        scene.drive();
        scene.set_odometry();
        scene.set_scan(BEAMS, |_, _| f64::INFINITY);
        assert_eq!(scene.tick(), Outcome::Ok);
    }
}

#[test]
fn a_reset_of_the_odometry_is_no_motion_of_a_stuck_laser() {
    let mut scene = driven();
    let still = |scene: &mut Scene| {
        scene.set_odometry();
        scene.set_scan(BEAMS, |_, range| range);
        scene.tick()
    };
    for _ in 0..3 {
        assert_eq!(still(&mut scene), Outcome::Ok);
    }
    scene.odometry = Pose2 { x: 50.0, y: 0.0, theta: 0.0 };
    assert_eq!(still(&mut scene), Outcome::Degraded);
    assert_eq!(still(&mut scene), Outcome::Ok);
}

#[test]
fn a_bad_scan_lasts_until_a_good_one() {
    let mut scene = driven();
    // Odometry comes five times as often as scans.
    for cycle in 0..25 {
        scene.drive();
        scene.set_odometry();
        if cycle % 5 == 0 {
            scene.set_scan(BEAMS, |_, _| f64::NAN);
        }
        assert_eq!(scene.tick(), Outcome::Degraded);
        assert!(scene.estimate().is_none() && !scene.block.wrote("map_to_odom"));
    }
    assert_eq!(scene.step(), Outcome::Ok);
    assert!(scene.error() < 0.15, "{}", scene.error());
}

#[test]
fn bad_odometry_lasts_until_a_good_one() {
    let mut scene = driven();
    let odometry = Odometry { pose: Pose2::UNKNOWN, twist: Twist2 { linear: 0.0, angular: 0.0 } };
    scene.block.set("odometry", odometry);
    for _ in 0..3 {
        scene.set_scan(BEAMS, |_, range| range);
        assert_eq!(scene.tick(), Outcome::Degraded);
        assert!(!scene.block.wrote("map_to_odom"));
    }
    assert_eq!(scene.step(), Outcome::Ok);
}

#[test]
fn odometry_that_jumps_while_scans_are_bad_keeps_the_pose() {
    let mut scene = driven();
    for cycle in 0..10 {
        scene.drive();
        if cycle == 7 {
            scene.odometry.x += 30.0;
        }
        scene.set_odometry();
        scene.set_scan(BEAMS, |_, _| f64::NAN);
        scene.tick();
    }
    // By the odometry alone.
    scene.set_odometry();
    scene.set_scan(BEAMS, |_, _| f64::INFINITY);
    assert_eq!(scene.tick(), Outcome::Ok);
    assert!(scene.error() < 0.15, "{}", scene.error());
}

#[test]
fn a_laser_that_stops_is_bad() {
    spoil(&mut driven(), 15, Scene::set_odometry);
}

#[test]
fn odometry_that_jumps_or_is_no_number_is_bad() {
    let mut scene = driven();
    spoil(&mut scene, 1, |scene| {
        scene.odometry.x += 30.0;
        scene.set_odometry();
        scene.set_scan(BEAMS, |_, range| range);
    });
    spoil(&mut scene, 3, |scene| {
        let odometry = Odometry { pose: Pose2::UNKNOWN, twist: Twist2 { linear: 0.0, angular: 0.0 } };
        scene.block.set("odometry", odometry);
        scene.set_scan(BEAMS, |_, range| range);
    });
}

#[test]
fn a_map_that_is_missing_is_bad() {
    let mut block = Fixture::<AnalyzeBlock<Amcl>>::new();
    let odometry = Odometry { pose: Pose2::default(), twist: Twist2 { linear: 0.0, angular: 0.0 } };
    // Devices may take a while to begin.
    for (cycle, outcome) in [(1, Outcome::Ok), (20, Outcome::Degraded)] {
        block.set("odometry", odometry);
        for _ in 0..cycle {
            block.advance(CYCLE);
        }
        assert_eq!(block.tick(), outcome);
    }
}

#[test]
fn a_map_without_a_free_cell_is_bad_until_a_good_one() {
    let mut scene = Scene::new();
    scene.block.params().set_initial_pose = false.into();
    scene.set_map(|_| -1);
    for _ in 0..3 {
        assert_eq!(scene.step(), Outcome::Degraded);
        assert!(scene.estimate().is_none());
    }
    scene.set_map(|cell| if is_wall(cell) { 100 } else { 0 });
    assert_eq!(scene.step(), Outcome::Ok);
    for _ in 0..60 {
        scene.step();
    }
    assert!(scene.error() < 0.15, "{}", scene.error());
}

#[test]
fn an_invalid_initial_pose_is_bad_until_it_is_mended() {
    let mut scene = Scene::new();
    scene.block.params().initial_pose_x = 1e9;
    for _ in 0..3 {
        assert_eq!(scene.step(), Outcome::Degraded);
    }
    scene.block.params().initial_pose_x = scene.truth.x;
    assert_eq!(scene.step(), Outcome::Ok);
    assert!(scene.estimate().is_some());
}

#[test]
fn a_laser_that_the_robot_model_lacks_is_bad() {
    let mut scene = driven();
    let laser = Device { name: Text::new("laser"), ..Device::default() };
    scene.block.set("robot", RobotModel { sensors: Sequence::new(&[laser]), ..RobotModel::default() });
    assert_eq!(scene.step(), Outcome::Ok);
    scene.block.params().laser = Text::new("lidar");
    assert_eq!(scene.step(), Outcome::Degraded);
    assert!(scene.estimate().is_none());
    scene.block.params().laser = Text::new("laser");
    assert_eq!(scene.step(), Outcome::Ok);
}

#[test]
fn an_unknown_sensor_model_is_bad_until_it_is_mended() {
    let mut scene = driven();
    scene.block.params().laser_model_type = Text::new("beam");
    assert_eq!(scene.step(), Outcome::Degraded);
    scene.block.params().laser_model_type = Text::new("likelihood_field");
    assert_eq!(scene.step(), Outcome::Ok);
}

#[test]
fn a_pose_is_reset_by_hand_and_sought_anywhere() {
    let mut scene = driven();
    // Wrong by more than the laser corrects.
    scene.block.push("initial_pose", Pose2 { x: 4.5, y: 3.0, theta: 3.0 });
    scene.step();
    assert!(scene.error() > 0.5, "{}", scene.error());
    scene.block.push("global_localization", GlobalLocalization { number: 1 });
    for _ in 0..60 {
        scene.step();
    }
    assert!(scene.error() < 0.15, "{}", scene.error());
}

#[test]
fn a_restored_block_goes_on_with_the_same_poses() {
    let mut scene = driven();
    let state = scene.block.save().unwrap();
    let poses = |scene: &mut Scene| -> Vec<Option<Pose2>> {
        let step = |_| {
            scene.step();
            scene.estimate().map(|estimate| estimate.pose)
        };
        (0..20).map(step).collect()
    };
    let before = (scene.truth, scene.odometry, scene.cycle);
    // A step that is given up: the random numbers are a part of what a host saves.
    let first = poses(&mut scene);
    (scene.truth, scene.odometry, scene.cycle) = before;
    scene.block.restore(&state).unwrap();
    let again = poses(&mut scene);
    assert!(first.iter().chain(&again).all(Option::is_some));
    let apart = first
        .iter()
        .zip(&again)
        .filter_map(|(a, b)| Some(math::hypot(a.as_ref()?.x - b.as_ref()?.x, a.as_ref()?.y - b.as_ref()?.y)));
    assert!(apart.fold(0.0, math::max) < 0.1);
}
