//! The block `ekf`: good inputs, and bad ones.

use slate_interfaces::{
    FixStatus, Imu, NavSatFix, Odometry, Orientation, Pose2, PoseEstimate, Position, Quaternion, Transform,
    Twist2, Vector3,
};
use slate_localization::{
    Ekf, EkfParams, Landmark, LandmarkDetection, LandmarkDetections, LandmarkMap, RejectedMeasurements,
};
use slate_mapek::AnalyzeBlock;
use slate_module::testing::Fixture;
use slate_module::{Outcome, Sequence, Text, math};

const CYCLE: u64 = 50_000_000;
const SPEED: f64 = 0.5;
const TURN: f64 = 0.25;
const LANDMARKS: [[f64; 2]; 4] = [[3.0, 2.0], [-3.0, 2.0], [0.0, -3.0], [4.0, -2.0]];

/// A robot that drives in a circle, and whose odometry turns 10 % too much.
struct Scene {
    block: Fixture<AnalyzeBlock<Ekf>>,
    truth: Pose2,
    odometry: Pose2,
}

fn moved(pose: &mut Pose2, distance: f64, turn: f64) {
    let direction = pose.theta + 0.5 * turn;
    pose.x += distance * math::cos(direction);
    pose.y += distance * math::sin(direction);
    pose.theta = math::wrap_angle(pose.theta + turn);
}

impl Scene {
    fn new(params: EkfParams) -> Self {
        let block = Fixture::<AnalyzeBlock<Ekf>>::with(params).unwrap();
        Self { block, truth: Pose2::default(), odometry: Pose2::default() }
    }

    /// Drives on by a cycle.
    fn drive(&mut self) {
        let seconds = CYCLE as f64 * 1e-9;
        moved(&mut self.truth, SPEED * seconds, TURN * seconds);
        moved(&mut self.odometry, SPEED * seconds, 1.1 * TURN * seconds);
    }

    fn set_odometry(&mut self) {
        let twist = Twist2 { linear: SPEED, angular: 1.1 * TURN };
        self.block.set("odometry", Odometry { pose: self.odometry, twist });
    }

    fn set_imu(&mut self) {
        let angular_velocity = Vector3 { x: 0.0, y: 0.0, z: TURN };
        self.block.set(
            "imu",
            Imu { angular_velocity, orientation_covariance: Imu::NOT_MEASURED, ..Imu::default() },
        );
    }

    fn set_landmarks(&mut self) {
        let map = |(id, [x, y]): (u32, [f64; 2])| Landmark { id, x, y };
        let places: Vec<Landmark> = (1..).zip(LANDMARKS).map(map).collect();
        self.block.set("landmark_map", LandmarkMap { landmarks: Sequence::new(&places) });
        let truth = self.truth;
        let detection = |(id, [x, y]): (u32, [f64; 2])| LandmarkDetection {
            id,
            range: math::hypot(x - truth.x, y - truth.y),
            bearing: math::angle_between(truth.theta, math::atan2(y - truth.y, x - truth.x)),
        };
        // One that the map does not have measures nothing.
        let unknown = LandmarkDetection { id: 99, range: 1.0, bearing: 1.0 };
        let seen: Vec<LandmarkDetection> = (1..).zip(LANDMARKS).map(detection).chain([unknown]).collect();
        self.block.set("landmarks", LandmarkDetections { list: Sequence::new(&seen) });
    }

    fn set_position(&mut self) {
        self.block.set("position", Position { x: self.truth.x, y: self.truth.y, z: 0.0 });
    }

    fn tick(&mut self) -> Outcome {
        let outcome = self.block.tick().outcome().unwrap();
        self.block.advance(CYCLE);
        outcome
    }

    fn estimate(&self) -> Option<PoseEstimate> {
        self.block.output("change")
    }

    /// Errors of position and heading.
    fn errors(&self) -> [f64; 2] {
        self.estimate().map_or([f64::INFINITY; 2], |PoseEstimate { pose, .. }| {
            let position = math::hypot(pose.x - self.truth.x, pose.y - self.truth.y);
            [position, math::angle_between(pose.theta, self.truth.theta).abs()]
        })
    }

    /// Drives for a while with inputs that are set each cycle.
    fn run(&mut self, cycles: usize, set: impl Fn(&mut Self)) -> Outcome {
        let mut outcome = Outcome::Ok;
        for _ in 0..cycles {
            self.drive();
            set(self);
            outcome = self.tick();
        }
        outcome
    }
}

