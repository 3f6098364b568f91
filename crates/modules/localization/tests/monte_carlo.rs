//! A robot with a laser that drives in a building of which it has the map.

use slate_grid::{Geometry, LineCells};
use slate_interfaces::Pose2;
use slate_localization::{
    BeamSkip, KldSampling, LikelihoodField, MonteCarloLocalization, MonteCarloParameters, OdometryAlphas,
    Recovery, SensorModel,
};
use slate_module::{Random, math};

/// Cells of 0.1 m.
const BUILDING: [&str; 8] = [
    "################################",
    "#..........#...................#",
    "#..........#.......######......#",
    "#..##......................#...#",
    "#..##......#...............#...#",
    "#..........#####..######...#...#",
    "#.....................#........#",
    "################################",
];
/// Cells of the map for each character of the building along x and y.
const SCALE: usize = 4;

struct Building {
    geometry: Geometry,
    walls: Vec<bool>,
}

impl Building {
    fn new() -> Self {
        let size = [3.2 * SCALE as f64, 0.8 * SCALE as f64];
        let geometry = Geometry::new([0.0, 0.0], size, 0.1, 100_000).unwrap();
        let wall = |cell: usize| {
            let (column, row) = (cell % geometry.width / SCALE, cell / geometry.width / SCALE);
            BUILDING[BUILDING.len() - 1 - row].as_bytes()[column] == b'#'
        };
        Self { walls: (0..geometry.cells()).map(wall).collect(), geometry }
    }

    fn field(&self) -> LikelihoodField {
        let model = SensorModel { sigma_hit: 0.1, laser_max_range: 10.0, ..SensorModel::default() };
        LikelihoodField::new(self.geometry, |cell| self.walls[cell], |_| true, model).unwrap()
    }

    /// Ends of 60 beams, in the robot's frame, with noise of 2 cm.
    fn scan(&self, pose: &Pose2, random: &mut Random) -> Vec<[f64; 2]> {
        let beam = |k: i32| {
            let bearing = f64::from(k) * 2.0 * std::f64::consts::PI / 60.0;
            let (across, up) = (math::cos(pose.theta + bearing), math::sin(pose.theta + bearing));
            let from = self.geometry.place(pose.x, pose.y);
            let to = self.geometry.place(pose.x + 20.0 * across, pose.y + 20.0 * up);
            let hit = LineCells::new(from, to)
                .find(|(column, row)| self.walls[self.geometry.index(*column as usize, *row as usize)]);
            let (column, row) = hit.unwrap();
            let wall = self.geometry.center(column as usize, row as usize);
            let range = math::hypot(wall.x - pose.x, wall.y - pose.y) + 0.02 * random.normal();
            [range * math::cos(bearing), range * math::sin(bearing)]
        };
        (0..60).map(beam).collect()
    }
}

/// A robot that drives round the building, and its odometry, which goes wrong by 2 % and 3 %.
struct Drive {
    truth: Pose2,
    odometry: Pose2,
    at: usize,
}

/// Where it drives, m.
const WAY: [[f64; 2]; 7] =
    [[1.0, 2.2], [3.6, 2.4], [5.4, 1.7], [7.2, 2.5], [11.5, 2.6], [11.4, 0.7], [7.2, 1.6]];

impl Drive {
    fn new() -> Self {
        let truth = Pose2 { x: WAY[0][0], y: WAY[0][1], theta: 0.0 };
        Self { truth, odometry: Pose2::default(), at: 0 }
    }

    /// Turns towards the next point of its way, and drives on by 5 cm.
    fn step(&mut self) {
        let [x, y] = WAY[self.at % WAY.len()];
        let to = [x - self.truth.x, y - self.truth.y];
        if math::hypot(to[0], to[1]) < 0.1 {
            self.at += 1;
            return;
        }
        let turn = math::clamp(math::angle_between(self.truth.theta, math::atan2(to[1], to[0])), -0.2, 0.2);
        self.truth = driven(self.truth, turn, 0.05);
        self.odometry = driven(self.odometry, 1.03 * turn, 1.02 * 0.05);
    }
}

