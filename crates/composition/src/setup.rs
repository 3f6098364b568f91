//! The setup of a module.

use std::sync::Arc;
use std::time::Duration;

use slate_blackboard::interface::Value;
use slate_module::{Description, ModuleKind, PortDescription, Refusal, Setup};

/// Setup of a module, kept for its re-creation.
#[derive(Clone, Debug)]
pub struct OwnSetup {
    /// The module's name.
    pub name: Arc<str>,
    /// The seed of the agent.
    pub seed: u64,
    /// The period of the loop, nanoseconds.
    pub period: u64,
    /// Section of the configuration that its kind requests.
    pub section: Option<Value>,
    /// Parameters, only for a description of hardware.
    pub params: Option<Vec<u8>>,
}

impl OwnSetup {
    /// Passes the setup to `work` in the form that modules take.
    pub fn with<R>(&self, work: impl FnOnce(&Setup<'_>) -> R) -> R {
        let (seed, period) = (self.seed, self.period);
        let (section, params) = (self.section.as_ref(), self.params.as_deref());
        work(&Setup { name: &self.name, seed, period, section, params })
    }
}

/// Describes a kind: its ports and parameters, within the time of a step.
pub type Describe = fn(&ModuleKind, &OwnSetup, Duration) -> Result<Description, Refusal>;

/// Describes a kind in the calling thread, without a time limit.
///
/// # Errors
/// The module's refusal.
pub fn describe(kind: &ModuleKind, setup: &OwnSetup, _: Duration) -> Result<Description, Refusal> {
    setup.with(|setup| kind.describe(setup))
}

/// Setup of a module that is tried without an agent.
#[derive(Clone, Debug)]
pub struct SetupTrial {
    /// Kind of the module.
    pub kind: ModuleKind,
    /// Its setup.
    pub setup: OwnSetup,
    /// Its parameters.
    pub params: Vec<u8>,
    /// Its ports.
    pub ports: Vec<PortDescription>,
    /// Memory limit of an isolated module, bytes, 0 for none.
    /// `None` for other modules.
    pub memory: Option<u64>,
    /// State that it restores, if any.
    pub state: Option<Vec<u8>>,
}

/// Makes an instance and ends it, within a multiple of the time of a step.
/// Returns the result of the restoration.
pub type SetUp = fn(SetupTrial, Duration) -> Result<Result<(), Refusal>, Refusal>;

/// Sets up a module in the calling thread, without a time limit.
///
/// # Errors
/// The module's refusal.
pub fn set_up(trial: SetupTrial, _: Duration) -> Result<Result<(), Refusal>, Refusal> {
    let SetupTrial { kind, setup, params, state, .. } = &trial;
    setup.with(|setup| kind.try_out(setup, params, state.as_deref()))
}
