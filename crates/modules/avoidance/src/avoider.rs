use serde::{Deserialize, Deserializer, Serialize};
use slate_interfaces::{Point2, Pose2, SonarScan, Twist2};
use slate_module::math;

use crate::field::{self, PATH_STEPS, Widths};
use crate::footprint::Footprint;
use crate::map::{LocalMap, on_the_map};
use crate::motion::Surroundings;
use crate::other::Other;
use crate::parameters::Parameters;

/// Decision of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Decision {
    /// The straight path to the goal is free: the planner may drive.
    Clear,
    /// Twist that avoids the obstacles.
    Avoid(Twist2),
}

/// Distance at which the goal counts as reached, meters.
const ARRIVED: f64 = 0.03;
/// Distance from an occupied goal at which the robot waits, meters.
const WAITING: f64 = 0.8;
/// Gain of the approach: velocity per meter to the goal, 1/s.
const APPROACH: f64 = 1.5;
/// Minimum velocity of the approach, m/s.
const CREEP: f64 = 0.05;
/// Minimum progress within the progress timeout, meters.
const PROGRESS: f64 = 0.1;

/// Local planner that leads a robot round obstacles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Avoider {
    footprint: Footprint,
    map: LocalMap,
    /// Present choice; `None` while the path is free.
    choice: Option<[f64; 2]>,
    /// Cells of the present path.
    #[serde(deserialize_with = "deserialize_with_capacity::<_, _, PATH_STEPS>")]
    way: Vec<[i32; 2]>,
    /// Time of the next decision, seconds.
    due: Option<f64>,
    /// True if the wait for an occupied goal has timed out.
    #[serde(default)]
    waited: bool,
    /// Position and time of the newest progress.
    anchor: Option<[f64; 3]>,
    /// Detected robots, and the time of detection.
    #[serde(deserialize_with = "deserialize_with_capacity::<_, _, OTHERS>")]
    others: Vec<Other>,
    seen: Option<f64>,
}

/// Maximum number of other robots.
const OTHERS: usize = 8;

impl Avoider {
    /// Returns an avoider for a robot with a footprint.
    pub fn new(footprint: Footprint) -> Self {
        Self {
            footprint,
            map: LocalMap::default(),
            choice: None,
            way: Vec::with_capacity(PATH_STEPS),
            due: None,
            waited: false,
            anchor: None,
            others: Vec::with_capacity(OTHERS),
            seen: None,
        }
    }

    /// Returns the local map.
    pub fn map(&self) -> &LocalMap {
        &self.map
    }

    /// Updates the map from a scan at `pose` and `time` (seconds).
    pub fn update_map(&mut self, pose: Pose2, scan: &SonarScan, parameters: &Parameters, time: f64) {
        self.map.update(pose, scan, &self.footprint, parameters, time);
    }

    /// Replaces the marks by obstacles of another map at `time` (seconds).
    /// Each obstacle is x, y and the time of its first echo.
    pub fn set_obstacles(&mut self, obstacles: impl Iterator<Item = (f64, f64, f64)>, time: f64) {
        self.map.set(obstacles, time);
    }

    /// Updates the other robots from detections at `time` (seconds).
    /// The first eight are kept until the next detection.
    pub fn set_others(&mut self, others: impl IntoIterator<Item = Other>, time: f64) {
        self.others.clear();
        let known = |other: &Other| {
            let [east, north] = other.velocity;
            on_the_map(other.x, other.y) && (other.radius + east + north).is_finite()
        };
        self.others.extend(others.into_iter().filter(known).take(OTHERS));
        self.seen = Some(time);
    }

    /// Returns whether the straight path to `goal` is free, or a motion to make.
    /// The path begins at `pose`; `time` is in seconds.
    pub fn steer(&mut self, pose: Pose2, goal: Point2, parameters: &Parameters, time: f64) -> Decision {
        self.decide(pose, goal, None, Twist2::ZERO, parameters, time)
    }

