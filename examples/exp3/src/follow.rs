//! R3's behaviour: after R2 at a safe distance, by how far and how misaligned it is (section 6.5 of the paper), with a look
//! at the next seconds.

use serde::{Deserialize, Serialize};
use slate_avoidance::{Course, Footprint, LOOKS, Sides};
use slate_plugin::interfaces::{Point2, Pose2, Sightings, Twist2};
use slate_plugin::prelude::*;
use slate_wheeled::actions::{SetWheelSpeed, Speeds};
use slate_wheeled::knowledge::WheeledModel;
use slate_wheeled::locate_robot::Located;
use slate_wheeled::own_motion::OwnMotion;
use slate_wheeled::tracks::Tracks;

use crate::outlook::{Moving, Outlook};

/// Percepts, knowledge and outputs of the Plan.
#[ports]
pub struct FollowNoticing {
    leader: Noticed<Located>,
    /// Robots that it sees.
    #[stale(after = "500ms")]
    robots: Input<Sightings>,
    /// The robot's body, from its knowledge.
    robot: Required<WheeledModel>,
    /// Present goal.
    goal: Output<Point2>,
    /// Intended twist.
    motion: Output<Twist2>,
}

/// Parameters of [`FollowPlanner`].
#[params]
pub struct FollowParams {
    #[param(default = 1.2, range = 0.1..=100.0, unit = "m", doc = "distance to keep from the leader")]
    following_distance: f64,
    #[param(default = 0.6, range = 0.0..=1.5, unit = "m/s", doc = "maximum linear velocity")]
    max_linear_velocity: f64,
    #[param(default = 1.5, range = 0.0..=10.0, unit = "1/s", doc = "linear velocity per metre of distance error")]
    distance_gain: f64,
    #[param(default = 2.0, range = 0.0..=10.0, unit = "1/s", doc = "angular velocity per radian of bearing error")]
    bearing_gain: f64,
    #[param(default = 1.2, range = 0.0..=3.0, unit = "rad/s", doc = "maximum angular velocity")]
    max_angular_velocity: f64,
    #[param(default = 2.38, range = 0.0..=1000.0, unit = "m", doc = "half the side of a known square room about the origin")]
    room_half_width: f64,
    #[param(default = 0.28, range = 0.0..=10.0, unit = "m", doc = "radius of other robots")]
    other_robot_radius: f64,
    #[param(default = 3.2, range = 0.0..=60.0, unit = "s", doc = "prediction horizon at speed; 0 for a law of distance and bearing without other robots")]
    prediction_horizon: f64,
    #[param(default = 0.1, range = 0.0..=10.0, unit = "m", doc = "minimum clearance from other robots")]
    min_clearance: f64,
}

/// State of the Plan.
#[derive(Default, Serialize, Deserialize)]
pub struct FollowMemory {
    /// Where the leader is in the world, or was when it was seen last.
    leader: Option<(f64, f64)>,
    /// Velocity then, m/s.
    velocity: [f64; 2],
    /// When it was seen last, seconds.
    seen: f64,
    others: Tracks,
    footprint: Option<Footprint>,
    motion: OwnMotion,
    /// Intended twist: m/s and rad/s.
    wants: (f64, f64),
    /// When it looks ahead again, seconds.
    due: f64,
}

/// Bearing of the leader above which it does not drive forward, radians.
const MISALIGNED: f64 = 0.8;
/// Duration of a plan unless it is renewed, seconds.
const HOLD: f64 = 0.5;
/// Time between two looks ahead, seconds.
const PERIOD: f64 = 0.1;
/// Time that a lost leader is followed, seconds.
const PATIENCE: f64 = 30.0;
/// Time without detection after which a robot counts as hidden, seconds.
const GLANCE: f64 = 0.5;
/// Time that a hidden robot is predicted at constant velocity, seconds.
const GOES_ON: f64 = 2.0;
/// A track this near to the leader is the leader's, metres.
const SAME: f64 = 0.3;
/// Motions to begin with: parts of the highest speed, and of the highest rate of turn.
const SPEEDS: [f64; 6] = [0.0, 0.35, -0.35, 0.7, 1.0, -0.8];
const TURNS: [f64; 7] = [0.0, 0.2, -0.2, 0.5, -0.5, 1.0, -1.0];
/// Motions that may come after.
const LATER_SPEEDS: [f64; 4] = [0.0, 0.5, 1.0, -0.8];
const LATER_TURNS: [f64; 5] = [0.0, 0.4, -0.4, 1.0, -1.0];
/// Cost of a change of twist, per m/s and per rad/s.
const CHANGE: [f64; 2] = [0.05, 0.02];

/// Who is slower than this (m/s) looks so much farther ahead, but no more than so many times.
const BRISK: f64 = 0.6;
const SLOWEST: f64 = 5.0;

/// Follows another robot.
pub struct FollowPlanner;

impl Plan for FollowPlanner {
    const NAME: &'static str = "follow_planner";
    const DOC: &'static str = "Follows another robot at a safe distance.";
    type Noticed = FollowNoticing;
    type Params = FollowParams;
    type State = FollowMemory;