fn in_map() -> EkfParams {
    EkfParams { world_frame: Text::new("map"), ..EkfParams::default() }
}

#[test]
fn odometry_alone_is_followed() {
    let mut scene = Scene::new(EkfParams::default());
    assert_eq!(scene.run(100, Scene::set_odometry), Outcome::Ok);
    let PoseEstimate { pose, .. } = scene.estimate().unwrap();
    assert!(math::hypot(pose.x - scene.odometry.x, pose.y - scene.odometry.y) < 0.05);
    let filtered: Odometry = scene.block.output("filtered").unwrap();
    assert!((filtered.twist.linear - SPEED).abs() < 0.01);
    let frame: Transform = scene.block.output("odom_to_base").unwrap();
    assert_eq!((frame.parent.as_str(), frame.child.as_str()), ("odom", "base_link"));
}

#[test]
fn differences_of_poses_are_as_good_as_the_twist() {
    let params = EkfParams { odom0_differential: true.into(), ..EkfParams::default() };
    let mut scene = Scene::new(params);
    scene.run(100, |scene| {
        let twist = Twist2 { linear: 9.0, angular: 9.0 };
        scene.block.set("odometry", Odometry { pose: scene.odometry, twist });
    });
    let PoseEstimate { pose, .. } = scene.estimate().unwrap();
    assert!(math::hypot(pose.x - scene.odometry.x, pose.y - scene.odometry.y) < 0.1);
}

#[test]
fn a_gyroscope_outweighs_wheels_that_slip() {
    let mut wheels = Scene::new(EkfParams::default());
    wheels.run(200, Scene::set_odometry);
    let params = EkfParams { odom0_config: Text::new("vx vy"), ..EkfParams::default() };
    let mut both = Scene::new(params);
    both.run(200, |scene| {
        scene.set_odometry();
        scene.set_imu();
    });
    assert!(both.errors()[1] < 0.2 * wheels.errors()[1], "{:?} {:?}", both.errors(), wheels.errors());
}

#[test]
fn compass_and_positions_bound_the_drift() {
    let mut scene = Scene::new(in_map());
    scene.run(400, |scene| {
        scene.set_odometry();
        scene.block.set("orientation", Orientation { theta: scene.truth.theta });
        scene.set_position();
    });
    let [position, heading] = scene.errors();
    assert!(position < 0.05 && heading < 0.05, "{position} {heading}");
    let frame: Transform = scene.block.output("map_to_odom").unwrap();
    assert_eq!((frame.parent.as_str(), frame.child.as_str()), ("map", "odom"));
}

#[test]
fn landmarks_bound_the_drift() {
    let mut scene = Scene::new(in_map());
    scene.run(400, |scene| {
        scene.set_odometry();
        scene.set_landmarks();
    });
    let [position, heading] = scene.errors();
    assert!(position < 0.05 && heading < 0.03, "{position} {heading}");
}

#[test]
fn satellite_fixes_are_meters_from_the_first() {
    let mut scene = Scene::new(in_map());
    scene.run(400, |scene| {
        scene.set_odometry();
        // A degree at the equator is 111,320 m to the east and 110,574 m to the north.
        scene.block.set(
            "fix",
            NavSatFix {
                status: FixStatus::FIX,
                latitude: scene.truth.y / 110_574.0,
                longitude: 7.0 + scene.truth.x / 111_320.0,
                altitude: f64::NAN,
                position_covariance: [0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 1.0],
            },
        );
    });
    assert!(scene.errors()[0] < 0.1, "{:?}", scene.errors());
}

#[test]
fn a_position_that_jumps_once_is_an_outlier() {
    let mut scene = Scene::new(in_map());
    let well = |scene: &mut Scene| {
        scene.set_odometry();
        scene.set_position();
    };
    scene.run(100, well);
    scene.run(1, |scene| {
        scene.set_odometry();
        scene.block.set("position", Position { x: 40.0, y: 0.0, z: 0.0 });
    });
    let rejected: RejectedMeasurements = scene.block.output("rejected").unwrap();
    assert_eq!((rejected.position, rejected.odometry), (1, 0));
    assert!(scene.errors()[0] < 0.1);
}

#[test]
fn a_robot_that_was_carried_away_is_found_again() {
    let mut scene = Scene::new(in_map());
    let well = |scene: &mut Scene| {
        scene.set_odometry();
        scene.set_position();
    };
    scene.run(100, well);
    scene.truth.x += 8.0;
    scene.run(100, well);
    assert!(scene.errors()[0] < 0.2, "{:?}", scene.errors());
}

