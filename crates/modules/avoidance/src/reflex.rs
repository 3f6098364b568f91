//! Memoryless avoidance: a turn in place and a straight drive from rules.
//! It uses the newest measurements alone.

use serde::{Deserialize, Serialize};
use slate_interfaces::{Pose2, SonarScan, Twist2};
use slate_module::{Sequence, Text, interface, math};

use crate::footprint::Footprint;

/// Name of the ring of sonars in a robot model.
pub const SONAR: &str = "sonar";
/// Name of the sensor that detects robots in a robot model.
pub const ROBOT_SENSOR: &str = "robot_sensor";
/// Greatest distance of a rule, meters.
pub const MAX_DISTANCE: f64 = 10.0;

/// Threshold of a sensor.
#[interface]
#[derive(PartialEq)]
pub struct SensorRule {
    /// Distance ahead of the robot's front below which it reacts.
    #[unit("m")]
    pub distance: f64,
    /// Name of the sensor in the robot model.
    pub sensor: Text<28>,
}

/// Rules of the reflex that avoids obstacles.
#[interface]
#[derive(PartialEq)]
pub struct ReflexRules {
    /// Additional distance per speed.
    #[unit("s")]
    pub reaction_time: f64,
    /// Clearance on both sides of the strip ahead that must be free.
    #[unit("m")]
    pub side_clearance: f64,
    /// Distance of any echo from the outline below which it reacts.
    #[unit("m")]
    pub min_clearance: f64,
    /// Free length of a heading that it turns to.
    #[unit("m")]
    pub free_distance: f64,
    /// Additional clearance on both sides of such a heading.
    #[unit("m")]
    pub turn_clearance: f64,
    /// Length of the drive after the turn.
    #[unit("m")]
    pub drive_distance: f64,
    /// Linear velocity of that drive.
    #[unit("m/s")]
    pub linear_velocity: f64,
    /// Clearance from another robot below which no drive comes nearer.
    /// The other robot moves meanwhile. At most 0.3 m count.
    #[unit("m")]
    pub robot_clearance: f64,
    /// Clearance from another robot in a turn in place, meters.
    #[unit("m")]
    pub robot_turn_clearance: f64,
    /// Thresholds of the sensors.
    /// Without one for the sonars the robot stops; another sensor without one causes no reflex.
    pub sensors: Sequence<SensorRule, 4>,
}

impl ReflexRules {
    /// Returns the threshold of a sensor, meters.
    pub fn distance(&self, sensor: &str) -> Option<f64> {
        self.sensors.iter().find(|rule| rule.sensor.as_str() == sensor).map(|rule| rule.distance)
    }

    /// Checks the thresholds of a robot whose model lists these sensors.
    ///
    /// # Errors
    /// The list is empty, or number and sensor of the first rule with a distance out of its range, a sensor of an earlier rule,
    /// or one that the robot lacks.
    pub fn check(&self, listed: &[&str]) -> Result<(), RuleError> {
        if self.sensors.is_empty() {
            return Err(RuleError::Empty);
        }
        for (index, rule) in self.sensors.iter().enumerate() {
            let (number, sensor) = (index + 1, rule.sensor);
            if let Some(first) = self.sensors[..index].iter().position(|other| other.sensor == sensor) {
                return Err(RuleError::Twice { number, first: first + 1, sensor });
            }
            if !(0.0..=MAX_DISTANCE).contains(&rule.distance) {
                return Err(RuleError::Distance { number, sensor, distance: rule.distance });
            }
            if !listed.contains(&sensor.as_str()) {
                return Err(RuleError::Sensor { number, sensor });
            }
        }
        Ok(())
    }
}

/// Reason why a rule is invalid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RuleError {
    /// Rule without a threshold.
    Empty,
    /// Two rules for one sensor.
    Twice {
        /// Number of the second rule, from 1.
        number: usize,
        /// Number of the first rule.
        first: usize,
        /// Their sensor.
        sensor: Text<28>,
    },
    /// Distance out of range.
    Distance {
        /// Number of the rule, from 1.
        number: usize,
        /// Sensor of the rule.
        sensor: Text<28>,
        /// Distance of the rule, meters.
        distance: f64,
    },
    /// Sensor that the robot model does not list.
    Sensor {
        /// Number of the rule, from 1.
        number: usize,
        /// Sensor of the rule.
        sensor: Text<28>,
    },
}

impl RuleError {
    /// Returns the index of the rule, from 0; `None` for an empty list.
    pub fn index(&self) -> Option<usize> {
        match self {
            Self::Empty => None,
            Self::Twice { number, .. } | Self::Distance { number, .. } | Self::Sensor { number, .. } => {
                Some(number - 1)
            }
        }
    }
}

