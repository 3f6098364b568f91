//! Common part of Plans that send a robot to goals.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Orientation, Point2, Position};
use slate_plugin::mapek::prelude::*;

use crate::actions::{GoToOrigin, Leg};
use crate::analyzes::Surroundings;
use crate::locate_robot::Located;

/// Distance below which another robot is near, meters.
const NEAR_DISTANCE: f64 = 1.0;
/// Hysteresis of this distance, meters.
const SPREAD: f64 = 0.3;

/// State of such a Plan.
#[derive(Default, Serialize, Deserialize)]
pub struct Navigator {
    /// True if the surroundings are crowded.
    crowded: bool,
    /// Newest position.
    position: Option<(f64, f64)>,
    /// True if the heading is known.
    oriented: bool,
    /// True if another robot is near.
    #[serde(default, alias = "met")]
    is_near_robot: bool,
    /// Newest goal, and its two velocities.
    #[serde(default, alias = "sent")]
    goal: Option<([f64; 2], [f64; 2])>,
}

impl Navigator {
    /// Updates from percepts; returns whether the surroundings have changed.
    pub fn update(
        &mut self,
        range: &Noticed<Surroundings>,
        position: &Noticed<Position>,
        orientation: &Noticed<Orientation>,
    ) -> bool {
        let was = self.crowded;
        if let Some(surroundings) = range.newest() {
            self.crowded = surroundings.crowded.get();
        }
        if let Some(position) = position.newest() {
            self.position = Some((position.x, position.y));
        }
        self.oriented |= orientation.newest().is_some();
        was != self.crowded
    }

    /// Returns the position once the pose is known.
    pub fn position(&self) -> Option<(f64, f64)> {
        self.position.filter(|_| self.oriented)
    }

    /// Updates from another robot's position; returns whether its nearness changed.
    /// True if it has come near or left.
    pub fn update_other(&mut self, robot: &Noticed<Located>) -> bool {
        let was = self.is_near_robot;
        if let Some(located) = robot.newest() {
            let near = if was { NEAR_DISTANCE + SPREAD } else { NEAR_DISTANCE };
            self.is_near_robot = located.seen.get() && located.range < near;
        }
        was != self.is_near_robot
    }

    /// Sets the position to the goal on arrival.
    /// The Analyze reports steps of some centimeters only.
    pub fn set_arrived(&mut self) {
        self.position = self.goal.map(|([x, y], _)| (x, y)).or(self.position);
    }

    /// Returns whether the action has completed since the previous run of the Plan.
    pub fn has_arrived(situation: &Situation<'_>) -> bool {
        let mut ended = situation.ended();
        ended.any(|ended| ended.kind.as_str() == GoToOrigin::KIND && ended.ending == Ending::COMPLETED)
    }

    /// Returns whether this is the newest goal.
    pub fn is_goal(&self, goal: Point2) -> bool {
        self.goal.is_some_and(|(own, _)| own == [goal.x, goal.y])
    }

    /// Returns whether goal or velocities have changed since the newest action.
    pub fn is_outdated(&self, goal: Point2, speeds: [f64; 2]) -> bool {
        self.goal.is_some_and(|own| own != ([goal.x, goal.y], speeds))
    }

    /// Sends the robot to a goal.
    /// `speeds` are the velocities for free and for crowded space (m/s).
    pub fn send_goal(&mut self, goal: Point2, speeds: [f64; 2], tolerance: f64, plan: &mut Agenda<'_>) {
        self.goal = Some(([goal.x, goal.y], speeds));
        let [speed, careful_speed] = speeds;
        let speed = if self.crowded || self.is_near_robot { careful_speed } else { speed };
        plan.replace(GoToOrigin::request(Leg { x: goal.x, y: goal.y, speed, tolerance }));
    }
}

/// Returns whether to replan the running action after a change.
pub fn must_replan(changed: bool, situation: &Situation<'_>) -> bool {
    changed && !situation.is_reactive() && !situation.is_idle()
}
