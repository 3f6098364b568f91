use serde::{Deserialize, Deserializer, Serialize};
use slate_interfaces::{Point2, Pose2, SonarScan, Twist2};
use slate_module::math;

use crate::field::{self, LONG, Widths};
use crate::footprint::Footprint;
use crate::map::{LocalMap, on_the_map};
use crate::motion::Surroundings;
use crate::parameters::Parameters;

/// What to do now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Decision {
    /// The straight way to the goal is free: whoever plans may drive.
    Clear,
    /// Do this instead.
    Avoid(Twist2),
}

/// Nearer than this the goal counts as reached, metres.
const ARRIVED: f64 = 0.03;
/// So near to an occupied goal the robot waits, metres.
const WAITING: f64 = 0.8;
/// Speed per metre that is left to the goal, 1/s.
const APPROACH: f64 = 1.5;
/// But no slower than this, m/s.
const CREEP: f64 = 0.05;
/// Less than this in the time of the patience is no progress, metres.
const PROGRESS: f64 = 0.1;

/// Leads a robot round what its sonars hear.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Avoider {
    footprint: Footprint,
    map: LocalMap,
    /// Present choice; none while the way is clear.
    choice: Option<[f64; 2]>,
    /// Cells of the way that is followed.
    #[serde(deserialize_with = "with_room::<_, _, LONG>")]
    way: Vec<[i32; 2]>,
    /// When the next choice is due, seconds.
    due: Option<f64>,
    /// Whether it has waited long enough for who seems to stand on the goal.
    #[serde(default)]
    waited: bool,
    /// Where the robot last made progress, and when.
    anchor: Option<[f64; 3]>,
    /// Other robots that are seen, and when.
    #[serde(deserialize_with = "with_room::<_, _, OTHERS>")]
    others: Vec<Other>,
    seen: Option<f64>,
}

/// Another robot, as a disc.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Other {
    /// In the world, metres.
    pub x: f64,
    /// In the world, metres.
    pub y: f64,
    /// Metres.
    pub radius: f64,
    /// How it moves in the world, m/s.
    pub velocity: [f64; 2],
}

impl Other {
    /// Points of its outline, near enough to each other that nothing fits between.
    pub(crate) fn outline(&self) -> impl Iterator<Item = (f64, f64)> {
        let Self { x, y, radius, .. } = *self;
        ROUND.iter().map(move |(east, north)| (x + east * radius, y + north * radius))
    }
}

/// Points of a circle of radius 1.
const ROUND: [(f64, f64); 12] = [
    (1.0, 0.0),
    (0.866, 0.5),
    (0.5, 0.866),
    (0.0, 1.0),
    (-0.5, 0.866),
    (-0.866, 0.5),
    (-1.0, 0.0),
    (-0.866, -0.5),
    (-0.5, -0.866),
    (0.0, -1.0),
    (0.5, -0.866),
    (0.866, -0.5),
];

/// So many other robots are looked at.
const OTHERS: usize = 8;

impl Avoider {
    /// For a robot of that outline that has heard nothing yet.
    pub fn new(footprint: Footprint) -> Self {
        Self {
            footprint,
            map: LocalMap::default(),
            choice: None,
            way: Vec::with_capacity(LONG),
            due: None,
            waited: false,
            anchor: None,
            others: Vec::with_capacity(OTHERS),
            seen: None,
        }
    }

    /// What it remembers.
    pub fn map(&self) -> &LocalMap {
        &self.map
    }

    /// Takes in what the sonars heard when the robot was at `pose` at `time` (seconds).
    pub fn hear(&mut self, pose: Pose2, scan: &SonarScan, parameters: &Parameters, time: f64) {
        self.map.update(pose, scan, &self.footprint, parameters, time);
    }

    /// Takes in which other robots are seen at `time` (seconds), the first eight of them: Until it sees
    /// again, they are taken to be there.
    pub fn see(&mut self, others: impl IntoIterator<Item = Other>, time: f64) {
        self.others.clear();
        let known = |other: &Other| {
            let [east, north] = other.velocity;
            on_the_map(other.x, other.y) && (other.radius + east + north).is_finite()
        };
        self.others.extend(others.into_iter().filter(known).take(OTHERS));
        self.seen = Some(time);
    }

    /// Says whether the straight way from `pose` to `goal` is free at `time` (seconds), and else how to move.
    pub fn steer(&mut self, pose: Pose2, goal: Point2, parameters: &Parameters, time: f64) -> Decision {
        self.decide(pose, goal, None, Twist2::ZERO, parameters, time)
    }

