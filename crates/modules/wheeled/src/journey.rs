//! What Plans have in common that send a robot to places.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Orientation, Point2, Position};
use slate_plugin::mapek::prelude::*;

use crate::actions::{GoToOrigin, Leg};
use crate::analyzes::Surroundings;
use crate::locate_robot::Located;

/// Another robot that is nearer than this is near, metres.
const NEAR: f64 = 1.0;
/// And is so much farther away when it has left, metres.
const SPREAD: f64 = 0.3;

/// What such a Plan remembers of what it noticed.
#[derive(Default, Serialize, Deserialize)]
pub struct Journey {
    /// Whether it drives with care.
    crowded: bool,
    /// Where the robot was last told to be.
    position: Option<(f64, f64)>,
    /// Whether it was told which way the robot looks.
    oriented: bool,
    /// Whether another robot is near.
    #[serde(default)]
    met: bool,
    /// Where the robot was sent last, and the two speeds of that way.
    #[serde(default)]
    sent: Option<([f64; 2], [f64; 2])>,
}

impl Journey {
    /// Takes in what is new; says whether the room around the robot has changed.
    pub fn notice(
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

    /// Where the robot is; nothing until it is known where it is and which way it looks.
    pub fn position(&self) -> Option<(f64, f64)> {
        self.position.filter(|_| self.oriented)
    }

    /// Takes in where another robot is, if there is a sensor that sees some; says whether one has come near or left.
    pub fn meet(&mut self, robot: &Noticed<Located>) -> bool {
        let was = self.met;
        if let Some(located) = robot.newest() {
            let near = if was { NEAR + SPREAD } else { NEAR };
            self.met = located.seen.get() && located.range < near;
        }
        was != self.met
    }

    /// It is where it was sent. The Analyze tells steps of some centimetres, so an arrival is known from the action's end.
    pub fn arrive(&mut self) {
        self.position = self.sent.map(|([x, y], _)| (x, y)).or(self.position);
    }

    /// Whether a way has come to its end since the Plan ran last.
    pub fn has_arrived(situation: &Situation<'_>) -> bool {
        let mut ended = situation.ended();
        ended.any(|ended| ended.kind.as_str() == GoToOrigin::KIND && ended.ending == Ending::COMPLETED)
    }

    /// Whether the robot was sent to that place last.
    pub fn leads_to(&self, goal: Point2) -> bool {
        self.sent.is_some_and(|(place, _)| place == [goal.x, goal.y])
    }

    /// Whether the robot is on a way that it was sent elsewhere or at other speeds: they were changed since.
    pub fn is_outdated(&self, goal: Point2, speeds: [f64; 2]) -> bool {
        self.sent.is_some_and(|sent| sent != ([goal.x, goal.y], speeds))
    }

    /// Sends the robot to a place, at one of two speeds (m/s): where there is room, and where it is crowded.
    pub fn go(&mut self, goal: Point2, speeds: [f64; 2], tolerance: f64, plan: &mut Agenda<'_>) {
        self.sent = Some(([goal.x, goal.y], speeds));
        let [speed, careful_speed] = speeds;
        let speed = if self.crowded || self.met { careful_speed } else { speed };
        plan.replace(GoToOrigin::request(Leg { x: goal.x, y: goal.y, speed, tolerance }));
    }
}

/// Whether a way under way must be planned anew, as what it was planned by is `changed`.
pub fn must_change(changed: bool, situation: &Situation<'_>) -> bool {
    changed && !situation.is_reactive() && !situation.is_idle()
}
