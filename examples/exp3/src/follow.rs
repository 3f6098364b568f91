//! R3's behaviour: after R2 at a safe distance, by how far and how misaligned it is (section 6.5 of the paper).

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Point2, Pose2, Sightings};
use slate_plugin::mapek::prelude::*;
use slate_plugin::prelude::*;
use slate_wheeled::actions::{SetWheelSpeed, Speeds};
use slate_wheeled::knowledge::WheeledModel;
use slate_wheeled::locate_robot::Located;

/// What the Plan notices, what it knows, and what it lets others know.
#[ports]
pub struct FollowNoticing {
    leader: Noticed<Located>,
    /// Robots that it sees.
    #[stale(after = "500ms")]
    robots: Input<Sightings>,
    /// The robot's body, from its knowledge.
    robot: Input<WheeledModel>,
    /// Where it wants to be now.
    goal: Output<Point2>,
}

/// How it follows.
#[params]
pub struct FollowParams {
    #[param(default = 1.2, range = 0.1..=100.0, unit = "m", doc = "the distance that it keeps")]
    distance: f64,
    #[param(default = 0.6, range = 0.0..=1.5, unit = "m/s", doc = "highest speed")]
    speed: f64,
    #[param(default = 1.5, range = 0.0..=10.0, unit = "1/s", doc = "speed per metre too far or too near")]
    gain: f64,
    #[param(default = 2.0, range = 0.0..=10.0, unit = "1/s", doc = "rate of turn per radian of misalignment")]
    turn_gain: f64,
    #[param(default = 1.2, range = 0.0..=3.0, unit = "rad/s", doc = "highest rate of turn")]
    turn_rate: f64,
    #[param(default = 1.85, range = 0.0..=1000.0, unit = "m", doc = "it goes back no farther than this from the origin to either side: so much it knows of the room")]
    room: f64,
}

/// What the Plan remembers.
#[derive(Default, Serialize, Deserialize)]
pub struct FollowMemory {
    /// Where it is in the world, how far and in which direction; nothing while it is not seen.
    leader: Option<(f64, f64, f64, f64)>,
}

/// Nobody goes ahead who is this far from looking at the leader, radians.
const MISALIGNED: f64 = 0.8;
/// So far back it looks before it goes back, metres.
const BACK: f64 = 0.2;
/// A robot that is seen this far from straight ahead is behind, radians.
const BEHIND: f64 = 1.9;
/// A robot behind is in the way when it is nearer than this, metres.
const CLOSE: f64 = 0.9;
/// A plan holds for so long unless it is made anew, seconds.
const HOLD: f64 = 0.5;

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
        _: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        let newest = noticed.leader.newest();
        if let Some(located) = &newest {
            memory.leader =
                located.seen.get().then_some((located.x, located.y, located.range, located.bearing));
        }
        let Some((x, y, range, bearing)) = memory.leader else {
            // Whom it does not see, it does not follow.
            if newest.is_some() && !situation.is_idle() {
                plan.clear();
            }
            return;
        };
        let pose = noticed.robot.robot.pose;
        // On the straight way to the leader, as far from it as it shall be; who is nearer has arrived.
        let ahead = math::max(range - params.distance, 0.0) / math::max(range, 0.01);
        noticed.goal.set(Point2 { x: pose.x + ahead * (x - pose.x), y: pose.y + ahead * (y - pose.y) });
        if situation.is_reactive() || !(newest.is_some() || situation.needs_plan()) {
            return;
        }
        let wanted = math::clamp(params.gain * (range - params.distance), -params.speed, params.speed);
        let linear = match bearing.abs() > MISALIGNED {
            true => 0.0,
            // No sonar looks back.
            false if wanted < 0.0 && !is_free_behind(noticed, params, pose) => 0.0,
            false => wanted * math::cos(bearing),
        };
        let angular = math::clamp(params.turn_gain * bearing, -params.turn_rate, params.turn_rate);
        let wheels = noticed.robot.wheels_for(linear, angular);
        plan.replace(SetWheelSpeed::request(Speeds {
            left: wheels.left,
            right: wheels.right,
            duration: HOLD,
        }));
    }
}

/// Whether it can go back: as far as it knows the room, and sees nobody there.
fn is_free_behind(noticed: &FollowNoticing, params: &FollowParams, pose: Pose2) -> bool {
    // What is no number may be anywhere.
    let is_clear = |bearing: f64, range: f64| bearing.abs() <= BEHIND || range >= CLOSE;
    let nobody = noticed
        .robots
        .fresh()
        .is_some_and(|robots| robots.list.iter().all(|seen| is_clear(seen.bearing, seen.range)));
    let x = pose.x - BACK * math::cos(pose.theta);
    let y = pose.y - BACK * math::sin(pose.theta);
    nobody && x.abs() <= params.room && y.abs() <= params.room
}
