//! State and switches of an agent's modules, for tools.

use slate_blackboard::BoardError;
use slate_blackboard::interface::Value;

use super::handle::AgentHandle;
use crate::recording::Change;

/// State and switches of modules.
pub(super) struct ModuleAccess<'c> {
    agent: &'c AgentHandle,
}

impl<'c> ModuleAccess<'c> {
    pub fn new(agent: &'c AgentHandle) -> Self {
        Self { agent }
    }

    /// Switches a module on or off.
    pub fn enable(&self, module: &str, on: bool) -> Result<(), BoardError> {
        let (path, value) = (format!("{module}/enabled/value"), Value::Bool(on));
        let change = Change::Setting { path: format!("{module}/enabled"), value: Some(on.to_string()) };
        self.agent
            .recorder
            .make(vec![change], || self.agent.board().write(&path, &value, self.agent.now()).map(drop))
    }
}
