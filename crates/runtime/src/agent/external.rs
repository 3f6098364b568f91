//! Inputs that external programs fill, such as ROS nodes.

use std::sync::Arc;

use slate_blackboard::interface::Value;
use slate_composition::ExternalInputError;

use super::handle::AgentHandle;

/// External value for an input.
#[derive(Clone, Debug)]
pub struct ExternalValue {
    /// Path of the input.
    pub input: Arc<str>,
    /// The value.
    pub content: ExternalContent,
}

/// External value, or a part of one.
#[derive(Clone, Debug, PartialEq)]
pub enum ExternalContent {
    /// Whole value, in its memory layout.
    Bytes(Vec<u8>),
    /// A value without its type.
    Value {
        /// Field of the value; empty for the whole.
        field: String,
        /// The value.
        value: Value,
    },
}

/// End of a cycle in lockstep, at which inputs are set.
pub struct CycleEnd<'a> {
    agent: &'a AgentHandle,
    /// The time of the cycle, ns.
    pub now: u64,
    is_running: &'a dyn Fn() -> bool,
}

/// Callback at the end of each cycle in lockstep; it may block and set inputs.
/// An error, a reason in words, ends the run.
pub type ValueWait = Box<dyn FnMut(&CycleEnd<'_>) -> Result<(), String> + Send>;

impl<'a> CycleEnd<'a> {
    pub(in crate::agent) fn new(agent: &'a AgentHandle, now: u64, is_running: &'a dyn Fn() -> bool) -> Self {
        Self { agent, now, is_running }
    }

    /// Returns true while the run continues; afterwards nothing is waited for.
    pub fn is_running(&self) -> bool {
        (self.is_running)()
    }

    /// Sets an input before the next cycle; a rerun sets it after the same cycle.
    ///
    /// # Errors
    /// The input is not there, or the value does not fit.
    pub fn set(&self, value: &ExternalValue) -> Result<(), ExternalInputError> {
        set(self.agent, value)
    }
}

impl std::fmt::Debug for CycleEnd<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("CycleEnd").field("now", &self.now).finish_non_exhaustive()
    }
}

/// Setter of external inputs.
pub(in crate::agent) struct ExternalInputs<'a> {
    agent: &'a AgentHandle,
}

impl<'a> ExternalInputs<'a> {
    pub fn new(agent: &'a AgentHandle) -> Self {
        Self { agent }
    }

    pub fn set(&self, values: Vec<ExternalValue>) -> Vec<Result<(), ExternalInputError>> {
        let agent = self.agent.clone();
        let set = move |value: &ExternalValue| set(&agent, value);
        if !self.agent.shared.lockstep {
            return values.iter().map(set).collect();
        }
        // In the thread of the loop, so that a rerun sets them after the same cycle.
        let between = move |_: &_| Some(values.iter().map(set).collect());
        self.agent.shared.between_cycles(&[], between).unwrap_or_default()
    }
}

fn set(agent: &AgentHandle, value: &ExternalValue) -> Result<(), ExternalInputError> {
    if agent.shared.lockstep && agent.shared.cycles() == 0 {
        // By its time it could be a value from after that cycle.
        let reason = "the first cycle has not begun".to_owned();
        return Err(ExternalInputError { reason, help: "send it again" });
    }
    let wrong = |reason: String| ExternalInputError { reason, help: "`slate list` shows the inputs" };
    let found = agent.board().get(&value.input);
    let (property, _) = found.ok_or_else(|| wrong(format!("/{} is no longer there", value.input)))?;
    let now = agent.now();
    let set = match &value.content {
        ExternalContent::Bytes(bytes) => property.set_bytes(bytes, now),
        ExternalContent::Value { field, value } => property.set_from_outside(field, value, now),
    };
    set.map(drop).map_err(|error| wrong(error.to_string()))
}
