//! Ports that programs outside of the agent fill and read, such as ROS nodes.

use slate_blackboard::Access;
use slate_configuration::Configuration;
use slate_module::{Direction, PortDescription};

use crate::property_index::{PropertyFacts, PropertyIndex};
use crate::survey::{Survey, bridge_refusal, manual_value_refusal, ungated_command};

/// Error of setting an input from outside of the agent.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{reason}")]
pub struct ExternalInputError {
    /// Reason.
    pub reason: String,
    /// Remedy.
    pub help: &'static str,
}

/// Properties with their ports, and the rules for programs outside of the agent.
pub trait ExternalPorts: PropertyIndex {
    /// Returns the port of a module at a path.
    fn port(&self, path: &str) -> Option<PortDescription>;

    /// Returns true in lockstep, with time set by its source.
    fn is_lockstep(&self) -> bool;

    /// Applies a rule to the composition.
    fn apply<T>(&self, rule: impl FnOnce(&Configuration, &Survey<'_>) -> T) -> T;

    /// Returns the reason for which an input can't be set by hand, if any.
    /// Such an input moves a robot past its gate, or only Knowledge sets it.
    fn hand_refusal(&self, input: &str) -> Option<String> {
        let refusal = self.apply(|configuration, survey| manual_value_refusal(configuration, survey, input));
        refusal.map(|(reason, _)| reason.text)
    }

    /// Returns why a program outside can't read a property, with the remedy.
    /// Such a property is a command that has not passed its gate.
    fn output_refusal(&self, path: &str) -> Option<(String, &'static str)> {
        let port = self.port(path)?;
        (port.direction == Direction::Command).then(|| {
            let (reason, help) = ungated_command(path);
            (reason.text, help)
        })
    }

    /// Returns an input that a program outside of the agent can set, and its field.
    /// No link fills the input; the path names the field.
    ///
    /// # Errors
    /// The reason for which it can't be filled.
    fn external_input(&self, input: &str) -> Result<(Self::Property, String), ExternalInputError> {
        let wrong = |reason: String, help| Err(ExternalInputError { reason, help });
        let (property, field) = match self.find(input) {
            Ok(found) => found,
            Err(error) => return wrong(error.to_string(), "`slate list` shows the inputs"),
        };
        let whole = input.strip_suffix(&field).unwrap_or(input).trim_end_matches('/');
        if property.path() != whole {
            return wrong(format!("it is linked, from /{}", property.path()), "take the link out of [links]");
        }
        let direction = self.port(whole).map(|port| port.direction);
        if !matches!(direction, Some(Direction::Input | Direction::Queue))
            || property.access() != Access::Setting
        {
            let reason = "it is not an input with values".to_owned();
            return wrong(
                reason,
                "name an input; parameters, inboxes and outputs are not filled from outside",
            );
        }
        if direction == Some(Direction::Queue) && !field.is_empty() {
            let reason = format!("`{field}` is a field, and a queue takes whole values");
            return wrong(reason, "name the queue input alone, or read the field with a plain input");
        }
        if let Some(reason) = self.apply(|_, survey| bridge_refusal(survey, whole)) {
            return wrong(reason.text, "let a Sensor of the robot read it");
        }
        match self.hand_refusal(whole) {
            Some(reason) => wrong(reason, "let its link fill it, and name an input of a module before that"),
            None => Ok((property, field)),
        }
    }

    /// Returns the inbox at a path, if external programs may send to it.
    ///
    /// # Errors
    /// When it is no inbox, or takes messages of blocks alone.
    fn external_inbox(&self, inbox: &str) -> Result<Self::Property, ExternalInputError> {
        let wrong = |reason: String, help| Err(ExternalInputError { reason, help });
        let (property, field) = match self.find(inbox) {
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
        match self.apply(|_, survey| bridge_refusal(survey, property.path())) {
            Some(reason) => wrong(reason.text, "let a Sensor of the robot read it"),
            None => Ok(property),
        }
    }
}
