//! The setup of a module, and the ends of its links.

use std::sync::Arc;
use std::time::Duration;

use slate_blackboard::interface::Value;
use slate_module::{Description, ModuleKind, Refusal, Setup};

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

/// The end of a link in its module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Wire {
    /// A port, by its place in the description.
    Port(usize),
    /// The switch.
    Enabled,
    /// The parameters.
    Params,
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
