//! Publications of clients, and their destinations.

use serde_json::{Value as Json, json};
use slate_blackboard::Access;
use slate_blackboard::interface::{Descriptor, Value};

use super::FoxgloveSession;
use super::request::Advertised;
use slate_control::Operation;
use slate_control::Role;
use slate_control::operations::by_name;

/// Destination of a channel's messages.
pub(super) enum PublishTarget {
    /// Actuator that receives the messages while they come.
    Actuator(String),
    /// Mailbox that receives the messages.
    Inbox(String),
    /// Input that is set to the messages.
    Setting(String),
}

impl PublishTarget {
    /// Returns the operation that a message of the channel is.
    /// `None` for a command of an actuator.
    pub fn operation(&self) -> Option<&'static Operation> {
        match self {
            Self::Actuator(_) => None,
            Self::Inbox(_) => by_name("send"),
            Self::Setting(_) => by_name("write"),
        }
    }

    pub fn actuator(&self) -> Option<&str> {
        match self {
            Self::Actuator(name) => Some(name),
            Self::Inbox(_) | Self::Setting(_) => None,
        }
    }
}

impl FoxgloveSession {
    /// Returns the destination of a channel; an error if it has none.
    pub(super) fn destination(&self, channel: Advertised) -> Result<PublishTarget, String> {
        let topic = &channel.topic;
        if self.caller.role < Role::Operator {
            return Err(format!("{} may not publish {topic}", self.caller.role.with_article()));
        }
        if channel.encoding != "json" {
            return Err(format!("{topic} is published as `{}`; only json is taken", channel.encoding));
        }
        let path = topic.trim_start_matches('/');
        let actuators = self.surface.agent.composer().actuators();
        if let Some((name, _)) =
            actuators.into_iter().find(|(name, _)| path == name || path == format!("{name}/command"))
        {
            return Ok(PublishTarget::Actuator(name));
        }
        let (property, field) = self.surface.board().find(path).map_err(|error| error.to_string())?;
        match property.access() {
            _ if !field.is_empty() || property.path() != path => {
                Err(format!("{topic} is not a property that takes values"))
            }
            Access::Messages => Ok(PublishTarget::Inbox(path.into())),
            Access::Setting => Ok(PublishTarget::Setting(path.into())),
            Access::Output => Err(format!("{topic} is written by its module")),
        }
    }

    pub(super) fn publish(&mut self, channel: u32, payload: &[u8]) -> Result<(), String> {
        let Some(to) = self.published.get(&channel) else {
            return Err(format!("channel {channel} was not advertised"));
        };
        let body: Json =
            serde_json::from_slice(payload).map_err(|error| format!("a message is no JSON: {error}"))?;
        let (name, path) = match to {
            PublishTarget::Setting(path) => ("write", path),
            PublishTarget::Inbox(path) => ("send", path),
            PublishTarget::Actuator(name) => {
                let name = name.clone();
                return self.drive(&name, &body);
            }
        };
        let done = self.dispatcher.carry_out(&self.caller, name, &[("path", path)], body);
        done.map(drop).map_err(|problem| problem.to_string())
    }

    /// Commands an actuator by a person, with the hold time of teleoperation.
    fn drive(&mut self, actuator: &str, body: &Json) -> Result<(), String> {
        if !self.controls.contains_key(actuator) {
            let taken = self.surface.agent.composer().take_controls(actuator, &self.who);
            let taken = taken.map_err(|error| error.to_string())?;
            self.controls.insert(actuator.to_owned(), taken);
        }
        let Some(controls) = self.controls.get_mut(actuator) else { return Ok(()) };
        let body = planar_twist(controls.descriptor(), body);
        let command: Value = serde_json::from_value(body).map_err(|error| error.to_string())?;
        controls.command(&command).map_err(|error| error.to_string())
    }
}

/// Converts a ROS `Twist` to a planar one, if the robot takes that.
/// Any other message stays unchanged.
fn planar_twist(descriptor: &Descriptor, body: &Json) -> Json {
    let (forward, turning) = (body.pointer("/linear/x"), body.pointer("/angular/z"));
    match (forward, turning) {
        (Some(forward), Some(turning)) if descriptor.ros == "geometry_msgs/msg/Twist" => {
            json!({ "linear": forward, "angular": turning })
        }
        _ => body.clone(),
    }
}
