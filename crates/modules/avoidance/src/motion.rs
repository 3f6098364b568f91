use slate_interfaces::{Point2, Pose2, Twist2};
use slate_module::math;

use crate::footprint::Footprint;
use crate::look_ahead::{Course, Sides};
use crate::map::LocalMap;
use crate::other::Other;
use crate::parameters::Parameters;

/// Maximum number of obstacles of a decision.
const NEARBY: usize = 192;
/// Time step of a trajectory check, seconds.
const CHECK: f64 = 0.1;
/// Horizon of the comparison of motions, seconds.
const HORIZON: f64 = 0.8;
/// Maximum stopping time of a safe motion, seconds.
const LONGEST: f64 = 5.0;
/// Minimum clearance from obstacles that are within the margin already, meters.
const CLEARANCE_TOLERANCE: f64 = 0.001;

/// Obstacle in the robot's frame.
#[derive(Clone, Copy, Default)]
struct Obstacle {
    x: f64,
    y: f64,
    /// Present distance from the footprint.
    distance: f64,
    /// Maximum speed, in any direction.
    speed: f64,
    /// Measured velocity.
    velocity: Option<[f64; 2]>,
}

/// Obstacles around the robot, in its frame; nearest parts only.
pub(crate) struct Surroundings<'a> {
    footprint: &'a Footprint,
    parameters: &'a Parameters,
    obstacles: [Obstacle; NEARBY],
    count: usize,
    margin: f64,
    pose: Pose2,
    /// Response of the wheels and present twist, if they matter.
    pub(crate) drive: Option<(Sides, Twist2)>,
}

impl<'a> Surroundings<'a> {
    /// Collects the obstacles near a robot at `pose`.
    /// `margin` is the minimum clearance, meters.
    pub(crate) fn new(
        map: &LocalMap,
        others: &[Other],
        pose: Pose2,
        footprint: &'a Footprint,
        parameters: &'a Parameters,
        margin: f64,
        time: f64,
    ) -> Self {
        let mut surroundings = Self {
            footprint,
            parameters,
            obstacles: [Obstacle::default(); NEARBY],
            count: 0,
            margin,
            pose,
            drive: None,
        };
        let mut reach = parameters.lookahead_distance + margin;
        // The nearest always fit.
        for _ in 0..8 {
            if surroundings.gather(map, others, pose, reach, time) {
                break;
            }
            reach *= 0.7;
        }
        surroundings
    }

    /// Collects obstacles within `reach`; fails if they are too many.
    fn gather(&mut self, map: &LocalMap, others: &[Other], pose: Pose2, reach: f64, time: f64) -> bool {
        self.count = 0;
        let (sine, cosine) = (math::sin(pose.theta), math::cos(pose.theta));
        let mut add = |world_x: f64, world_y: f64, speed: f64, velocity: Option<[f64; 2]>| {
            let (dx, dy) = (world_x - pose.x, world_y - pose.y);
            let (x, y) = (cosine * dx + sine * dy, cosine * dy - sine * dx);
            let distance = self.footprint.distance_within(x, y, reach);
            if distance >= reach {
                return true;
            }
            let Some(place) = self.obstacles.get_mut(self.count) else { return false };
            let velocity =
                velocity.map(|[east, north]| [cosine * east + sine * north, cosine * north - sine * east]);
            *place = Obstacle { x, y, distance, speed, velocity };
            self.count += 1;
            true
        };
        // Robots first: none of them may be left out.
        for other in others {
            if !other.outline().all(|(x, y)| add(x, y, 0.0, Some(other.velocity))) {
                return false;
            }
        }
        let other_speed = self.parameters.max_obstacle_speed;
        map.obstacles().all(|mark| {
            let fresh = time - mark.since < self.parameters.new_obstacle_time;
            add(mark.x, mark.y, if fresh { other_speed } else { 0.0 }, None)
        })
    }

    fn obstacles(&self) -> &[Obstacle] {
        &self.obstacles[..self.count]
    }

    /// Returns whether the robot can begin this motion and still stop with clearance.
    pub(crate) fn safe(&self, twist: Twist2) -> bool {
        if let Some((sides, moving)) = self.drive {
            return self.stops_in_time(&sides, moving, twist);
        }
        let parameters = self.parameters;
        let braking = math::max(
            twist.linear.abs() / parameters.deceleration,
            twist.angular.abs() / parameters.angular_deceleration,
        );
        if !(0.0..LONGEST).contains(&(parameters.reaction_time + braking)) {
            return false;
        }
        // Braking covers half of the way that continuing for that time would.
        let time = parameters.reaction_time + 0.5 * braking;
        let steps = (time / CHECK) as u32 + 1;
        (1..=steps).all(|step| {
            let part = f64::from(step) / f64::from(steps);
            let later = part * (parameters.reaction_time + braking);
            self.keeps_off(Path::along(twist, part * time), later)
        })
    }

