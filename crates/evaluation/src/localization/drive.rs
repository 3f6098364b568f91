//! Robot that drives along a route, with its odometry and its laser.

use slate_interfaces::Pose2;
use slate_module::{Random, math};
use slate_sim::robot::LaserDescription;

use super::building::Building;

/// Time between two scans, s.
const PERIOD: f64 = 0.1;
/// Velocity along the route, m/s, and largest turn, rad/s.
const VELOCITY: f64 = 0.5;
const MAX_ANGULAR_VELOCITY: f64 = 1.0;
/// Distance that selects the next point of the route, m, and turn threshold.
/// The threshold is the heading error from which the robot turns in place, rad.
const ARRIVED: f64 = 0.1;
const ON_THE_SPOT: f64 = 0.3;

/// Errors of the odometry, as standard deviations.
/// Factors on translation and rotation stay for a run. In addition the heading drifts by travel and turn.
#[derive(Clone, Copy, Debug)]
pub struct OdometryErrors {
    /// Deviation of the factor on translations.
    pub translation_factor: f64,
    /// Deviation of the factor on rotations.
    pub rotation_factor: f64,
    /// Deviation of the translation after a meter, m/sqrt(m).
    pub translation_stddev: f64,
    /// Deviation of the heading after a meter or a radian, rad/sqrt(m).
    pub rotation_stddev: f64,
}

/// Pioneer on a floor without carpet.
pub const ODOMETRY: OdometryErrors = OdometryErrors {
    translation_factor: 0.02,
    rotation_factor: 0.03,
    translation_stddev: 0.01,
    rotation_stddev: 0.02,
};

/// Robot on its route.
pub struct RouteDrive<'a> {
    building: &'a Building,
    laser: &'a LaserDescription,
    pub truth: Pose2,
    pub odometry: Pose2,
    /// Driven distance, m.
    pub driven: f64,
    route: Vec<[f64; 2]>,
    next: usize,
    factors: [f64; 2],
    /// Random numbers of the route; those of the noise are separate.
    /// The noise thus does not change the route.
    routes: Random,
    noise: Random,
    distances: Vec<f64>,
    ranges: Vec<f32>,
}

impl<'a> RouteDrive<'a> {
    /// Starts at a random pose.
    pub fn new(building: &'a Building, laser: &'a LaserDescription, name: &str, seed: u64) -> Self {
        let [mut routes, mut noise] =
            ["routes", "noise"].map(|part| Random::new(seed, &format!("{name}/{part}")));
        let factors = [
            1.0 + ODOMETRY.translation_factor * noise.normal(),
            1.0 + ODOMETRY.rotation_factor * noise.normal(),
        ];
        let start = building.random_pose(&mut routes);
        Self {
            building,
            laser,
            truth: start,
            odometry: Pose2::default(),
            driven: 0.0,
            route: vec![[start.x, start.y]],
            next: 1,
            factors,
            routes,
            noise,
            distances: Vec::new(),
            ranges: Vec::new(),
        }
    }

    /// Moves the robot to a random pose without odometry (kidnapped robot).
    pub fn kidnap(&mut self) {
        self.truth = self.building.random_pose(&mut self.routes);
        self.route.clear();
    }

    /// Advances a period: turns towards the next point of the route, and drives to it.
    pub fn step(&mut self) {
        if self.next >= self.route.len() {
            // From the end of the last one, which is in a cell where the robot can be.
            let end = self.route.last().copied().unwrap_or([self.truth.x, self.truth.y]);
            self.route = self.building.route(end, 1.0, &mut self.routes);
            self.next = 1;
        }
        let [x, y] = self.route.get(self.next).copied().unwrap_or([self.truth.x, self.truth.y]);
        let (right, up) = (x - self.truth.x, y - self.truth.y);
        let distance = math::hypot(right, up);
        if distance < ARRIVED {
            self.next += 1;
            return;
        }
        let error = math::angle_between(self.truth.theta, math::atan2(up, right));
        let turn = math::clamp(error, -MAX_ANGULAR_VELOCITY * PERIOD, MAX_ANGULAR_VELOCITY * PERIOD);
        let translation =
            if error.abs() > ON_THE_SPOT { 0.0 } else { math::min(VELOCITY * PERIOD, distance) };
        self.truth = moved(&self.truth, turn, translation);
        self.driven += translation;
        let (way, angle) = (translation.sqrt(), (translation + turn.abs()).sqrt());
        let measured = [
            self.factors[0] * translation + ODOMETRY.translation_stddev * way * self.noise.normal(),
            self.factors[1] * turn + ODOMETRY.rotation_stddev * angle * self.noise.normal(),
        ];
        self.odometry = moved(&self.odometry, measured[1], measured[0]);
    }

    /// Measures with the laser.
    pub fn scan(&mut self) -> &[f32] {
        let laser = self.laser;
        let (from, heading) = mounted(&self.truth, laser);
        self.distances.clear();
        self.distances.extend((0..laser.beams).map(|beam| {
            let angle = heading + laser.angle_of(beam);
            self.building.caster.range(from, [math::cos(angle), math::sin(angle)], laser.range_max)
        }));
        laser.measure(&self.distances, &mut self.noise, &mut self.ranges);
        &self.ranges
    }
}

/// Returns position and heading of the laser.
pub fn mounted(robot: &Pose2, laser: &LaserDescription) -> ([f64; 2], f64) {
    let [ahead, left, degrees] = laser.mount;
    let (sine, cosine) = (math::sin(robot.theta), math::cos(robot.theta));
    let position = [robot.x + ahead * cosine - left * sine, robot.y + ahead * sine + left * cosine];
    (position, robot.theta + degrees.to_radians())
}

/// Computes the ends of about `beams` beams in the robot's frame, m.
/// Beams that hit no obstacle are left out.
pub fn ends_of_beams(ranges: &[f32], laser: &LaserDescription, beams: usize, points: &mut Vec<[f64; 2]>) {
    points.clear();
    let [ahead, left, degrees] = laser.mount;
    let step = ranges.len().div_ceil(beams.max(1)).max(1);
    for (beam, range) in (0..).zip(ranges).step_by(step).filter(|(_, range)| range.is_finite()) {
        let angle = degrees.to_radians() + laser.angle_of(beam);
        let range = f64::from(*range);
        points.push([ahead + range * math::cos(angle), left + range * math::sin(angle)]);
    }
}

fn moved(pose: &Pose2, turn: f64, translation: f64) -> Pose2 {
    // Half of the turn before, half after.
    let direction = pose.theta + 0.5 * turn;
    Pose2 {
        x: pose.x + translation * math::cos(direction),
        y: pose.y + translation * math::sin(direction),
        theta: math::wrap_angle(pose.theta + turn),
    }
}