    /// Checks a planned twist against the present one; a safe one passes.
    ///
    /// Else the nearest safe twist is taken, and without progress a path round the obstacles to `goal`.
    pub fn guard(
        &mut self,
        pose: Pose2,
        moving: Twist2,
        goal: Point2,
        planned: Option<Twist2>,
        parameters: &Parameters,
        time: f64,
    ) -> Decision {
        let Twist2 { linear, angular } = planned.unwrap_or(Twist2::ZERO);
        match (linear + angular + moving.linear + moving.angular).is_finite() {
            true => self.decide(pose, goal, planned, moving, parameters, time),
            false => self.stand(),
        }
    }

    fn decide(
        &mut self,
        pose: Pose2,
        goal: Point2,
        planned: Option<Twist2>,
        moving: Twist2,
        parameters: &Parameters,
        time: f64,
    ) -> Decision {
        let known = on_the_map(pose.x, pose.y) && pose.theta.is_finite() && on_the_map(goal.x, goal.y);
        let heard = self.map.time().is_some_and(|last| time - last <= parameters.scan_timeout);
        if !(known && heard) {
            return self.stand();
        }
        let (dx, dy) = (goal.x - pose.x, goal.y - pose.y);
        let distance = (dx * dx + dy * dy).sqrt();
        if distance < ARRIVED && planned.is_none() {
            self.choice = None;
            return Decision::Clear;
        }
        let stuck = self.stuck(pose, parameters, time);
        // A stuck robot gets bolder: an echo's arc may block it and no body.
        let margin = if stuck { 0.3 * parameters.min_clearance } else { parameters.min_clearance };
        let due =
            self.due.is_none_or(|due| !(0.0..parameters.decision_period).contains(&(due - 1e-9 - time)));
        if !due && self.choice == Some([0.0, 0.0]) {
            return Decision::Avoid(Twist2::ZERO);
        }
        let sees_others = self.seen.is_some_and(|seen| time - seen <= parameters.obstacle_timeout);
        let others = if sees_others { self.others.as_slice() } else { &[] };
        let footprint = self.footprint.clone();
        let mut surroundings =
            Surroundings::new(&self.map, others, pose, &footprint, parameters, margin, time);
        surroundings.drive = parameters.sides.map(|sides| (sides, moving));
        let bearing = math::angle_between(pose.theta, math::atan2(dy, dx));
        if !due {
            // Between two choices only: is the present one still safe?
            let motion = self.choice.map_or_else(
                || planned.unwrap_or_else(|| straight(bearing, distance, parameters)),
                |[linear, angular]| Twist2 { linear, angular },
            );
            if surroundings.safe(motion) {
                return self.choice.map_or(Decision::Clear, |_| Decision::Avoid(motion));
            }
        }
        self.due = Some(time + parameters.decision_period);
        let clear = match planned {
            Some(motion) => surroundings.safe(motion),
            None => self.clear(&surroundings, bearing, distance, parameters),
        };
        if clear {
            return self.hand_back(planned.is_some());
        }
        let occupied =
            distance < WAITING && self.occupied(goal, footprint.half_width() + parameters.min_clearance);
        let twist = match planned.filter(|_| !stuck) {
            Some(motion) => surroundings.nearest_to(motion),
            None if self.waits(occupied, stuck) => surroundings.face(bearing),
            None => self.detour(&surroundings, &footprint, pose, goal, sees_others),
        };
        self.choice = Some([twist.linear, twist.angular]);
        Decision::Avoid(twist)
    }

    /// Hands the robot back to the planner.
    fn hand_back(&mut self, is_planned: bool) -> Decision {
        self.choice = None;
        self.way.clear();
        if is_planned {
            // A robot that stands as planned makes no progress, and is not stuck.
            self.anchor = None;
        }
        Decision::Clear
    }

    /// Returns true if the robot waits before an occupied goal.
    /// A robot on the goal will leave, so circling round it is of no use. An obstacle that persists stands beside the
    /// goal.
    fn waits(&mut self, occupied: bool, stuck: bool) -> bool {
        self.waited = occupied && (self.waited || stuck);
        occupied && !self.waited
    }