impl std::fmt::Display for RuleError {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Empty => formatter.write_str(
                "expected a rule such as { sensor = \"sonar\", distance = 0.1 }, found none; disable the reflex if it is to have none",
            ),
            Self::Twice { first, sensor, .. } => write!(
                formatter,
                "`sensor_rules.{}` is of the sensor `{sensor}` already; keep one of the two",
                first - 1
            ),
            Self::Distance { sensor, distance, .. } => write!(
                formatter,
                "expected a distance of the sensor `{sensor}` from 0 to {MAX_DISTANCE} m, found {distance}; choose one of these, such as 0.1"
            ),
            Self::Sensor { sensor, .. } => {
                write!(formatter, "no reflex of this robot has a threshold for a sensor `{sensor}`")
            }
        }
    }
}

impl std::error::Error for RuleError {}

/// Turn on the spot, and a straight drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Maneuver {
    /// Turn, radians, counter-clockwise.
    pub angle: f64,
    /// Linear velocity of the drive, m/s; negative backward.
    pub linear: f64,
    /// Duration of the drive, seconds.
    pub duration: f64,
}

impl Maneuver {
    /// Stop for a moment.
    pub const STOP: Self = Self { angle: 0.0, linear: 0.0, duration: STAND };
}

/// Detected robot as a disc in the robot's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disc {
    /// x, meters.
    pub x: f64,
    /// y, meters.
    pub y: f64,
    /// Radius, meters.
    pub radius: f64,
}

/// Duration of a stop unless it is renewed, seconds.
const STAND: f64 = 0.2;
/// Factor on the minimum range for an echo at that range.
/// Its obstacle is at the minimum range or nearer.
const NEAREST: f64 = 0.3;
/// Tolerance of an echo from a detected robot, meters.
const SPREAD: f64 = 0.1;
/// Points on the arc of an echo.
const ARC: usize = 5;
/// Maximum number of points: those of 16 sonars.
const POINTS: usize = 16 * ARC;
/// Maximum number of robots.
const ROBOTS: usize = 8;
/// Speed above which the robot drives towards obstacles ahead or behind, m/s.
const MOVING: f64 = 0.02;
/// Angular velocity above which the robot turns, rad/s.
const TURNING: f64 = 0.02;
/// Distance beyond which a clearance makes no difference, meters.
const MAX_CLEARANCE: f64 = 0.3;
/// Step between headings, radians.
const HEADING_STEP: f64 = 0.12;
/// Cost of a missing clearance, rad/m.
const GAIN: f64 = 10.0;
/// Costs of a short drive and of backing, radians.
const SHORT: f64 = 1.0;
const BACKWARD: f64 = 1.5;
/// Short drives as a part of the whole one.
const PART: f64 = 0.4;
/// Cost advantage of a left turn, radians.
/// Of two equal turns the same one is then chosen again.
const LEFT: f64 = 0.05;
/// Clearance beyond the minimum at which a drive should end, meters.
const CLEARANCE_MARGIN: f64 = 0.05;
/// Clearance that a motion may lose to an obstacle that is too near, meters.
const CLEARANCE_TOLERANCE: f64 = 0.003;

/// Measurements of a tick, in the robot's frame.
#[derive(Clone, Copy, Debug)]
pub struct ReflexInput {
    points: [(f64, f64); POINTS],
    count: usize,
    robots: [Disc; ROBOTS],
    seen: usize,
    /// Twist of the robot.
    twist: Twist2,
}

impl ReflexInput {
    /// Reads the echoes as points on their arcs, detected robots and the twist.
    /// Echoes of detected robots are left out.
    ///
    /// An echo at the minimum range, or without a range, counts as nearer than that.
    pub fn new(scan: &SonarScan, robots: impl Iterator<Item = Disc>, twist: Twist2) -> Self {
        let mut measured = Self {
            points: [(0.0, 0.0); POINTS],
            count: 0,
            robots: [Disc::default(); ROBOTS],
            seen: 0,
            twist: if (twist.linear + twist.angular).is_finite() { twist } else { Twist2::ZERO },
        };
        for robot in robots.filter(|robot| (robot.x + robot.y).is_finite()).take(ROBOTS) {
            measured.robots[measured.seen] = robot;
            measured.seen += 1;
        }
        let half = 0.5 * scan.field_of_view;
        for (placement, echo) in scan.placements.iter().zip(scan.echoes.iter()) {
            let is_far = echo.range.is_finite() && echo.range > scan.range_min;
            let range = if is_far { echo.range } else { NEAREST * scan.range_min };
            if !echo.heard.get()
                || measured.is_echo_of_robot([placement.x, placement.y, placement.theta], range, half)
            {
                continue;
            }
            for step in 0..ARC {
                let angle = placement.theta + half * (2.0 * step as f64 / (ARC - 1) as f64 - 1.0);
                let (x, y) = (placement.x + range * math::cos(angle), placement.y + range * math::sin(angle));
                if !is_disproved(scan, x, y) && measured.count < POINTS {
                    measured.points[measured.count] = (x, y);
                    measured.count += 1;
                }
            }
        }
        measured
    }

