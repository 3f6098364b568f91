//! Inputs that programs outside of the agent fill, such as nodes of ROS.

use std::sync::Arc;

use slate_blackboard::{Access, Property};
use slate_composition::{Complaints, survey};
use slate_module::Direction;

use super::handle::AgentHandle;

/// Why a program outside of the agent can't fill an input.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{reason}")]
pub struct ExternalInputError {
    /// In words.
    pub reason: String,
    /// What to do.
    pub help: &'static str,
}

/// A value for an input, from outside of the agent.
#[derive(Clone, Debug)]
pub struct ExternalValue {
    /// Path of the input.
    pub input: Arc<str>,
    /// The whole value, as it lies in memory.
    pub bytes: Vec<u8>,
}

/// Why nobody sets an input, if it moves a robot past its gate or Knowledge alone fills it.
pub(in crate::agent) fn hand_refusal(agent: &AgentHandle, input: &str) -> Option<String> {
    let composition = agent.composition();
    let configuration = &composition.configuration;
    let survey = survey(configuration, &composition.catalogue, &mut Complaints::new(configuration));
    let refusal = slate_composition::hand_refusal(configuration, &survey, input);
    refusal.map(|(reason, _)| reason.text)
}

/// Fills inputs from outside.
pub(in crate::agent) struct ExternalInputs<'a> {
    agent: &'a AgentHandle,
}

impl<'a> ExternalInputs<'a> {
    pub fn new(agent: &'a AgentHandle) -> Self {
        Self { agent }
    }

    pub fn find(&self, input: &str) -> Result<Arc<Property>, ExternalInputError> {
        let wrong = |reason: String, help| Err(ExternalInputError { reason, help });
        let (property, field) = match self.agent.board().find(input) {
            Ok(found) => found,
            Err(error) => return wrong(error.to_string(), "`slate list` shows the inputs"),
        };
        if !field.is_empty() {
            return wrong(
                format!("`{field}` is a field, and the whole input is filled"),
                "name the input alone",
            );
        }
        if property.path() != input {
            return wrong(format!("it is linked, from /{}", property.path()), "take the link out of [links]");
        }
        let port = self.agent.overview().port(input);
        if port.is_none_or(|port| port.direction != Direction::Input) || property.access() != Access::Setting
        {
            let reason = "it is no input that holds one value".to_owned();
            return wrong(
                reason,
                "name an input; queues, parameters and outputs are not filled from outside",
            );
        }
        match hand_refusal(self.agent, input) {
            Some(reason) => wrong(reason, "let its link fill it, and name an input of a module before that"),
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
    property.set_bytes(&value.bytes, agent.now()).map(drop).map_err(|error| wrong(error.to_string()))
}