    /// Chooses a twist towards a waypoint round the obstacles.
    fn detour(
        &mut self,
        surroundings: &Surroundings<'_>,
        footprint: &Footprint,
        pose: Pose2,
        goal: Point2,
        sees_others: bool,
    ) -> Twist2 {
        let others = if sees_others { self.others.as_slice() } else { &[] };
        let widths = Widths { blocked: footprint.half_width() + 0.02, tight: footprint.radius() };
        let waypoint = field::waypoint(&self.map, others, pose, goal, widths, 0.6, &mut self.way);
        let last = self.choice.map_or(Twist2::ZERO, |[linear, angular]| Twist2 { linear, angular });
        surroundings.choose(in_frame_of(pose, waypoint), last)
    }

    /// Returns whether the planner can turn to the goal and drive straight.
    fn clear(
        &self,
        surroundings: &Surroundings<'_>,
        bearing: f64,
        distance: f64,
        parameters: &Parameters,
    ) -> bool {
        let more = if self.choice.is_some() { parameters.side_clearance_hysteresis } else { 0.0 };
        let half_width = self.footprint.half_width() + parameters.side_clearance + more;
        let length = math::min(parameters.lookahead_distance, distance) + self.footprint.front() + more;
        surroundings.strip_free(bearing, half_width, length)
            && (bearing.abs() < parameters.heading_tolerance || surroundings.can_turn(bearing))
            && surroundings.safe(straight(bearing, distance, parameters))
    }

    fn occupied(&self, place: Point2, room: f64) -> bool {
        self.map.obstacles().any(|mark| {
            let (dx, dy) = (mark.x - place.x, mark.y - place.y);
            dx * dx + dy * dy < room * room
        })
    }

    /// Stops the robot without a valid pose or scan.
    fn stand(&mut self) -> Decision {
        self.choice = Some([0.0, 0.0]);
        self.due = None;
        Decision::Avoid(Twist2::ZERO)
    }

    fn stuck(&mut self, pose: Pose2, parameters: &Parameters, time: f64) -> bool {
        let [x, y, since] = *self.anchor.get_or_insert([pose.x, pose.y, time]);
        let (dx, dy) = (pose.x - x, pose.y - y);
        if dx * dx + dy * dy > PROGRESS * PROGRESS {
            self.anchor = Some([pose.x, pose.y, time]);
            return false;
        }
        time - since > parameters.progress_timeout
    }
}

/// Deserializes a list with its capacity, so that it does not allocate later.
fn deserialize_with_capacity<'de, D, T, const CAPACITY: usize>(deserializer: D) -> Result<Vec<T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    let mut list = Vec::deserialize(deserializer)?;
    list.reserve_exact(CAPACITY.saturating_sub(list.len()));
    Ok(list)
}

/// Returns the linear velocity (m/s) at a distance (m) from the goal.
/// It is at most `speed`, and low enough to stop with `deceleration` (m/s²).
pub fn approach_speed(speed: f64, distance: f64, deceleration: f64) -> f64 {
    let braking = (2.0 * deceleration * distance).sqrt();
    math::min(speed, math::max(math::min(APPROACH * distance, braking), CREEP))
}

/// Returns a point of the map in the frame of a robot at `pose`.
fn in_frame_of(pose: Pose2, point: Point2) -> Point2 {
    let (dx, dy) = (point.x - pose.x, point.y - pose.y);
    let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
    Point2 { x: cosine * dx + sine * dy, y: cosine * dy - sine * dx }
}

/// Returns the twist of a planner that drives straight to the goal.
fn straight(bearing: f64, distance: f64, parameters: &Parameters) -> Twist2 {
    if bearing.abs() > parameters.heading_tolerance {
        Twist2 {
            linear: 0.0,
            angular: if bearing < 0.0 {
                -parameters.max_angular_velocity
            } else {
                parameters.max_angular_velocity
            },
        }
    } else {
        Twist2 {
            linear: approach_speed(parameters.max_linear_velocity, distance, parameters.deceleration),
            angular: bearing,
        }
    }
}