    fn is_echo_of_robot(&self, [x, y, theta]: [f64; 3], range: f64, half: f64) -> bool {
        self.robots[..self.seen].iter().any(|robot| {
            let (dx, dy) = (robot.x - x, robot.y - y);
            let distance = math::hypot(dx, dy);
            let aside = math::angle_between(theta, math::atan2(dy, dx)).abs();
            let wide = math::atan2(robot.radius, distance) + half;
            aside <= wide && (range - distance).abs() <= robot.radius + SPREAD
        })
    }

    fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.points[..self.count].iter().copied()
    }

    /// Returns the least distances of robots in the driving strip and overall.
    /// The strip is that of the present motion, forward or backward; the second distance is from the outline.
    fn robot_distances(&self, footprint: &Footprint, half_width: f64) -> (f64, f64) {
        let back = 2.0 * footprint.center() - footprint.front();
        let (direction, end) = if self.twist.linear < 0.0 { (-1.0, -back) } else { (1.0, footprint.front()) };
        self.robots[..self.seen].iter().fold((f64::INFINITY, f64::INFINITY), |(ahead, near), robot| {
            let Disc { x, y, radius } = *robot;
            let side = math::max(0.0, y.abs() - half_width);
            let is_ahead = x * direction > 0.0 && side < radius;
            let along = x * direction - math::max(0.0, radius * radius - side * side).sqrt() - end;
            (
                if is_ahead { math::min(ahead, along) } else { ahead },
                math::min(near, footprint.distance(x, y) - radius),
            )
        })
    }

    /// Returns true if the robot comes too near to another in the reaction time.
    /// It moves at its present twist.
    fn approaches_robot(&self, footprint: &Footprint, rules: &ReflexRules) -> bool {
        let Twist2 { linear, angular } = self.twist;
        if linear.abs() <= MOVING && angular.abs() <= TURNING {
            return false;
        }
        let now = self.robot_clearance(footprint, Pose2::default());
        [0.25, 0.5, 0.75, 1.0].into_iter().any(|part| {
            let time = part * rules.reaction_time;
            let (way, turn) = (time * linear, time * angular);
            let (x, y) = (way * math::cos(0.5 * turn), way * math::sin(0.5 * turn));
            let then = self.robot_clearance(footprint, Pose2 { x, y, theta: turn });
            then < rules.robot_clearance && then < now - CLEARANCE_TOLERANCE
        })
    }

    /// Returns true if a turn in place (rad) ends nearer to a robot than allowed.
    /// The end must be nearer than the robot is now.
    fn turn_meets_robot(&self, footprint: &Footprint, rules: &ReflexRules, angle: f64) -> bool {
        let then = self.robot_clearance(footprint, Pose2 { theta: angle, ..Pose2::default() });
        then < rules.robot_turn_clearance
            && then < self.robot_clearance(footprint, Pose2::default()) - CLEARANCE_TOLERANCE
    }

    /// Returns the clearance of other robots from the outline at a pose.
    /// The pose is in the robot's frame.
    fn robot_clearance(&self, footprint: &Footprint, pose: Pose2) -> f64 {
        let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
        self.robots[..self.seen].iter().fold(MAX_CLEARANCE, |least, robot| {
            let (dx, dy) = (robot.x - pose.x, robot.y - pose.y);
            let (along, across) = (cosine * dx + sine * dy, cosine * dy - sine * dx);
            math::min(
                least,
                footprint.distance_within(along, across, MAX_CLEARANCE + robot.radius) - robot.radius,
            )
        })
    }

    /// Returns the clearance of the echoes after a turn (rad) and a drive (m).
    fn clearance(&self, footprint: &Footprint, angle: f64, way: f64) -> f64 {
        let (sine, cosine) = (math::sin(angle), math::cos(angle));
        self.points().fold(MAX_CLEARANCE, |least, (x, y)| {
            let (along, across) = (cosine * x + sine * y - way, cosine * y - sine * x);
            math::min(least, footprint.distance_within(along, across, MAX_CLEARANCE))
        })
    }

    /// Returns the free length along a heading with this clearance at the sides.
    fn free_length(&self, footprint: &Footprint, angle: f64, clearance: f64) -> f64 {
        let (sine, cosine) = (math::sin(angle), math::cos(angle));
        let half_width = footprint.half_width() + clearance;
        self.points().fold(f64::INFINITY, |least, (x, y)| {
            let (along, across) = (cosine * x + sine * y, cosine * y - sine * x);
            if along <= 0.0 || across.abs() >= half_width {
                return least;
            }
            let inside = math::max(0.0, across.abs() - clearance);
            math::min(least, along - footprint.front_at(inside))
        })
    }
}

