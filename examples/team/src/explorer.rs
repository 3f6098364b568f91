//! Exploration of a scout.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::Point2;
use slate_plugin::prelude::*;
use slate_wheeled::actions::Leg;

use crate::actions::{GoNear, SendToInspect};
use crate::atlas::Known;
use crate::finder::Obstacle;

/// Percepts of the Plan, and messages of other robots.
#[ports]
pub struct ExplorerPorts {
    /// Finds of this robot.
    obstacle: Noticed<Obstacle>,
    /// Knowledge of the team.
    known: Noticed<Known>,
    /// Points that other robots order this one to inspect.
    orders: Inbox<Point2>,
}

/// Part of the arena to explore.
#[params]
pub struct ExplorerParams {
    #[param(default = 0.0, range = -10.0..=10.0, unit = "m", doc = "x of its sector's center")]
    center_x: f64,
    #[param(default = 0.0, range = -10.0..=10.0, unit = "m", doc = "y of its sector's center")]
    center_y: f64,
    #[param(default = 0.3, range = 0.0..=10.0, unit = "m", doc = "half the side of the square to patrol")]
    half_width: f64,
    #[param(default = 0.3, range = 0.0..=1.2, unit = "m/s", doc = "linear velocity")]
    linear_velocity: f64,
}

/// State of the Plan.
#[derive(Default, Serialize, Deserialize)]
pub struct ExplorerState {
    /// Next corner of the square.
    corner: u8,
    /// True if the robot knows of other robots.
    team: bool,
    /// Find for another robot to inspect.
    worth: Option<(f64, f64)>,
    /// True if another robot was sent there.
    #[serde(alias = "told")]
    is_sent: bool,
}

/// Explores its part of the arena, and delegates its first find.
/// It sends another robot there, and goes where it is sent itself.
pub struct Explorer;

impl Plan for Explorer {
    const NAME: &'static str = "explorer";
    const DOC: &'static str = "Drives round its part of the arena, and inspects places for other robots.";
    type Noticed = ExplorerPorts;
    type Params = ExplorerParams;
    type State = ExplorerState;

    fn run(
        memory: &mut ExplorerState,
        noticed: &ExplorerPorts,
        situation: &Situation<'_>,
        params: &ExplorerParams,
        _: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        memory.is_sent |= situation
            .ended()
            .any(|ended| ended.kind.as_str() == SendToInspect::KIND && ended.ending == Ending::COMPLETED);
        if let Some(found) = noticed.obstacle.newest() {
            memory.worth.get_or_insert((found.x, found.y));
        }
        memory.team |= noticed.known.iter().any(|known| known.robots > 1);
        let near = |x, y, tolerance| GoNear::request(Leg { x, y, speed: params.linear_velocity, tolerance });
        for order in noticed.orders.iter() {
            // Not into it.
            plan.replace(near(order.x, order.y, 0.7));
        }
        if !situation.needs_plan() || noticed.orders.iter().len() > 0 {
            return;
        }
        // As soon as another robot is there.
        if let Some(place) = memory.worth.filter(|_| memory.team && !memory.is_sent) {
            plan.append(SendToInspect::request(place));
        }
        let side = |out: bool| if out { params.half_width } else { -params.half_width };
        let corner = memory.corner;
        plan.append(near(
            params.center_x + side(corner == 1 || corner == 2),
            params.center_y + side(corner >= 2),
            0.1,
        ));
        memory.corner = (corner + 1) % 4;
    }
}
