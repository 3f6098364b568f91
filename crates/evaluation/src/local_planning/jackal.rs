//! Simulated Jackal among cylinders.

use slate_avoidance::Footprint;
use slate_interfaces::Pose2;
use slate_local_planning::{MotionLimits, MotionState, PlanarVelocity};
use slate_module::{Random, math};

use crate::barn::{BarnWorld, CYLINDER_RADIUS};

/// Half of the robot's length and width, m.
const HALF: [f64; 2] = [0.254, 0.215];
/// Limits of the motors.
/// The robot's own controller allows 20 m/s² and 25 rad/s².
pub const MOTORS: MotionLimits = MotionLimits {
    vx_max: 2.0,
    vx_min: -2.0,
    vy_max: 0.0,
    wz_max: 4.0,
    ax_max: 4.0,
    ax_min: -4.0,
    ay_max: 1.0,
    az_max: 8.0,
};
/// Mount of the laser, x in the robot's frame, m.
const LASER_X: f64 = 0.12;
const BEAMS: usize = 720;
const FIELD_OF_VIEW: f64 = 1.5 * std::f64::consts::PI;
/// Shortest and longest range, and standard deviation of its noise, m.
const RANGES: [f64; 2] = [0.1, 30.0];
const RANGE_STDDEV: f64 = 0.005;
/// Time of a step, s.
const TIME_STEP: f64 = 0.01;

/// Robot with a differential drive, limits of acceleration and a laser.
pub struct Jackal<'a> {
    world: &'a BarnWorld,
    footprint: Footprint,
    random: Random,
    /// Pose and velocity.
    pub state: MotionState,
    /// True if it has touched a cylinder.
    pub has_collided: bool,
    ranges: Vec<f64>,
}

/// Corners of a Jackal's footprint, with a margin all round, m.
pub fn corners(padding: f64) -> [[f64; 2]; 4] {
    let [x, y] = HALF.map(|half| half + padding);
    [[x, y], [-x, y], [-x, -y], [x, -y]]
}

impl<'a> Jackal<'a> {
    /// Places a robot into a world; `None` if its footprint is invalid.
    pub fn new(world: &'a BarnWorld, seed: u64, start: Pose2) -> Option<Self> {
        Some(Self {
            world,
            footprint: Footprint::new(&corners(0.0)).ok()?,
            random: Random::new(seed, &format!("laser in world {}", world.number)),
            state: MotionState { pose: start, velocity: PlanarVelocity::ZERO },
            has_collided: false,
            ranges: Vec::new(),
        })
    }

    /// Returns the pose of the laser.
    pub fn laser(&self) -> Pose2 {
        let Pose2 { x, y, theta } = self.state.pose;
        Pose2 { x: x + LASER_X * math::cos(theta), y: y + LASER_X * math::sin(theta), theta }
    }

    /// Drives at a commanded velocity for a time, s, until it touches something.
    pub fn drive(&mut self, command: PlanarVelocity, seconds: f64) {
        for _ in 0..(seconds / TIME_STEP).round() as usize {
            if self.has_collided {
                return;
            }
            self.state.velocity = MOTORS.apply(self.state.velocity, command, TIME_STEP);
            let pose = &mut self.state.pose;
            let middle = pose.theta + 0.5 * TIME_STEP * self.state.velocity.wz;
            pose.x += TIME_STEP * self.state.velocity.vx * math::cos(middle);
            pose.y += TIME_STEP * self.state.velocity.vx * math::sin(middle);
            pose.theta = math::wrap_angle(pose.theta + TIME_STEP * self.state.velocity.wz);
            self.has_collided = self.touches();
        }
    }

    fn touches(&self) -> bool {
        let Pose2 { x, y, theta } = self.state.pose;
        let (sine, cosine) = (math::sin(theta), math::cos(theta));
        self.world.cylinders.iter().any(|[cylinder_x, cylinder_y]| {
            let (across, up) = (cylinder_x - x, cylinder_y - y);
            let (ahead, aside) = (across * cosine + up * sine, up * cosine - across * sine);
            self.footprint.distance_within(ahead, aside, 2.0 * CYLINDER_RADIUS) <= CYLINDER_RADIUS
        })
    }

