//! Modules of an agent, as tools look at them and switch them.

use slate_blackboard::BoardError;
use slate_blackboard::interface::Value;
use slate_module::{Parameter, PortDescription};

use super::handle::AgentHandle;
use crate::recording::Change;

/// Shows and switches modules.
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

    /// The parameters of a module, with their defaults and ranges; none of one that there is not.
    pub fn parameters(&self, module: &str) -> Vec<Parameter> {
        self.agent
            .composition()
            .assembly
            .modules
            .get(module)
            .map(|seat| seat.description.parameters.clone())
            .unwrap_or_default()
    }

    /// The port of a module at a path.
    pub fn port(&self, path: &str) -> Option<PortDescription> {
        let composition = self.agent.composition();
        let of = |name: &String| path.strip_prefix(name.as_str())?.strip_prefix('/');
        let (port, seat) = composition
            .assembly
            .modules
            .iter()
            .filter_map(|(name, seat)| Some((of(name)?, seat)))
            .min_by_key(|(port, _)| port.len())?;
        seat.description.ports.iter().find(|known| known.name == port).cloned()
    }
}
