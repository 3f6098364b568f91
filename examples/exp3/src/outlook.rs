//! Prediction of a follower: poses of others in the next seconds, and costs of its own.

use slate_avoidance::Footprint;
use slate_plugin::interfaces::{Point2, Pose2};
use slate_plugin::prelude::*;
use slate_wheeled::tracks::Track;

/// Robot with constant velocity.
#[derive(Clone, Copy, Debug, Default)]
pub struct Moving {
    /// In the world, metres.
    pub place: Point2,
    /// In the world, m/s.
    pub velocity: [f64; 2],
}

/// Situation and objective.
pub struct Outlook<'a> {
    /// The follower's body.
    pub footprint: &'a Footprint,
    /// Leader.
    pub leader: Moving,
    /// Whether the leader is hidden, and must be searched for.
    pub hidden: bool,
    /// Other robots.
    pub others: [Option<Moving>; 8],
    /// Distance to keep from the leader, metres.
    pub distance: f64,
    /// Half the side of the room, metres.
    pub room: f64,
    /// Radius of the other robots, metres.
    pub radius: f64,
    /// Least distance to anything, metres.
    pub margin: f64,
    /// Time scale of the prediction for slow robots.
    pub pace: f64,
}

/// Nearer to the leader than this is too near, and farther too far, metres.
const BAND: [f64; 2] = [0.95, 1.75];
/// Distance from the leader's line below which a robot is in its way, metres.
const LANE: f64 = 0.95;
/// Distance ahead of the leader to keep clear, metres.
const LANE_LENGTH: f64 = 3.5;
/// A way past a robot that is no wider than the follower and this may be closed before it is through, metres.
const NARROW: f64 = 0.15;
/// Farther from the middle of the room than this, and than the leader, it may be shut in, metres.
const OUTSIDE: f64 = 1.5;
/// Slower than this a robot stands, m/s.
const SLOW: f64 = 0.08;
/// Preferred additional clearance to robots and to walls, metres.
const COMFORT: [f64; 2] = [0.12, 0.12];
/// Clearance needed to turn away from a wall beside, metres.
const TIGHT: f64 = 0.02;
/// Cost of a contact, and per metre of penetration.
const TOUCH: [f64; 2] = [20.0, 200.0];

impl Moving {
    /// A robot that is seen.
    pub fn of(track: &Track) -> Self {
        Self { place: Point2 { x: track.x, y: track.y }, velocity: track.velocity }
    }

    /// Predicts the position after a time, seconds; within `limit`, metres.
    fn after(&self, time: f64, limit: f64) -> Point2 {
        let [east, north] = self.velocity;
        Point2 {
            x: math::clamp(self.place.x + east * time, -limit, limit),
            y: math::clamp(self.place.y + north * time, -limit, limit),
        }
    }
}

