//! R3's behaviour: after R2 at a safe distance, by how far and how misaligned it is (section 6.5 of the paper).

use slate_plugin::prelude::*;
use slate_wheeled::actions::{GoToOrigin, Leg, SetWheelSpeed, Speeds};
use slate_wheeled::knowledge::WheeledModel;
use slate_wheeled::locate_robot::Located;

/// Percepts and knowledge of the Plan.
#[ports]
pub struct FollowNoticing {
    leader: Noticed<Located>,
    /// Kinematics of the robot, from its knowledge.
    robot: Required<WheeledModel>,
}

/// Parameters of [`FollowPlanner`].
#[params]
pub struct FollowParams {
    #[param(default = 1.4, range = 0.1..=100.0, unit = "m", doc = "distance to keep from the leader")]
    following_distance: f64,
    #[param(default = 1.1, range = 0.0..=100.0, unit = "m", doc = "distance below which it backs off")]
    min_distance: f64,
    #[param(default = 0.9, range = 0.0..=1.5, unit = "m/s", doc = "maximum linear velocity")]
    max_linear_velocity: f64,
    #[param(default = 0.2, range = 0.0..=1.5, unit = "m/s", doc = "maximum linear velocity backwards")]
    max_reverse_velocity: f64,
    #[param(default = 1.5, range = 0.0..=10.0, unit = "1/s", doc = "linear velocity backwards per metre below that distance")]
    distance_gain: f64,
    #[param(default = 2.0, range = 0.0..=10.0, unit = "1/s", doc = "angular velocity per radian of bearing error")]
    bearing_gain: f64,
    #[param(default = 1.2, range = 0.0..=3.0, unit = "rad/s", doc = "maximum angular velocity")]
    max_angular_velocity: f64,
    #[param(default = 0.8, range = 0.0..=1.5, unit = "rad", doc = "bearing error above which it turns on the spot")]
    max_bearing_error: f64,
}

/// Duration of a plan unless it is renewed, seconds.
const HOLD: f64 = 0.5;

/// Follows another robot, as if nothing stood in the way.
pub struct FollowPlanner;

impl Plan for FollowPlanner {
    const NAME: &'static str = "follow_planner";
    const DOC: &'static str = "Follows another robot at a safe distance.";
    type Noticed = FollowNoticing;
    type Params = FollowParams;
    /// The newest report of the leader: x, y, range, bearing, and whether it is seen.
    type State = Option<(f64, f64, f64, f64, bool)>;

    fn run(
        last: &mut Self::State,
        noticed: &FollowNoticing,
        situation: &Situation<'_>,
        params: &FollowParams,
        _: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        let report = noticed.leader.newest();
        if let Some(leader) = &report {
            *last = Some((leader.x, leader.y, leader.range, leader.bearing, leader.seen.get()));
        }
        let Some((x, y, range, bearing, seen)) = *last else { return };
        // A reflex is not interrupted.
        if situation.is_reactive() || (report.is_none() && !situation.needs_plan()) {
            return;
        }
        if !seen {
            // To where it was last.
            let (speed, tolerance) = (params.max_linear_velocity, params.following_distance);
            plan.replace(GoToOrigin::request(Leg { x, y, speed, tolerance }));
            return;
        }
        let (linear, angular) = params.twist(range, bearing, noticed.robot.deceleration());
        let wheels = noticed.robot.wheels_for(linear, angular);
        plan.replace(SetWheelSpeed::request(Speeds {
            left: wheels.left,
            right: wheels.right,
            duration: HOLD,
        }));
    }
}

impl FollowParams {
    /// Linear (m/s) and angular (rad/s) velocity towards a leader at that distance (m) and bearing (rad).
    fn twist(&self, range: f64, bearing: f64, deceleration: f64) -> (f64, f64) {
        let ahead = range - self.following_distance;
        let wanted = if ahead > 0.0 {
            // Low enough to stop in time, should the leader stop.
            math::min(self.max_linear_velocity, (2.0 * deceleration * ahead).sqrt())
        } else {
            math::clamp(self.distance_gain * (range - self.min_distance), -self.max_reverse_velocity, 0.0)
        };
        let linear = if bearing.abs() > self.max_bearing_error { 0.0 } else { wanted * math::cos(bearing) };
        let limit = self.max_angular_velocity;
        (linear, math::clamp(self.bearing_gain * bearing, -limit, limit))
    }
}
