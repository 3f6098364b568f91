use slate_module::{Bool, Sequence, Text, interface};

use crate::ActionRequest;

/// Route that controls the robot.
#[interface]
#[derive(serde::Serialize, serde::Deserialize)]
pub enum Route {
    /// No action: the pipeline is empty and the actuators are safe.
    Idle,
    /// The Plan.
    Deliberative,
    /// A ReactiveModel.
    Reactive,
}

/// Ending of an action.
#[interface]
#[derive(serde::Serialize, serde::Deserialize)]
pub enum Ending {
    /// Completed.
    Completed,
    /// Failed.
    Failed,
    /// Cancelled by a reflex, a failure or a new plan.
    Cancelled,
    /// Dropped: planned before the newest reflex.
    Dropped,
    /// Refused: unknown kind, invalid arguments or full pipeline.
    Refused,
}

/// An action that ended.
#[interface]
pub struct Ended {
    /// Number of the ending, from 1.
    pub number: u64,
    /// Number of the action at the Plan; 0 for a reflex.
    pub ticket: u64,
    /// Kind of the action.
    pub kind: Text<44>,
    /// Ending.
    pub ending: Ending,
    /// Route that sent it.
    pub route: Route,
}

/// Action that waits in the Pipeline.
#[interface]
pub struct WaitingAction {
    /// Time at which it was queued or renewed.
    #[unit("ns")]
    pub queued: u64,
    /// Number of the action at the Plan; 0 for a reflex.
    pub ticket: u64,
    /// Kind and arguments.
    pub action: ActionRequest,
    /// Rank of a reflex; 0 for a planned action.
    pub rank: i32,
    /// Route that sent it.
    pub route: Route,
}

/// Actions that wait in the Pipeline, in the order of their turns.
/// Written at the start and when they change.
#[interface]
pub struct WaitingActions {
    /// Number of changes so far.
    pub revision: u64,
    /// The actions.
    pub actions: [WaitingAction],
}

/// Status of Execute, written when it changes.
#[interface]
pub struct ExecuteStatus {
    /// Raised by each reflex and failure; plans of an earlier epoch are dropped.
    pub epoch: u64,
    /// Newest message of the Plan that Execute has taken.
    pub ticket: u64,
    /// Number of completed actions.
    pub completed: u64,
    /// Number of failed actions.
    pub failed: u64,
    /// Number of cancelled actions.
    pub cancelled: u64,
    /// Number of planned actions of an earlier epoch.
    pub dropped: u64,
    /// Number of refused messages.
    pub refused: u64,
    /// Number of accepted reflexes, with renewals.
    pub reflexes: u64,
    /// Number of route switches.
    pub route_switches: u64,
    /// Queued reflexes.
    pub high: u32,
    /// Queued planned actions.
    pub normal: u32,
    /// Present route.
    pub route: Route,
    /// Set while the Plan must replan.
    /// Its plan was cleared, and no new one has arrived.
    pub replan: Bool,
    /// Kind of the running action; empty for none.
    pub running: Text<44>,
    /// Running action with its children.
    /// An example is `GoToOrigin > TurnToOrigin > TurnAngle`.
    pub tree: Text<252>,
    /// Newest endings, oldest first.
    pub ended: Sequence<Ended, 8>,
}
