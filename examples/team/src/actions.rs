//! Actions of a scout: drive to a goal, and send another robot to one.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::Point2;
use slate_plugin::prelude::*;
use slate_wheeled::actions::{GoToOrigin, Leg};
use slate_wheeled::differential::DifferentialBody;

/// Connections to other robots.
#[ports]
pub struct Radio {
    /// Point that another robot inspects.
    look: Outbox<Point2>,
}

/// Robot with two driven wheels and a radio.
pub type ScoutBody = (DifferentialBody, Radio);

/// Approaches a place.
#[derive(Serialize, Deserialize)]
pub struct GoNear {
    go: GoToOrigin,
}

impl ActionKind for GoNear {
    const KIND: &'static str = "GoNear";
    type Arguments = Leg;

    fn start(leg: Leg) -> Self {
        Self { go: GoToOrigin::start(leg) }
    }

    fn children(&self, tree: &mut ActionTree) {
        tree.child(&self.go);
    }
}

impl Action<ScoutBody> for GoNear {
    fn act(&mut self, acting: &Acting<'_, ScoutBody>) -> Step {
        self.go.act(&Acting { body: &acting.body.0, priority: acting.priority, now: acting.now })
    }
}

/// Orders another robot to inspect a place.
/// It is done when that robot has accepted the order.
#[derive(Serialize, Deserialize)]
pub struct SendToInspect {
    place: (f64, f64),
    transmission: Transmission,
}

impl ActionKind for SendToInspect {
    const KIND: &'static str = "SendToInspect";
    /// Coordinates to the east and to the north, meters.
    type Arguments = (f64, f64);

    fn start(place: (f64, f64)) -> Self {
        Self { place, transmission: Transmission::within(3.0) }
    }
}

impl Action<ScoutBody> for SendToInspect {
    fn act(&mut self, acting: &Acting<'_, ScoutBody>) -> Step {
        let (x, y) = self.place;
        self.transmission.send(&acting.body.1.look, Point2 { x, y }, acting.now)
    }
}

repertoire! {
    /// Actions of a scout.
    pub enum ScoutActions for ScoutBody as "scout_execute" { GoNear, SendToInspect }
}