/// Returns whether another sonar measures a longer range through a point.
fn is_disproved(scan: &SonarScan, x: f64, y: f64) -> bool {
    let edge = 0.5 * scan.field_of_view - 0.02;
    scan.placements.iter().zip(scan.echoes.iter()).any(|(placement, echo)| {
        let (dx, dy) = (x - placement.x, y - placement.y);
        let range = if echo.heard.get() { echo.range } else { scan.range_max };
        math::hypot(dx, dy) < range - 0.04
            && math::angle_between(placement.theta, math::atan2(dy, dx)).abs() < edge
    })
}

/// Maps measurements to a maneuver by rules; `None` while nothing is near.
///
/// It reacts to an echo in the strip that the robot covers when it drives straight on, nearer than the sonars' threshold,
/// and to any echo that almost touches. Then it chooses, of the turns on the spot that touch nothing, the least one to a free
/// heading. It stops where no maneuver is safe, and for other robots in its way or within the sweep of its outline, which
/// move on; while it stands or moves away from them, they cause no reflex.
pub fn react(rules: &ReflexRules, footprint: &Footprint, measured: &ReflexInput) -> Option<Maneuver> {
    if let Some(distance) = rules.distance(ROBOT_SENSOR) {
        let (ahead, near) =
            measured.robot_distances(footprint, footprint.half_width() + rules.side_clearance);
        let speed = measured.twist.linear.abs();
        let is_near = ahead < distance + speed * rules.reaction_time;
        if speed > MOVING && (is_near || near < rules.min_clearance) {
            return Some(Maneuver::STOP);
        }
        if measured.approaches_robot(footprint, rules) {
            return Some(Maneuver::STOP);
        }
    }
    let Some(distance) = rules.distance(SONAR) else { return Some(Maneuver::STOP) };
    let distance = distance + measured.twist.linear.abs() * rules.reaction_time;
    let near = measured.clearance(footprint, 0.0, 0.0);
    if measured.free_length(footprint, 0.0, rules.side_clearance) >= distance && near >= rules.min_clearance {
        return None;
    }
    let mut best = (f64::INFINITY, Maneuver::STOP);
    for side in [1.0, -1.0] {
        // Least clearance in the turn so far.
        let mut least = near;
        for number in 0..=(std::f64::consts::PI / HEADING_STEP) as u32 {
            let angle = side * f64::from(number) * HEADING_STEP;
            least = math::min(least, measured.clearance(footprint, angle, 0.0));
            if measured.turn_meets_robot(footprint, rules, angle) {
                break;
            }
            if least < math::min(0.5 * rules.min_clearance, near - CLEARANCE_TOLERANCE) {
                break;
            }
            for part in [1.0, PART, -PART] {
                let Some(cost) = drive_cost(rules, footprint, measured, angle, part, near) else { continue };
                let cost = cost + angle.abs() - if side > 0.0 { LEFT } else { 0.0 };
                if cost < best.0 {
                    let linear = part.signum() * rules.linear_velocity;
                    let duration = part.abs() * rules.drive_distance / rules.linear_velocity;
                    best = (cost, Maneuver { angle, linear, duration });
                }
            }
        }
    }
    Some(best.1)
}

/// Returns the cost of a part of the drive after a turn; `None` if unsafe.
/// A negative part is driven backward.
fn drive_cost(
    rules: &ReflexRules,
    footprint: &Footprint,
    measured: &ReflexInput,
    angle: f64,
    part: f64,
    near: f64,
) -> Option<f64> {
    let wide = rules.side_clearance + rules.turn_clearance;
    if part > 0.0 && measured.free_length(footprint, angle, wide) < part * rules.free_distance {
        return None;
    }
    let way = part * rules.drive_distance;
    let mut end = MAX_CLEARANCE;
    for share in [0.25, 0.5, 0.75, 1.0] {
        end = measured.clearance(footprint, angle, share * way);
        if end < math::min(rules.min_clearance, near - CLEARANCE_TOLERANCE) {
            return None;
        }
    }
    let missing = math::max(0.0, rules.min_clearance + CLEARANCE_MARGIN - end);
    let short = if part < 1.0 { SHORT } else { 0.0 };
    let backward = if part < 0.0 { BACKWARD } else { 0.0 };
    Some(GAIN * missing + short + backward)
}