fn driven(pose: Pose2, turn: f64, way: f64) -> Pose2 {
    let theta = math::wrap_angle(pose.theta + turn);
    Pose2 { x: pose.x + way * math::cos(theta), y: pose.y + way * math::sin(theta), theta }
}

fn parameters() -> MonteCarloParameters {
    MonteCarloParameters {
        alphas: OdometryAlphas { alpha1: 0.02, alpha2: 0.02, alpha3: 0.02, alpha4: 0.02 },
        update_min_d: 0.1,
        update_min_a: 0.1,
        selective_resampling: true,
        ..MonteCarloParameters::default()
    }
}

fn error(localization: &mut MonteCarloLocalization, truth: &Pose2) -> (f64, f64) {
    let pose = localization.estimate().unwrap().pose;
    (math::hypot(pose.x - truth.x, pose.y - truth.y), math::angle_between(truth.theta, pose.theta).abs())
}

#[test]
fn a_pose_is_followed_within_the_noise_of_the_laser() {
    let (building, mut random) = (Building::new(), Random::new(3, "test"));
    let (field, mut drive) = (building.field(), Drive::new());
    let mut localization = MonteCarloLocalization::new(parameters()).unwrap();
    localization.initialize(drive.truth, [0.1, 0.1, 0.1], &mut random);
    let (mut squares, mut count) = (0.0, 0);
    for step in 0..800 {
        drive.step();
        let points = building.scan(&drive.truth, &mut random);
        localization.update(drive.odometry, &points, &field, &mut random);
        if step > 50 {
            let (position, _) = error(&mut localization, &drive.truth);
            squares += position * position;
            count += 1;
        }
    }
    let drift = math::hypot(drive.odometry.x + 1.0 - drive.truth.x, drive.odometry.y + 2.2 - drive.truth.y);
    let rmse = (squares / f64::from(count)).sqrt();
    assert!(rmse < 0.06 && drift > 0.15, "{rmse} {drift}");
    // The pose is certain, so few particles are enough.
    assert!(localization.particles().len() < 700, "{}", localization.particles().len());
}

#[test]
fn a_robot_that_could_be_anywhere_finds_its_pose() {
    let building = Building::new();
    let field = building.field();
    let sampling = KldSampling { max_particles: 10_000, ..parameters().sampling };
    let found = (0..10).filter(|seed| {
        let mut random = Random::new(*seed, "test");
        let mut drive = Drive::new();
        let mut localization =
            MonteCarloLocalization::new(MonteCarloParameters { sampling, ..parameters() }).unwrap();
        localization.initialize_globally(&field, &mut random);
        for _ in 0..250 {
            drive.step();
            let points = building.scan(&drive.truth, &mut random);
            localization.update(drive.odometry, &points, &field, &mut random);
        }
        error(&mut localization, &drive.truth).0 < 0.15
    });
    assert!(found.count() >= 9);
}

#[test]
fn a_robot_that_is_carried_away_finds_its_pose_again() {
    let building = Building::new();
    let field = building.field();
    let run = |recovery: Recovery| {
        let mut random = Random::new(5, "test");
        let mut drive = Drive::new();
        let mut localization =
            MonteCarloLocalization::new(MonteCarloParameters { recovery, ..parameters() }).unwrap();
        localization.initialize(drive.truth, [0.1, 0.1, 0.1], &mut random);
        for step in 0..900 {
            drive.step();
            if step == 100 {
                (drive.truth.x, drive.truth.y, drive.at) = (11.4, 0.8, 6);
            }
            let points = building.scan(&drive.truth, &mut random);
            localization.update(drive.odometry, &points, &field, &mut random);
        }
        error(&mut localization, &drive.truth).0
    };
    let with = run(Recovery { alpha_slow: 0.01, alpha_fast: 0.1 });
    let without = run(Recovery::default());
    assert!(with < 0.15 && without > 0.5, "{with} {without}");
}

