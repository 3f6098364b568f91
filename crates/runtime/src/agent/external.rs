//! Inputs that external programs fill, such as ROS nodes.

use std::sync::Arc;

use slate_blackboard::interface::Value;
use slate_blackboard::{Access, Property};
use slate_composition::{DiagnosticCollector, Survey, bridge_refusal, survey, ungated_command};
use slate_configuration::Configuration;
use slate_module::Direction;

use super::handle::AgentHandle;

/// Error of setting an input from outside of the agent.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{reason}")]
pub struct ExternalInputError {
    /// Reason.
    pub reason: String,
    /// Remedy.
    pub help: &'static str,
}

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

/// Returns the reason for which an input can't be set by hand, if any.
/// Such an input moves a robot past its gate, or only Knowledge sets it.
pub(in crate::agent) fn hand_refusal(agent: &AgentHandle, input: &str) -> Option<String> {
    let refusal = refused(agent, |configuration, survey| {
        slate_composition::manual_value_refusal(configuration, survey, input)
    });
    refusal.map(|(reason, _)| reason.text)
}

/// Returns why programs outside can't read a property, with the remedy.
/// Such a property is a command that has not passed its gate.
pub(in crate::agent) fn output_refusal(agent: &AgentHandle, path: &str) -> Option<(String, &'static str)> {
    let port = agent.overview().port(path)?;
    (port.direction == Direction::Command).then(|| {
        let (reason, help) = ungated_command(path);
        (reason.text, help)
    })
}

/// Applies a rule to the present composition.
fn refused<T>(agent: &AgentHandle, rule: impl FnOnce(&Configuration, &Survey<'_>) -> T) -> T {
    let composition = agent.composition();
    let configuration = &composition.configuration;
    rule(
        configuration,
        &survey(configuration, &composition.catalogue, &mut DiagnosticCollector::new(configuration)),
    )
}

/// Setter of external inputs.
pub(in crate::agent) struct ExternalInputs<'a> {
    agent: &'a AgentHandle,
}

impl<'a> ExternalInputs<'a> {
    pub fn new(agent: &'a AgentHandle) -> Self {
        Self { agent }
    }

    pub fn find(&self, input: &str) -> Result<(Arc<Property>, String), ExternalInputError> {
        let wrong = |reason: String, help| Err(ExternalInputError { reason, help });
        let (property, field) = match self.agent.board().find(input) {
            Ok(found) => found,
            Err(error) => return wrong(error.to_string(), "`slate list` shows the inputs"),
        };
        let whole = input.strip_suffix(&field).unwrap_or(input).trim_end_matches('/');
        if property.path() != whole {
            return wrong(format!("it is linked, from /{}", property.path()), "take the link out of [links]");
        }
        let direction = self.agent.overview().port(whole).map(|port| port.direction);
        if !matches!(direction, Some(Direction::Input | Direction::Queue))
            || property.access() != Access::Setting
        {
            let reason = "it is no input with values".to_owned();
            return wrong(
                reason,
                "name an input; parameters, inboxes and outputs are not filled from outside",
            );
        }
        if direction == Some(Direction::Queue) && !field.is_empty() {
            let reason = format!("`{field}` is a field, and a queue takes whole values");
            return wrong(reason, "name the queue input alone, or read the field with a plain input");
        }
        if let Some(reason) = refused(self.agent, |_, survey| bridge_refusal(survey, whole)) {
            return wrong(reason.text, "let a Sensor of the robot read it");
        }
        match hand_refusal(self.agent, whole) {
            Some(reason) => wrong(reason, "let its link fill it, and name an input of a module before that"),
            None => Ok((property, field)),
        }
    }

    pub fn find_inbox(&self, inbox: &str) -> Result<Arc<Property>, ExternalInputError> {
        let wrong = |reason: String, help| Err(ExternalInputError { reason, help });
        let (property, field) = match self.agent.board().find(inbox) {
            Ok(found) => found,
            Err(error) => return wrong(error.to_string(), "`slate list` shows the inboxes"),
        };
        if property.access() != Access::Messages {
            return wrong("it takes no messages".into(), "name an inbox");
        }
        if !field.is_empty() {
            return wrong(
                format!("`{field}` is a field, and an inbox takes whole messages"),
                "name the inbox alone",
            );
        }
        match refused(self.agent, |_, survey| bridge_refusal(survey, property.path())) {
            Some(reason) => wrong(reason.text, "let a Sensor of the robot read it"),
            None => Ok(property),
        }
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
