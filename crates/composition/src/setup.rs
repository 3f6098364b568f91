//! What a module is told when it is set up, and what its links end at.

use std::sync::Arc;
use std::time::Duration;

use slate_blackboard::interface::Value;
use slate_module::{Description, ModuleKind, Refusal, Setup};

/// What a module is told when it is set up, kept for when it is made anew.
#[derive(Clone, Debug)]
pub struct OwnSetup {
    /// The module's name.
    pub name: Arc<str>,
    /// The seed of the agent.
    pub seed: u64,
    /// The period of the loop, nanoseconds.
    pub period: u64,
    /// The section of the configuration that its kind asks for.
    pub section: Option<Value>,
}

impl OwnSetup {
    /// Lends it in the form that modules take.
    pub fn with<R>(&self, work: impl FnOnce(&Setup<'_>) -> R) -> R {
        let (seed, period) = (self.seed, self.period);
        work(&Setup { name: &self.name, seed, period, section: self.section.as_ref() })
    }
}

/// What a link ends at in its own module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Wire {
    /// A port, by its place in the description.
    Port(usize),
    /// The switch.
    Enabled,
    /// The parameters.
    Params,
}

/// Asks a kind for its ports and parameters, for so long as steps may take.
pub type Describe = fn(&ModuleKind, &OwnSetup, Duration) -> Result<Description, Refusal>;

/// Asks a kind in this thread, however long it takes.
///
/// # Errors
/// The module's refusal.
pub fn describe(kind: &ModuleKind, setup: &OwnSetup, _: Duration) -> Result<Description, Refusal> {
    setup.with(|setup| kind.describe(setup))
}