impl Outlook<'_> {
    /// Returns the cost of a pose after a time, seconds.
    pub fn cost(&self, pose: Pose2, time: f64) -> f64 {
        let limit = self.room - self.radius;
        let leader = self.leader.after(time, limit);
        let unsure = time / self.pace;
        let (dx, dy) = (leader.x - pose.x, leader.y - pose.y);
        let gap = (dx * dx + dy * dy).sqrt();
        let heading = Point2 { x: math::cos(pose.theta), y: math::sin(pose.theta) };
        let facing = (heading.x * dx + heading.y * dy) / math::max(gap, 0.1);
        let mut cost = 0.05 * (1.0 - facing);
        if !self.hidden {
            cost += self.lane(pose, leader);
            // The leader may turn at any time.
            cost += 6.0 * squared(BAND[0] + 0.08 * unsure - gap) + 4.0 * squared(gap - BAND[1]);
            let shut_in = math::max(from_middle(leader.x, leader.y), OUTSIDE);
            cost += 0.5 * squared(from_middle(pose.x, pose.y) - shut_in);
        }
        let sure = 1.0 / (1.0 + 0.5 * unsure);
        cost += sure * self.touch(pose, heading, leader);
        let mut way = gap;
        for other in self.others.iter().flatten() {
            let place = other.after(time, limit);
            cost += sure * self.touch(pose, heading, place);
            way = math::max(way, self.way_round(pose, leader, place));
        }
        // A robot behind another one may be lost, however near it is.
        cost += match self.hidden {
            true => squared(way),
            false => math::max(squared(way - self.distance), squared(self.distance - gap)),
        };
        cost + self.walls(pose, heading)
    }

    /// In the way of a leader that comes.
    fn lane(&self, pose: Pose2, leader: Point2) -> f64 {
        let [east, north] = self.leader.velocity;
        let speed = (east * east + north * north).sqrt();
        if speed * self.pace < SLOW {
            return 0.0;
        }
        let (dx, dy) = (pose.x - leader.x, pose.y - leader.y);
        let along = (dx * east + dy * north) / speed;
        let aside = (dx * north - dy * east).abs() / speed;
        if along <= 0.0 {
            return 0.0;
        }
        1.5 * squared(LANE - aside) * math::clamp(LANE_LENGTH - along, 0.0, 1.0)
    }

    /// Too near to a robot.
    fn touch(&self, pose: Pose2, heading: Point2, robot: Point2) -> f64 {
        let (dx, dy) = (robot.x - pose.x, robot.y - pose.y);
        let (x, y) = (heading.x * dx + heading.y * dy, heading.x * dy - heading.y * dx);
        let wanted = self.margin + COMFORT[0] + self.radius;
        let distance = self.footprint.distance_within(x, y, wanted) - self.radius;
        too_near(distance, self.margin, COMFORT[0])
    }

    /// Too near to the walls.
    fn walls(&self, pose: Pose2, heading: Point2) -> f64 {
        let reach = self.footprint.radius() + self.footprint.centre().abs();
        let farthest = math::max(pose.x.abs(), pose.y.abs());
        if farthest + reach + COMFORT[1] < self.room {
            return 0.0;
        }
        let out = self.footprint.outline().fold(0.0, |most, [x, y]| {
            let east = pose.x + heading.x * x - heading.y * y;
            let north = pose.y + heading.y * x + heading.x * y;
            math::max(most, math::max(east.abs(), north.abs()))
        });
        too_near(self.room - out, -TIGHT, COMFORT[1])
    }

    /// The way to the leader round another robot, on the side where there is room.
    fn way_round(&self, pose: Pose2, leader: Point2, robot: Point2) -> f64 {
        let half_width = self.footprint.half_width();
        let from = [pose.x - robot.x, pose.y - robot.y];
        let to = [leader.x - robot.x, leader.y - robot.y];
        let length = |[x, y]: [f64; 2]| (x * x + y * y).sqrt();
        let (d_from, d_to) = (length(from), length(to));
        let wide = self.radius + half_width + self.margin;
        let wide = math::min(wide, 0.9 * math::min(d_from, d_to));
        let straight = [to[0] - from[0], to[1] - from[1]];
        let gap = length(straight);
        // Where the straight way is nearest to the robot.
        let part = -(from[0] * straight[0] + from[1] * straight[1]) / math::max(gap * gap, 1e-6);
        let nearest = [from[0] + part * straight[0], from[1] + part * straight[1]];
        let aside = length(nearest);
        if !(0.0..1.0).contains(&part) || aside >= wide || wide <= 0.0 {
            return gap;
        }
        let cosine = (from[0] * to[0] + from[1] * to[1]) / (d_from * d_to);
        let between = math::acos(math::clamp(cosine, -1.0, 1.0));
        let tangents = math::acos(wide / d_from) + math::acos(wide / d_to);
        let ends = (d_from * d_from - wide * wide).sqrt() + (d_to * d_to - wide * wide).sqrt();
        let arc = |angle: f64| ends + wide * math::max(angle - tangents, 0.0);
        // The side on which the straight way passes is the shorter one.
        let out = |sign: f64| {
            let side = sign * wide / math::max(aside, 1e-6);
            let (x, y) = (robot.x + side * nearest[0], robot.y + side * nearest[1]);
            math::max(x.abs(), y.abs()) > self.room - half_width - NARROW
        };
        let (short, long) = (arc(between), arc(std::f64::consts::TAU - between));
        match (out(1.0), out(-1.0)) {
            (true, false) => long,
            _ => short,
        }
    }
}

fn from_middle(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// Square of the positive part.
fn squared(excess: f64) -> f64 {
    let excess = math::max(excess, 0.0);
    excess * excess
}

fn too_near(distance: f64, margin: f64, comfort: f64) -> f64 {
    let inside = margin - distance;
    let touch = if inside > 0.0 { TOUCH[0] + TOUCH[1] * inside } else { 0.0 };
    touch + 30.0 * squared(inside + comfort)
}