/// Drives with a bad input, which degrades the block without a pose, and then with a good one again.
fn spoil(cycles: usize, spoil: impl Fn(&mut Scene)) {
    let mut scene = Scene::new(in_map());
    let well = |scene: &mut Scene| {
        scene.set_odometry();
        scene.set_imu();
        scene.set_position();
    };
    assert_eq!(scene.run(60, well), Outcome::Ok);
    assert_eq!(scene.run(cycles, spoil), Outcome::Degraded);
    assert!(scene.estimate().is_none());
    assert_eq!(scene.run(60, well), Outcome::Ok);
    assert!(scene.errors()[0] < 0.1, "{:?}", scene.errors());
}

#[test]
fn odometry_that_is_no_number_is_bad() {
    spoil(3, |scene| {
        scene.block.set("odometry", Odometry { pose: Pose2::UNKNOWN, twist: Twist2::ZERO });
    });
    spoil(3, |scene| {
        let twist = Twist2 { linear: f64::NAN, angular: 0.0 };
        scene.block.set("odometry", Odometry { pose: scene.odometry, twist });
    });
}

#[test]
fn odometry_that_jumps_is_bad() {
    spoil(1, |scene| {
        scene.odometry.x += 30.0;
        scene.set_odometry();
    });
}

#[test]
fn odometry_that_stops_is_bad() {
    spoil(15, |scene| {
        scene.set_imu();
        scene.set_position();
    });
}

#[test]
fn an_imu_or_a_position_that_is_no_number_is_bad() {
    spoil(3, |scene| {
        let angular_velocity = Vector3 { x: 0.0, y: 0.0, z: f64::NAN };
        scene.block.set("imu", Imu { angular_velocity, ..Imu::default() });
        scene.set_odometry();
    });
    spoil(3, |scene| {
        scene.block.set("position", Position { x: f64::NAN, y: 0.0, z: 0.0 });
        scene.set_odometry();
        scene.set_imu();
    });
}

#[test]
fn an_unknown_variable_is_bad_until_it_is_mended() {
    let mut scene = Scene::new(EkfParams { odom0_config: Text::new("vx speed"), ..EkfParams::default() });
    assert_eq!(scene.run(3, Scene::set_odometry), Outcome::Degraded);
    scene.block.params().odom0_config = Text::new("vx vyaw");
    assert_eq!(scene.run(3, Scene::set_odometry), Outcome::Ok);
    scene.block.params().world_frame = Text::new("earth");
    assert_eq!(scene.run(3, Scene::set_odometry), Outcome::Degraded);
}

#[test]
fn headings_of_an_imu_count_if_they_are_named() {
    let mut scene = Scene::new(EkfParams { imu0_config: Text::new("yaw vyaw"), ..EkfParams::default() });
    scene.run(100, |scene| {
        scene.set_odometry();
        let half = 0.5 * scene.truth.theta;
        let orientation = Quaternion { x: 0.0, y: 0.0, z: math::sin(half), w: math::cos(half) };
        let angular_velocity = Vector3 { x: 0.0, y: 0.0, z: TURN };
        scene.block.set("imu", Imu { orientation, angular_velocity, ..Imu::default() });
    });
    assert!(scene.errors()[1] < 0.03, "{:?}", scene.errors());
}

#[test]
fn a_pose_is_reset_by_hand() {
    let mut scene = Scene::new(EkfParams::default());
    scene.run(10, Scene::set_odometry);
    scene.block.push("initial_pose", Pose2 { x: 5.0, y: 5.0, theta: 0.0 });
    scene.run(1, |_| {});
    let pose = scene.estimate().unwrap().pose;
    assert!((pose.x - 5.0).abs() < 1e-9 && (pose.y - 5.0).abs() < 1e-9);
}

#[test]
fn a_restored_filter_goes_on_with_the_same_poses() {
    let mut scene = Scene::new(in_map());
    let well = |scene: &mut Scene| {
        scene.set_odometry();
        scene.set_landmarks();
    };
    scene.run(30, well);
    let mut other = Scene::new(in_map());
    other.block.advance(30 * CYCLE);
    other.block.restore(&scene.block.save().unwrap()).unwrap();
    (other.truth, other.odometry) = (scene.truth, scene.odometry);
    scene.run(10, well);
    other.run(10, well);
    assert_eq!(scene.estimate(), other.estimate());
}