    /// Returns bearing and range of each beam that hits a cylinder.
    /// Ranges of all others are the longest range.
    pub fn scan(&mut self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let laser = self.laser();
        self.ranges.clear();
        self.ranges.resize(BEAMS, f64::INFINITY);
        for [x, y] in &self.world.cylinders {
            measure(&mut self.ranges, [x - laser.x, y - laser.y], laser.theta);
        }
        let random = &mut self.random;
        self.ranges.iter().enumerate().map(move |(beam, range)| {
            let noise = RANGE_STDDEV * random.normal();
            let measured = if *range < RANGES[1] { math::max(RANGES[0], range + noise) } else { RANGES[1] };
            (bearing(beam), measured)
        })
    }

    /// Returns true if a range is one of a beam without a hit.
    pub fn is_miss(range: f64) -> bool {
        range >= RANGES[1]
    }
}

fn bearing(beam: usize) -> f64 {
    FIELD_OF_VIEW * (beam as f64 / (BEAMS - 1) as f64 - 0.5)
}

/// Shortens the beams that hit a cylinder, whose middle is relative to the laser.
fn measure(ranges: &mut [f64], [x, y]: [f64; 2], heading: f64) {
    let distance = math::hypot(x, y);
    if distance <= CYLINDER_RADIUS {
        ranges.fill(0.0);
        return;
    }
    let middle = math::angle_between(heading, math::atan2(y, x));
    let half = math::asin(CYLINDER_RADIUS / distance);
    let beam = |angle: f64| (angle / FIELD_OF_VIEW + 0.5) * (BEAMS - 1) as f64;
    let last = beam(middle + half).floor();
    let first = math::max(0.0, beam(middle - half).ceil());
    if last < first {
        return;
    }
    for (at, range) in ranges.iter_mut().enumerate().take(last as usize + 1).skip(first as usize) {
        let angle = bearing(at) - middle;
        let (sine, cosine) = (math::sin(angle), math::cos(angle));
        let aside = distance * sine;
        let square = CYLINDER_RADIUS * CYLINDER_RADIUS - aside * aside;
        if square >= 0.0 {
            *range = math::min(*range, distance * cosine - square.sqrt());
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use super::*;

    fn world(cylinder: [f64; 2]) -> BarnWorld {
        BarnWorld { number: 0, cylinders: vec![cylinder], path_length: 10.0 }
    }

    #[test]
    fn a_robot_collides_where_its_footprint_touches() {
        let forward = PlanarVelocity { vx: 0.5, vy: 0.0, wz: 0.0 };
        let end = |cylinder: [f64; 2]| {
            let world = world(cylinder);
            let mut robot = Jackal::new(&world, 1, Pose2 { x: 0.0, y: 0.0, theta: 0.0 }).unwrap();
            robot.drive(forward, 4.0);
            (robot.has_collided, robot.state.pose.x)
        };
        // The front is 0.254 m before the robot's middle, the rim 0.075 m before the cylinder's.
        let (has_collided, x) = end([1.0, 0.1]);
        assert!(has_collided && (x - 0.671).abs() < 0.006, "{x}");
        assert!(end([1.0, 0.289]).0 && !end([1.0, 0.291]).0);
    }

    #[test]
    fn a_beam_ends_at_the_rim_of_a_cylinder() {
        let world = world([3.0, 0.0]);
        let mut robot = Jackal::new(&world, 1, Pose2 { x: 0.0, y: 0.0, theta: 0.0 }).unwrap();
        let hits: Vec<(f64, f64)> = robot.scan().filter(|(_, range)| !Jackal::is_miss(*range)).collect();
        // The cylinder is 0.052 rad wide, seen from the laser.
        assert!((7..=8).contains(&hits.len()), "{hits:?}");
        for (bearing, range) in hits {
            let aside = 2.88 * math::sin(bearing);
            let rim = 2.88 * math::cos(bearing) - (0.075 * 0.075 - aside * aside).sqrt();
            assert!((range - rim).abs() < 0.025, "{bearing} {range} {rim}");
        }
    }

    #[test]
    fn a_command_is_followed_within_what_the_motors_can_do() {
        let world = world([50.0, 50.0]);
        let mut robot = Jackal::new(&world, 1, Pose2 { x: 0.0, y: 0.0, theta: 0.0 }).unwrap();
        robot.drive(PlanarVelocity { vx: 9.0, vy: 0.0, wz: 0.0 }, 0.25);
        assert!((robot.state.velocity.vx - 1.0).abs() < 1e-9, "{:?}", robot.state);
        robot.drive(PlanarVelocity { vx: 9.0, vy: 0.0, wz: 0.0 }, 1.0);
        assert!((robot.state.velocity.vx - 2.0).abs() < 1e-9, "{:?}", robot.state);
    }
}
