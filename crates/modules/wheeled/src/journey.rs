//! What Plans have in common that send a robot to places.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Orientation, Point2, Position};
use slate_plugin::mapek::prelude::*;

use crate::actions::{GoToOrigin, Leg};
use crate::analyzes::Surroundings;

/// What such a Plan remembers of what it noticed.
#[derive(Default, Serialize, Deserialize)]
pub struct Journey {
    /// Whether it drives with care.
    crowded: bool,
    /// Where the robot was last told to be.
    position: Option<(f64, f64)>,
    /// Whether it was told which way the robot looks.
    oriented: bool,
    /// The two speeds of the way that the robot was sent last.
    #[serde(default)]
    speeds: Option<[f64; 2]>,
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

    /// It is at that place now. The Analyze tells steps of some centimetres, so an arrival is known from the action's end.
    pub fn arrive(&mut self, goal: Point2) {
        self.position = Some((goal.x, goal.y));
    }

    /// Whether a way has come to its end since the Plan ran last.
    pub fn has_arrived(situation: &Situation<'_>) -> bool {
        let mut ended = situation.ended();
        ended.any(|ended| ended.kind.as_str() == GoToOrigin::KIND && ended.ending == Ending::COMPLETED)
    }

    /// Whether the robot is on a way that it was sent at other speeds: they were changed since.
    pub fn has_other_speeds(&self, speeds: [f64; 2]) -> bool {
        self.speeds.is_some_and(|own| own != speeds)
    }

    /// Sends the robot to a place, at one of two speeds (m/s): where there is room, and where it is crowded.
    pub fn go(&mut self, goal: Point2, speeds: [f64; 2], tolerance: f64, plan: &mut Agenda<'_>) {
        self.speeds = Some(speeds);
        let [speed, careful_speed] = speeds;
        let speed = if self.crowded { careful_speed } else { speed };
        plan.replace(GoToOrigin::request(Leg { x: goal.x, y: goal.y, speed, tolerance }));
    }
}

/// Whether what is under way must be planned anew, as a change of room, or of what is set, changes its speed.
pub fn changes_speed(room_changed: bool, situation: &Situation<'_>) -> bool {
    room_changed && !situation.is_reactive() && !situation.is_idle()
}