    fn run(
        memory: &mut FollowMemory,
        noticed: &FollowNoticing,
        situation: &Situation<'_>,
        params: &FollowParams,
        now: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        let time = now.seconds();
        let newest = noticed.leader.newest();
        if let Some(located) = newest.as_ref().filter(|located| located.seen.get()) {
            (memory.leader, memory.seen) = (Some((located.x, located.y)), time);
        }
        let pose = noticed.robot.robot.pose;
        let moving = memory.notice(pose, noticed, time);
        let known = memory.leader.filter(|_| time - memory.seen <= PATIENCE);
        let (Some((x, y)), Some(sides)) = (known, noticed.robot.sides()) else {
            // Whom it does not know, it does not follow.
            if newest.is_some() && !situation.is_idle() {
                plan.clear();
            }
            return;
        };
        let unseen = time - memory.seen;
        let hidden = unseen > GLANCE;
        let gone = if hidden { math::min(unseen, GOES_ON) } else { 0.0 };
        let [east, north] = memory.velocity;
        let leader = Point2 { x: x + east * gone, y: y + north * gone };
        if memory.due - 1e-9 > time && !situation.needs_plan() {
            return;
        }
        memory.due = time + PERIOD;
        let course = Course { pose, motion: moving };
        let motion = match params.prediction_horizon > 0.0 {
            true => memory.look_ahead(course, leader, hidden, &sides, params),
            false => Some(law(pose, leader, params)),
        };
        let Some(motion) = motion else { return };
        memory.wants = (motion.linear, motion.angular);
        let (dx, dy) = (leader.x - pose.x, leader.y - pose.y);
        let range = math::hypot(dx, dy);
        // On the straight path to the leader, at the wanted distance; a nearer robot has arrived.
        let ahead = math::max(range - params.following_distance, 0.0) / math::max(range, 0.01);
        noticed.goal.set(Point2 { x: pose.x + ahead * dx, y: pose.y + ahead * dy });
        noticed.motion.set(motion);
        if situation.is_reactive() {
            return;
        }
        let wheels = noticed.robot.wheels_for(motion.linear, motion.angular);
        plan.replace(SetWheelSpeed::request(Speeds {
            left: wheels.left,
            right: wheels.right,
            // A hidden leader causes no report, so that the plan looks ahead by itself.
            duration: if hidden { PERIOD } else { HOLD },
        }));
    }
}

impl FollowMemory {
    /// Updates from detections and from the robot's own motion.
    fn notice(&mut self, pose: Pose2, noticed: &FollowNoticing, time: f64) -> Twist2 {
        if noticed.robots.fresh().is_none() {
            // Where they were is nothing to go by.
            self.others = Tracks::default();
        } else if let Some(robots) = noticed.robots.updated() {
            self.others.see(pose, robots, time);
        }
        if self.footprint.is_none() {
            let outline = &noticed.robot.chassis.outline;
            let corners: Vec<_> = outline.iter().map(|corner| [corner.x, corner.y]).collect();
            self.footprint = Footprint::new(&corners).ok();
        }
        self.motion.notice(pose, time)
    }

    /// How to move now.
    fn look_ahead(
        &mut self,
        course: Course,
        leader: Point2,
        hidden: bool,
        sides: &Sides,
        params: &FollowParams,
    ) -> Option<Twist2> {
        let is_leader = |place: Point2| math::hypot(place.x - leader.x, place.y - leader.y) <= SAME;
        let own = self.others.iter().find(|track| !hidden && is_leader(Point2 { x: track.x, y: track.y }));
        if !hidden {
            self.velocity = own.map_or([0.0; 2], |track| track.velocity);
        }
        let velocity = if hidden { [0.0; 2] } else { self.velocity };
        let mut outlook = Outlook {
            footprint: self.footprint.as_ref()?,
            leader: Moving { place: leader, velocity },
            hidden,
            others: [None; 8],
            distance: params.following_distance,
            room: params.room_half_width,
            radius: params.other_robot_radius,
            margin: params.min_clearance,
            pace: math::clamp(BRISK / params.max_linear_velocity, 1.0, SLOWEST),
        };
        let others = self.others.iter().filter(|track| own.is_none_or(|own| own.name != track.name));
        for (other, track) in outlook.others.iter_mut().zip(others) {
            *other = Some(Moving::of(track));
        }
        let motions = |speeds: &'static [f64], turns: &'static [f64]| {
            let all = speeds.iter().flat_map(move |speed| turns.iter().map(move |turn| (speed, turn)));
            let turn_rate = params.max_angular_velocity / outlook.pace;
            all.map(move |(speed, turn)| Twist2 {
                linear: speed * params.max_linear_velocity,
                angular: turn * turn_rate,
            })
        };
        let (linear, angular) = self.wants;
        let change = |motion: Twist2| {
            CHANGE[0] * (motion.linear - linear).abs() + CHANGE[1] * (motion.angular - angular).abs()
        };
        let first = std::iter::once(law(course.pose, leader, params)).chain(motions(&SPEEDS, &TURNS));
        let second = motions(&LATER_SPEEDS, &LATER_TURNS);
        let interval = params.prediction_horizon / f64::from(LOOKS) * outlook.pace;
        sides.best(course, interval, first.map(|motion| (motion, change(motion))), second, |pose, time| {
            outlook.cost(pose, time)
        })
    }
}

/// Follows by distance and bearing, without regard to other robots.
fn law(pose: Pose2, leader: Point2, params: &FollowParams) -> Twist2 {
    let (dx, dy) = (leader.x - pose.x, leader.y - pose.y);
    let bearing = math::angle_between(pose.theta, math::atan2(dy, dx));
    let wanted = math::clamp(
        params.distance_gain * (math::hypot(dx, dy) - params.following_distance),
        -params.max_linear_velocity,
        params.max_linear_velocity,
    );
    let linear = if bearing.abs() > MISALIGNED { 0.0 } else { wanted * math::cos(bearing) };
    Twist2 {
        linear,
        angular: math::clamp(
            params.bearing_gain * bearing,
            -params.max_angular_velocity,
            params.max_angular_velocity,
        ),
    }
}