#[test]
fn beams_that_hit_what_the_map_lacks_can_be_left_out() {
    let building = Building::new();
    let field = building.field();
    let truth = Pose2 { x: 3.2, y: 1.6, theta: 0.0 };
    let run = |beam_skip: Option<BeamSkip>, people: usize| {
        let mut random = Random::new(3, "test");
        let mut localization =
            MonteCarloLocalization::new(MonteCarloParameters { beam_skip, ..parameters() }).unwrap();
        localization.initialize(truth, [0.05, 0.05, 0.05], &mut random);
        let mut points = building.scan(&truth, &mut random);
        // People stand beside the robot, far from all walls.
        points.extend((0..people).map(|k| [0.05, 0.000_1 * k as f64]));
        localization.update(Pose2::default(), &points, &field, &mut random);
        localization.particles().to_vec()
    };
    let skip = Some(BeamSkip::default());
    assert!(run(skip, 20) == run(skip, 0));
    assert!(run(None, 20) != run(None, 0));
    // Most beams fit nowhere: the robot is somewhere else, and all of them count.
    assert!(run(skip, 1_000) == run(None, 1_000));
}

#[test]
fn the_same_seed_gives_the_same_particles() {
    let run = || {
        let (building, mut random) = (Building::new(), Random::new(3, "test"));
        let (field, mut drive) = (building.field(), Drive::new());
        let mut localization = MonteCarloLocalization::new(parameters()).unwrap();
        localization.initialize_globally(&field, &mut random);
        for _ in 0..60 {
            drive.step();
            let points = building.scan(&drive.truth, &mut random);
            localization.update(drive.odometry, &points, &field, &mut random);
        }
        localization.particles().to_vec()
    };
    assert!(run() == run());
}

#[test]
fn an_invalid_pose_and_a_map_without_free_cells_change_nothing() {
    let building = Building::new();
    let (field, mut random) = (building.field(), Random::new(3, "test"));
    let mut localization = MonteCarloLocalization::new(parameters()).unwrap();
    assert!(localization.estimate().is_none());
    let blocked = LikelihoodField::new(
        building.geometry,
        |cell| building.walls[cell],
        |_| false,
        SensorModel::default(),
    );
    let blocked = blocked.unwrap();
    assert!(!blocked.has_free_cells());
    localization.initialize_globally(&blocked, &mut random);
    assert!(localization.estimate().is_none());
    localization.initialize(Drive::new().truth, [0.1; 3], &mut random);
    for x in [f64::NAN, f64::INFINITY, 1e19] {
        assert!(!localization.initialize(Pose2 { x, y: 0.0, theta: 0.0 }, [0.1; 3], &mut random));
    }
    let before = localization.particles().to_vec();
    for x in [f64::NAN, 1e20] {
        let odometry = Pose2 { x, y: 0.0, theta: 0.0 };
        assert!(!localization.update(odometry, &[[1.0, 0.0]], &field, &mut random));
    }
    assert!(localization.particles() == before);
}

#[test]
fn parameters_that_no_filter_can_have_are_named() {
    let refused = |sampling: KldSampling| {
        let parameters = MonteCarloParameters { sampling, ..parameters() };
        MonteCarloLocalization::new(parameters).unwrap_err().to_string()
    };
    let sampling = parameters().sampling;
    assert_eq!(
        refused(KldSampling { max_particles: 300, ..sampling }),
        "invalid `min_particles`: expected 1 to max_particles"
    );
    assert!(refused(KldSampling { pf_err: f64::NAN, ..sampling }).contains("pf_err"));
    let model = SensorModel { sigma_hit: 0.0, ..SensorModel::default() };
    let field = LikelihoodField::new(Building::new().geometry, |_| false, |_| true, model);
    assert_eq!(field.unwrap_err().name, "sigma_hit");
}
