//! Orders of a developer: pause, resume, step, force.

use slate_plugin::prelude::*;

use crate::actions::MissionActions;
use crate::conditions::KnownConditions;

/// Order of a developer.
#[interface]
pub enum MissionCommand {
    /// Pause: no more steps; running actions continue to their end.
    Pause,
    /// Continuation of the mission.
    Resume,
    /// Single step of a paused mission.
    Step,
    /// Forces the event of the element.
    Force,
}

/// Result of a forced action or condition.
#[interface]
pub enum ForcedOutcome {
    /// Success of the action; or the condition holds.
    Success,
    /// Failure of the action; or the condition does not hold.
    Failure,
}

/// Order of a developer to a mission.
#[interface]
#[derive(PartialEq)]
pub struct MissionOrder {
    /// Command of the order.
    pub command: MissionCommand,
    /// Result of a forced action or condition; of no meaning otherwise.
    pub outcome: ForcedOutcome,
    /// Number of the forced element in the graph; of no meaning otherwise.
    pub element: u32,
    /// Number of the graph that has the element; of no meaning otherwise.
    pub graph: u32,
}

impl MissionOrder {
    /// Refusal: no mission runs.
    pub const NO_MISSION: u16 = 1;
    /// Refusal of a single step while the mission is not paused.
    pub const NOT_PAUSED: u16 = 2;
    /// Refusal: the element is of another graph.
    pub const OTHER_GRAPH: u16 = 3;
    /// Refusal: the element can't be forced, or not now; the log has the reason.
    pub const NOT_POSSIBLE: u16 = 4;
}

/// Access to the robot for changes of the mission.
pub struct MissionRobot<'a> {
    /// Actions of the mission.
    pub actions: &'a mut MissionActions,
    /// Conditions that are known.
    pub conditions: &'a mut KnownConditions,
    /// Time, random numbers and log.
    pub now: &'a Tick,
}

impl MissionRobot<'_> {
    /// Ends an action, as if Execute had reported it.
    pub fn end(&mut self, action: usize, outcome: ForcedOutcome, name: &str) -> Forcing {
        match self.actions.end(action, outcome == ForcedOutcome::SUCCESS) {
            true => Forcing::Done,
            false => Forcing::Refused(format!("the action `{name}` does not run; force what starts it")),
        }
    }
}

/// Outcome of forcing an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Forcing {
    /// The event was forced.
    Done,
    /// The event is impossible; the mission is unchanged.
    Refused(String),
    /// The event has ended the mission with an error.
    Failed(String),
}
