//! Orders of a developer: pause, resume, step, force.

use slate_plugin::prelude::*;

use crate::actions::MissionActions;
use crate::conditions::KnownConditions;

/// What a developer orders.
#[interface]
pub enum MissionCommand {
    /// The mission makes no more steps; an action that runs goes on to its end.
    Pause,
    /// The mission goes on.
    Resume,
    /// A paused mission makes one step.
    Step,
    /// Makes happen what the element stands for.
    Force,
}

/// What a forced action or condition results in.
#[interface]
pub enum ForcedOutcome {
    /// The action has succeeded, or the condition holds.
    Success,
    /// The action has failed, or the condition does not hold.
    Failure,
}

/// Order of a developer to a mission.
#[interface]
#[derive(PartialEq)]
pub struct MissionOrder {
    /// What is ordered.
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
    /// Refusal: a mission makes single steps while it is paused.
    pub const NOT_PAUSED: u16 = 2;
    /// Refusal: the element is of another graph.
    pub const OTHER_GRAPH: u16 = 3;
    /// Refusal: the element can't be forced, or not now; the log has the reason.
    pub const NOT_POSSIBLE: u16 = 4;
}

/// The robot as a mission changes it.
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

/// What has become of a forced element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Forcing {
    /// It has happened.
    Done,
    /// It can't happen; nothing has changed.
    Refused(String),
    /// It has ended the mission with an error.
    Failed(String),
}
