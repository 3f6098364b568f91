use serde::{Serialize, de::DeserializeOwned};

use crate::{Hardware, Params, Ports, Setup, Stage, Tick, Trigger};

/// Unit of behavior: a pure step over inputs, outputs, parameters and a state.
/// The host owns inputs, outputs and parameters.
///
/// Write the implementation under the `#[module]` macro, which supplies name, stage and [`spec`](Module::spec) and, when the state
/// has a default, [`create`](Module::create).
pub trait Module: Sized + 'static {
    /// Ports.
    type Io: Ports;
    /// Parameters, which users may tune.
    type Params: Params;
    /// State kept from step to step; the host saves, restores and forks it.
    type State: Serialize + DeserializeOwned + Send + 'static;

    /// Name by which configuration finds it, in snake case.
    const NAME: &'static str;
    /// Description of the module.
    const DOC: &'static str = "";
    /// Stage of the main loop.
    const STAGE: Stage;

    /// True if its parameters name a robot.
    /// [`hardware`](Module::hardware) then returns that robot's hardware.
    const DESCRIBES_HARDWARE: bool = false;

    /// Returns trigger and deadline.
    fn spec() -> Spec;

    /// Returns the state before the first tick.
    ///
    /// # Errors
    /// A refusal in words; the agent then does not start.
    fn create(setup: &Setup<'_>, params: &Self::Params) -> Result<Self::State, Refusal>;

    /// Returns the hardware of the robots that its parameters name.
    /// Called before it is created and after each change of its parameters.
    ///
    /// # Errors
    /// A refusal of an unknown robot: `params.NAME: ` and the expected value.
    fn hardware(_: &Setup<'_>, _: &Self::Params) -> Result<Vec<Hardware>, Refusal> {
        Ok(Vec::new())
    }

    /// Makes one step, which must not wait, and knows the time only from `now`.
    fn tick(state: &mut Self::State, io: &Self::Io, params: &Self::Params, now: &Tick) -> Outcome;

    /// Returns `Err` to veto unloading, e.g. while an arm would fall.
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
    /// Trigger.
    pub trigger: Trigger,
    /// Deadline of a tick, ns.
    pub deadline: Option<u64>,
    /// Role of which a robot may have only one module, such as `plan`; empty for none.
    pub unique: &'static str,
}

/// Outcome of a tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub enum Outcome {
    /// Intended result.
    Ok = 0,
    /// Degraded result, such as with a stale input; the reason belongs in the log.
    Degraded = 1,
    /// Failure; its outputs are dropped, and outputs with a safe value take that.
    Failed = 2,
}

/// Reason of a refusal, such as of a setup.
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