    /// Returns the result of [`Self::safe`] with twist and response of the wheels.
    fn stops_in_time(&self, sides: &Sides, moving: Twist2, twist: Twist2) -> bool {
        let mut there = Course { pose: Pose2::default(), motion: moving };
        let mut time = 0.0;
        while time < LONGEST {
            let braking = time > self.parameters.reaction_time;
            if braking && there.motion == Twist2::ZERO {
                return true;
            }
            there = sides.after(there, if braking { Twist2::ZERO } else { twist }, CHECK);
            time += CHECK;
            let Pose2 { x, y, theta } = there.pose;
            if !self.keeps_off(Path { x, y, sine: math::sin(theta), cosine: math::cos(theta) }, time) {
                return false;
            }
        }
        false
    }

    /// Returns true if the outline is clear at a future pose.
    /// The pose is in the present frame, in `later` seconds.
    fn keeps_off(&self, path: Path, later: f64) -> bool {
        if self.parameters.room_half_width.is_some_and(|room| !self.stays_within(path, room)) {
            return false;
        }
        let reach = self.margin + self.parameters.max_obstacle_speed * later;
        self.obstacles().iter().all(|obstacle| {
            let seen_from = |x: f64, y: f64| {
                let (dx, dy) = (x - path.x, y - path.y);
                let (x, y) = (path.cosine * dx + path.sine * dy, path.cosine * dy - path.sine * dx);
                self.footprint.distance_within(x, y, reach)
            };
            if let Some([forward, left]) = obstacle.velocity {
                let (x, y) = (obstacle.x + forward * later, obstacle.y + left * later);
                let distance = seen_from(x, y);
                // A robot that comes nearer than the margin would do so to a standing one, too.
                return distance >= self.margin
                    || distance >= self.footprint.distance_within(x, y, reach) - CLEARANCE_TOLERANCE;
            }
            let margin = self.margin + obstacle.speed * later;
            let distance = seen_from(obstacle.x, obstacle.y);
            // The robot must leave moving obstacles at once, and may drive along standing ones.
            let least = if obstacle.speed > 0.0 {
                obstacle.distance + 0.5 * obstacle.speed * later
            } else {
                obstacle.distance - CLEARANCE_TOLERANCE
            };
            distance >= margin || distance >= least
        })
    }

    /// Returns true if the outline at a pose is within the room.
    /// The pose is in the present frame; a pose no farther out than now counts as within.
    fn stays_within(&self, path: Path, room: f64) -> bool {
        let Pose2 { x, y, theta } = self.pose;
        let (sine, cosine) = (math::sin(theta), math::cos(theta));
        let there = Pose2 {
            x: x + cosine * path.x - sine * path.y,
            y: y + sine * path.x + cosine * path.y,
            theta: theta + math::atan2(path.sine, path.cosine),
        };
        let out = |pose: Pose2| {
            let farthest = |most, corner: Point2| math::max(most, math::max(corner.x.abs(), corner.y.abs()));
            self.footprint.corners(pose).fold(0.0, farthest) - room
        };
        let far = out(there);
        far <= 0.0 || far <= out(self.pose) + CLEARANCE_TOLERANCE
    }

    /// Returns whether the robot can turn on the spot by an angle, radians.
    pub(crate) fn can_turn(&self, angle: f64) -> bool {
        let steps = (angle.abs() / 0.15) as u32 + 1;
        (1..=steps).all(|step| {
            let part = angle * f64::from(step) / f64::from(steps);
            self.keeps_off(Path { x: 0.0, y: 0.0, sine: math::sin(part), cosine: math::cos(part) }, 0.0)
        })
    }

    /// Returns true if a strip in a direction is free.
    /// `half_width` is half its width.
    pub(crate) fn strip_free(&self, bearing: f64, half_width: f64, length: f64) -> bool {
        let (sine, cosine) = (math::sin(bearing), math::cos(bearing));
        self.obstacles().iter().all(|obstacle| {
            let along = cosine * obstacle.x + sine * obstacle.y;
            let across = cosine * obstacle.y - sine * obstacle.x;
            along < 0.0 || along > length || across.abs() > half_width
        })
    }

