use serde::{Serialize, de::DeserializeOwned};

use crate::{Hardware, Params, Ports, Setup, Stage, Tick, Trigger};

/// A unit of behaviour: a pure step over inputs, outputs and parameters that the host owns, and a state.
///
/// Write the implementation under the `#[module]` macro, which supplies name, stage and [`spec`](Module::spec) and, when the state
/// has a default, [`create`](Module::create).
pub trait Module: Sized + 'static {
    /// What it reads and writes.
    type Io: Ports;
    /// What users may tune.
    type Params: Params;
    /// What it remembers from step to step; the host saves, restores and forks it.
    type State: Serialize + DeserializeOwned + Send + 'static;

    /// The name by which configuration finds it, in snake case.
    const NAME: &'static str;
    /// What it does.
    const DOC: &'static str = "";
    /// The step of the main loop that it belongs to.
    const STAGE: Stage;

    /// Whether its parameters name a robot, whose hardware [`hardware`](Module::hardware) returns.
    const DESCRIBES_HARDWARE: bool = false;

    /// Trigger and deadline.
    fn spec() -> Spec;

    /// The state before the first tick.
    ///
    /// # Errors
    /// A refusal in words; the agent then does not start.
    fn create(setup: &Setup<'_>, params: &Self::Params) -> Result<Self::State, Refusal>;

    /// The hardware of the robots that its parameters name, asked before it is created and after each change of its parameters.
    ///
    /// # Errors
    /// A refusal when there is no such robot: `params.NAME: ` and what was expected.
    fn hardware(_: &Setup<'_>, _: &Self::Params) -> Result<Vec<Hardware>, Refusal> {
        Ok(Vec::new())
    }

    /// One step. It must not wait, and knows the time only from `now`.
    fn tick(state: &mut Self::State, io: &Self::Io, params: &Self::Params, now: &Tick) -> Outcome;

    /// Whether the module may be unloaded now. A refusal is a veto: the arm would fall.
    ///
    /// # Errors
    /// The reason of the veto.
    fn may_unload(_: &Self::State) -> Result<(), Refusal> {
        Ok(())
    }
}

/// Trigger and deadline of a module.
#[derive(Clone, Debug)]
pub struct Spec {
    /// When it runs.
    pub trigger: Trigger,
    /// How long a tick may take, nanoseconds.
    pub deadline: Option<u64>,
    /// What only one module of a robot may be, such as `plan`; empty for nothing.
    pub unique: &'static str,
}

/// How a tick went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub enum Outcome {
    /// As intended.
    Ok = 0,
    /// With less than it wants, such as a stale input; the reason belongs in the log.
    Degraded = 1,
    /// It could not do its work; outputs of this tick are dropped and outputs with a safe value take that.
    Failed = 2,
}

/// Why a module can't be set up.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Refusal(pub String);

impl From<String> for Refusal {
    fn from(reason: String) -> Self {
        Self(reason)
    }
}

impl From<&str> for Refusal {
    fn from(reason: &str) -> Self {
        Self(reason.into())
    }
}
