//! Plan: straight to the goal, without regard to obstacles.

use slate_plugin::interfaces::{Orientation, Point2, Position};
use slate_plugin::prelude::*;

use crate::analyzes::Surroundings;
use crate::locate_robot::Located;
use crate::navigator::{Navigator, must_replan};

/// Percepts and knowledge of the Plan.
#[ports]
pub struct GoToOriginPorts {
    range: Noticed<Surroundings>,
    position: Noticed<Position>,
    orientation: Noticed<Orientation>,
    /// Another robot, if a sensor detects robots.
    other: Noticed<Located>,
    /// Goal of the robot, from Knowledge.
    pub(crate) goal: Input<Point2>,
}

/// Parameters of [`GoToOriginPlanner`].
#[params]
pub struct GoToOriginParams {
    #[param(default = 0.4, range = 0.0..=3.0, unit = "m/s", doc = "maximum linear velocity in free space")]
    pub(crate) max_linear_velocity: f64,
    #[param(default = 0.3, range = 0.0..=3.0, unit = "m/s", doc = "maximum linear velocity in crowded space or near another robot")]
    pub(crate) careful_linear_velocity: f64,
    #[param(default = 0.05, range = 0.001..=1.0, unit = "m", doc = "distance from the goal at which it counts as reached")]
    pub(crate) goal_tolerance: f64,
    #[param(default = 0.15, range = 0.001..=10.0, unit = "m", doc = "distance from the goal that triggers a new plan (hysteresis)")]
    pub(crate) replan_distance: f64,
}

/// State of [`GoToOriginPlanner`].
#[derive(Default, serde::Serialize, serde::Deserialize)]
pub struct GoToOriginState {
    #[serde(alias = "journey")]
    navigator: Navigator,
    /// True if the goal was reached and the robot has stayed there.
    arrived: bool,
}

/// Sends the robot to its goal; replans from where a reflex has left it.
pub struct GoToOriginPlanner;

impl Plan for GoToOriginPlanner {
    const NAME: &'static str = "go_to_origin_planner";
    const DOC: &'static str = "Sends the robot to its goal.";
    type Noticed = GoToOriginPorts;
    type Params = GoToOriginParams;
    type State = GoToOriginState;

    fn run(
        memory: &mut GoToOriginState,
        noticed: &GoToOriginPorts,
        situation: &Situation<'_>,
        params: &GoToOriginParams,
        _: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        memory.run(noticed, situation, params, false, plan);
    }
}

impl GoToOriginState {
    /// Updates from the percepts; returns true if the speed must change.
    pub(crate) fn update(&mut self, noticed: &GoToOriginPorts) -> bool {
        let room_changed = self.navigator.update(&noticed.range, &noticed.position, &noticed.orientation);
        self.navigator.update_other(&noticed.other) | room_changed
    }

    /// Plans the path to the goal; returns true if it did.
    /// With `anew` also while another planned action runs.
    pub(crate) fn run(
        &mut self,
        noticed: &GoToOriginPorts,
        situation: &Situation<'_>,
        params: &GoToOriginParams,
        anew: bool,
        plan: &mut Agenda<'_>,
    ) -> bool {
        let changed = self.update(noticed);
        // Without a goal and a pose there is nothing to plan.
        let (Some(goal), Some((x, y))) = (noticed.goal.fresh(), self.navigator.position()) else {
            return false;
        };
        if Navigator::has_arrived(situation) && self.navigator.is_goal(*goal) {
            self.navigator.set_arrived();
            self.arrived = true;
            return false;
        }
        let distance = math::hypot(goal.x - x, goal.y - y);
        self.arrived &= distance <= params.replan_distance && self.navigator.is_goal(*goal);
        let away = !self.arrived && distance > params.goal_tolerance;
        let speeds = [params.max_linear_velocity, params.careful_linear_velocity];
        let is_changed = changed || self.navigator.is_outdated(*goal, speeds);
        // A reflex leaves the robot elsewhere: replan from there.
        let goes = (away && (anew || situation.needs_plan())) || must_replan(is_changed, situation);
        if goes {
            self.navigator.send_goal(*goal, speeds, params.goal_tolerance, plan);
        }
        goes
    }
}