    /// Turns on the spot towards a bearing, if that is safe.
    pub(crate) fn face(&self, bearing: f64) -> Twist2 {
        let limit = self.parameters.max_angular_velocity;
        let twist = Twist2 { linear: 0.0, angular: math::clamp(bearing, -limit, limit) };
        if bearing.abs() > 0.1 && self.safe(twist) { twist } else { Twist2::ZERO }
    }

    /// Returns the best safe motion towards `target`, in the robot's frame.
    pub(crate) fn choose(&self, target: Point2, last: Twist2) -> Twist2 {
        const SPEEDS: [f64; 7] = [0.0, 0.1, 0.25, 0.5, 0.75, 1.0, -1.0];
        const TURNS: [f64; 13] =
            [0.0, 0.08, -0.08, 0.2, -0.2, 0.35, -0.35, 0.5, -0.5, 0.75, -0.75, 1.0, -1.0];
        let parameters = self.parameters;
        let mut best = Twist2::ZERO;
        let mut least = self.cost(best, target, last);
        for speed in SPEEDS {
            let linear = speed
                * if speed < 0.0 { parameters.max_reverse_velocity } else { parameters.max_linear_velocity };
            for turn in TURNS {
                let twist = Twist2 { linear, angular: turn * parameters.max_angular_velocity };
                let cost = self.cost(twist, target, last);
                if cost < least && self.safe(twist) {
                    best = twist;
                    least = cost;
                }
            }
        }
        best
    }

    /// Returns the safe motion nearest to another one.
    pub(crate) fn nearest_to(&self, motion: Twist2) -> Twist2 {
        const SPEEDS: [f64; 9] = [0.0, 0.1, -0.1, 0.25, -0.25, 0.5, -0.5, 1.0, -1.0];
        const TURNS: [f64; 9] = [0.0, 0.15, -0.15, 0.35, -0.35, 0.6, -0.6, 1.0, -1.0];
        let parameters = self.parameters;
        let unlike = |twist: Twist2| {
            (twist.linear - motion.linear).abs() + 0.4 * (twist.angular - motion.angular).abs()
        };
        let mut best = Twist2::ZERO;
        let mut least = unlike(best);
        let slower = [0.75, 0.5, 0.25]
            .map(|part| Twist2 { linear: part * motion.linear, angular: part * motion.angular });
        let others = SPEEDS.iter().flat_map(|speed| TURNS.iter().map(move |turn| (speed, turn)));
        let others = others.map(|(speed, turn)| Twist2 {
            linear: speed * parameters.max_linear_velocity,
            angular: turn * parameters.max_angular_velocity,
        });
        for twist in slower.into_iter().chain(others) {
            let cost = unlike(twist);
            if cost < least && self.safe(twist) {
                best = twist;
                least = cost;
            }
        }
        best
    }

    /// Returns the cost to the target after this motion.
    /// Meters of driving and turning.
    fn cost(&self, twist: Twist2, target: Point2, last: Twist2) -> f64 {
        let path = Path::along(twist, HORIZON);
        let (dx, dy) = (target.x - path.x, target.y - path.y);
        let (ahead, aside) = (path.cosine * dx + path.sine * dy, path.cosine * dy - path.sine * dx);
        let distance = (dx * dx + dy * dy).sqrt();
        let error = math::atan2(aside, ahead).abs();
        let change = (twist.linear - last.linear).abs() + 0.3 * (twist.angular - last.angular).abs();
        let backward = if twist.linear < 0.0 { 0.05 } else { 0.0 };
        distance + 0.3 * error * math::min(1.0, distance / 0.1) + 0.02 * change + backward
    }
}

/// Pose in the present frame of the robot.
#[derive(Clone, Copy)]
struct Path {
    x: f64,
    y: f64,
    sine: f64,
    cosine: f64,
}

impl Path {
    /// Returns the pose after a motion of this duration.
    fn along(twist: Twist2, time: f64) -> Self {
        let turn = twist.angular * time;
        let (sine, cosine) = (math::sin(turn), math::cos(turn));
        let way = twist.linear * time;
        if turn.abs() < 1e-6 {
            return Self { x: way, y: 0.5 * way * turn, sine, cosine };
        }
        let radius = way / turn;
        Self { x: radius * sine, y: radius * (1.0 - cosine), sine, cosine }
    }
}