    /// The same for a robot that is `moving`, and whose Plan says what it is about to do: a planned motion is left alone
    /// when it is safe. Else the robot moves as nearly like it as is safe, and when that does not help, round what is in the
    /// way to `goal`.
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
        let heard = self.map.time().is_some_and(|last| time - last <= parameters.scan_age);
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
        // Who got stuck gets bolder: what blocks it may be an echo's arc and not a thing.
        let margin = if stuck { 0.3 * parameters.margin } else { parameters.margin };
        let due = self.due.is_none_or(|due| !(0.0..parameters.period).contains(&(due - 1e-9 - time)));
        if !due && self.choice == Some([0.0, 0.0]) {
            return Decision::Avoid(Twist2::ZERO);
        }
        let seen = self.seen.is_some_and(|seen| time - seen <= parameters.memory);
        let others = if seen { self.others.as_slice() } else { &[] };
        let mut surroundings =
            Surroundings::new(&self.map, others, pose, &self.footprint, parameters, margin, time);
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
        self.due = Some(time + parameters.period);
        let clear = match planned {
            Some(motion) => surroundings.safe(motion),
            None => self.clear(&surroundings, bearing, distance, parameters),
        };
        if clear {
            self.choice = None;
            self.way.clear();
            if planned.is_some() {
                // Who stands as planned makes no progress, and is not stuck.
                self.anchor = None;
            }
            return Decision::Clear;
        }
        if let Some(motion) = planned.filter(|_| !stuck) {
            let twist = surroundings.nearest_to(motion);
            self.choice = Some([twist.linear, twist.angular]);
            return Decision::Avoid(twist);
        }
        let half_width = self.footprint.half_width();
        let occupied = distance < WAITING && self.occupied(goal, half_width + parameters.margin);
        self.waited = occupied && (self.waited || stuck);
        if occupied && !self.waited {
            // Whoever stands on the goal will leave: no use in circling round it. What is still there after a while
            // stands beside it.
            let twist = surroundings.face(bearing);
            self.choice = Some([twist.linear, twist.angular]);
            return Decision::Avoid(twist);
        }
        let widths = Widths { blocked: half_width + 0.02, tight: self.footprint.radius() };
        let target = field::waypoint(&self.map, others, pose, goal, widths, 0.6, &mut self.way);
        let (dx, dy) = (target.x - pose.x, target.y - pose.y);
        let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
        let target = Point2 { x: cosine * dx + sine * dy, y: cosine * dy - sine * dx };
        let last = self.choice.map_or(Twist2::ZERO, |[linear, angular]| Twist2 { linear, angular });
        let twist = surroundings.choose(target, last);
        self.choice = Some([twist.linear, twist.angular]);
        Decision::Avoid(twist)
    }

    /// Whether the planner can be let drive: turn towards the goal, then straight on.
    fn clear(
        &self,
        surroundings: &Surroundings<'_>,
        bearing: f64,
        distance: f64,
        parameters: &Parameters,
    ) -> bool {
        let more = if self.choice.is_some() { parameters.side_room_hysteresis } else { 0.0 };
        let half_width = self.footprint.half_width() + parameters.side_room + more;
        let length = math::min(parameters.look_ahead, distance) + self.footprint.front() + more;
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

    /// Without knowing where it is or what is near, the robot does not move.
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
        time - since > parameters.patience
    }
}

/// Lists keep their room, so that they need no more when they go on.
fn with_room<'de, D, T, const ROOM: usize>(deserializer: D) -> Result<Vec<T>, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de>,
{
    let mut list = Vec::deserialize(deserializer)?;
    list.reserve_exact(ROOM.saturating_sub(list.len()));
    Ok(list)
}

/// How fast (m/s) a robot goes that far (metres) from its goal, at most at `speed` (m/s): slower at the end, and so that it
/// can brake with that deceleration (m/s²).
pub fn approach_speed(speed: f64, distance: f64, deceleration: f64) -> f64 {
    let braking = (2.0 * deceleration * distance).sqrt();
    math::min(speed, math::max(math::min(APPROACH * distance, braking), CREEP))
}

/// What a planner does that goes straight to the goal when it is let drive.
fn straight(bearing: f64, distance: f64, parameters: &Parameters) -> Twist2 {
    if bearing.abs() > parameters.heading_tolerance {
        Twist2 {
            linear: 0.0,
            angular: if bearing < 0.0 { -parameters.turn_rate } else { parameters.turn_rate },
        }
    } else {
        Twist2 {
            linear: approach_speed(parameters.speed, distance, parameters.deceleration),
            angular: bearing,
        }
    }
}
