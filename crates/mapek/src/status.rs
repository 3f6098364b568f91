use slate_module::{Bool, Sequence, Text, interface};

/// Who decides what the robot does.
#[interface]
#[derive(serde::Serialize, serde::Deserialize)]
pub enum Route {
    /// Nobody: the pipeline is empty and the actuators are safe.
    Idle,
    /// The Plan.
    Deliberative,
    /// A ReactiveModel.
    Reactive,
}

/// How an action ended.
#[interface]
#[derive(serde::Serialize, serde::Deserialize)]
pub enum Ending {
    /// It did what it should.
    Completed,
    /// It could not.
    Failed,
    /// It was running or waiting when a reflex, a failure or a new plan took its place.
    Cancelled,
    /// It was planned before the latest reflex and never began.
    Dropped,
    /// Execute does not know it, its arguments are wrong, or the pipeline is full.
    Refused,
}

/// An action that ended.
#[interface]
pub struct Ended {
    /// Counts the endings from 1.
    pub number: u64,
    /// The Plan's number of the action; 0 for a reflex.
    pub ticket: u64,
    /// Its kind.
    pub kind: Text<44>,
    /// How it ended.
    pub ending: Ending,
    /// Who had sent it.
    pub route: Route,
    /// Not used.
    pub reserved: [u8; 6],
}

/// What Execute is doing, written when it changes.
#[interface]
pub struct ExecuteStatus {
    /// Raised by each reflex and each failure; what was planned in an earlier epoch is dropped.
    pub epoch: u64,
    /// The Plan's latest message that Execute took.
    pub ticket: u64,
    /// Actions that did what they should.
    pub completed: u64,
    /// Actions that could not.
    pub failed: u64,
    /// Actions cancelled while they ran or waited.
    pub cancelled: u64,
    /// Planned actions that came too late.
    pub dropped: u64,
    /// Messages refused.
    pub refused: u64,
    /// Reflexes taken, with those that renewed another.
    pub reflexes: u64,
    /// Changes between the deliberative and the reactive route.
    pub route_switches: u64,
    /// Reflexes that wait.
    pub high: u32,
    /// Planned actions that wait.
    pub normal: u32,
    /// Who decides now.
    pub route: Route,
    /// Whether the Plan must make a new plan: its last one was cleared and nothing came since.
    pub replan: Bool,
    /// Not used.
    pub reserved: [u8; 6],
    /// Kind of the running action; empty for none.
    pub running: Text<44>,
    /// The running action with the actions inside it, such as `GoToOrigin > TurnToOrigin > TurnAngle`.
    pub tree: Text<252>,
    /// The latest actions that ended, oldest first.
    pub ended: Sequence<Ended, 8>,
}
