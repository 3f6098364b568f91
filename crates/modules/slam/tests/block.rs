//! The block `slam` on a drive.

use slate_interfaces::{LaserScan, OccupancyGrid, Odometry, Pose2, PoseEstimate, Transform, Twist2};
use slate_mapek::AnalyzeBlock;
use slate_module::testing::Fixture;
use slate_module::{Outcome, Text, math};
use slate_slam::{Slam, SlamGraph, SlamParams, SlamStatus, se2};

use crate::world::{Step, drive};

const CYCLE: u64 = 500_000_000;

struct Scene {
    block: Fixture<AnalyzeBlock<Slam>>,
    truth: Pose2,
}

impl Scene {
    fn new(change: impl FnOnce(&mut SlamParams)) -> Self {
        let mut params = SlamParams {
            minimum_travel_distance: 0.3,
            map_start_x: 1.0,
            map_start_y: 2.0,
            ..SlamParams::default()
        };
        change(&mut params);
        Self { block: Fixture::with(params).unwrap(), truth: Pose2::default() }
    }

    fn set_odometry(&mut self, pose: Pose2) {
        self.block.set("odometry", Odometry { pose, twist: Twist2::ZERO });
    }

    fn set_scan(&mut self, points: &[[f64; 2]]) {
        self.block.write::<LaserScan>("scan", points.len(), |scan| {
            scan.angle_increment = std::f64::consts::PI / points.len() as f64;
            scan.angle_min = -std::f64::consts::FRAC_PI_2;
            scan.range_max = 40.0;
            for (range, [x, y]) in scan.ranges.iter_mut().zip(points) {
                *range = math::hypot(*x, *y) as f32;
            }
        });
    }

    fn tick(&mut self) -> Outcome {
        self.block.advance(CYCLE);
        self.block.tick().outcome().unwrap()
    }

    fn follow(&mut self, step: &Step) -> Outcome {
        self.truth = step.truth;
        self.set_odometry(step.odometry);
        self.set_scan(&step.points);
        self.tick()
    }

    fn drive(&mut self, steps: &[Step]) {
        for step in steps {
            assert_eq!(self.follow(step), Outcome::Ok);
        }
    }

    /// Stands until all loops are closed.
    fn settle(&mut self, last: &Step) -> SlamStatus {
        for _ in 0..4_000 {
            self.follow(last);
            let status: Option<SlamStatus> = self.block.output("status");
            if let Some(status) = status.filter(|status| status.is_settled.get()) {
                return status;
            }
        }
        SlamStatus::default()
    }

    fn pose(&self) -> Option<Pose2> {
        self.block.output::<PoseEstimate>("change").map(|estimate| estimate.pose)
    }

    /// Distance of the pose from the truth, m.
    fn error(&self) -> f64 {
        let start = Pose2 { x: 1.0, y: 2.0, theta: 0.0 };
        let truth = se2::compose(start, self.truth);
        self.pose().map_or(f64::INFINITY, |pose| math::hypot(pose.x - truth.x, pose.y - truth.y))
    }
}

#[test]
fn pose_map_and_frames_follow_a_drive() {
    let steps = drive(1, 1);
    let mut scene = Scene::new(|_| ());
    scene.drive(&steps[..50]);
    assert!(scene.error() < 0.15, "{}", scene.error());
    let shares = scene
        .block
        .read::<OccupancyGrid, [bool; 3]>("map", |map| [-1, 0, 100].map(|value| map.data.contains(&value)));
    assert_eq!(shares, Some([true; 3]));
    let graph =
        scene.block.read::<SlamGraph, (u32, usize)>("pose_graph", |graph| (graph.scans, graph.edges.len()));
    let (scans, edges) = graph.unwrap();
    assert!(scans >= 40 && edges >= scans as usize - 1);
    let frame: Transform = scene.block.output("map_to_odom").unwrap();
    assert_eq!((frame.parent.as_str(), frame.child.as_str()), ("map", "odom"));
}

#[test]
fn loops_are_closed_while_the_robot_stands() {
    let steps = drive(2, 1);
    let mut scene = Scene::new(|params| {
        params.finish_after = 1.0;
        params.background_units = 50;
    });
    scene.drive(&steps);
    let status = scene.settle(steps.last().unwrap());
    assert!(status.loop_closures > 0 && status.is_settled.get());
    assert!(scene.error() < 0.05, "{}", scene.error());
}

#[test]
fn restored_block_goes_on_as_the_saved_one() {
    let steps = drive(1, 2);
    let mut scene = Scene::new(|params| params.finish_after = 2.0);
    scene.drive(&steps[..45]);
    let mut restored = Scene::new(|params| params.finish_after = 2.0);
    restored.block.advance(45 * CYCLE);
    restored.block.restore(&scene.block.save().unwrap()).unwrap();
    for step in &steps[45..60] {
        scene.follow(step);
        restored.follow(step);
        assert!(scene.pose().is_some() && scene.pose() == restored.pose());
    }
    assert!(scene.block.save().unwrap() == restored.block.save().unwrap());
}

#[test]
fn particle_filter_maps_too() {
    let steps = drive(1, 3);
    let mut scene = Scene::new(|params| {
        params.method = Text::new("particle_filter");
        params.particles = 5;
    });
    scene.drive(&steps[..25]);
    assert!(scene.error() < 0.2, "{}", scene.error());
    assert!(scene.block.read::<OccupancyGrid, usize>("map", |map| map.data.len()).unwrap() > 1_000);
}

#[test]
fn bad_inputs_withhold_the_pose_until_they_recover() {
    let steps = drive(1, 4);
    let mut scene = Scene::new(|_| ());
    scene.drive(&steps[..20]);
    let far = se2::compose(steps[19].odometry, Pose2 { x: 30.0, y: 0.0, theta: 2.0 });
    scene.set_odometry(far);
    assert_eq!((scene.tick(), scene.pose()), (Outcome::Degraded, None));
    scene.set_odometry(steps[19].odometry);
    assert_eq!(scene.tick(), Outcome::Degraded);
    scene.drive(&steps[20..25]);
    scene.set_odometry(steps[25].odometry);
    scene.set_scan(&[[f64::NAN, 0.0]; 180]);
    assert_eq!((scene.tick(), scene.pose()), (Outcome::Degraded, None));
    scene.drive(&steps[25..30]);
    assert!(scene.error() < 0.2, "{}", scene.error());
}

#[test]
fn pose_reset_is_where_the_robot_goes_on() {
    let steps = drive(1, 5);
    let mut scene = Scene::new(|_| ());
    scene.drive(&steps[..10]);
    // It was carried on by 1.2 m, which the odometry has not noticed.
    let truth = se2::compose(Pose2 { x: 1.0, y: 2.0, theta: 0.0 }, steps[13].truth);
    scene.block.push("initial_pose", truth);
    scene.truth = steps[13].truth;
    scene.set_odometry(steps[9].odometry);
    scene.set_scan(&steps[13].points);
    assert_eq!(scene.tick(), Outcome::Ok);
    assert!(scene.error() < 0.1, "{}", scene.error());
}

#[test]
fn unknown_method_is_named() {
    let steps = drive(1, 6);
    let mut scene = Scene::new(|params| params.method = Text::new("hector"));
    assert_eq!(scene.follow(&steps[0]), Outcome::Degraded);
    scene.block.params().method = Text::new("graph");
    assert_eq!(scene.follow(&steps[0]), Outcome::Ok);
}
