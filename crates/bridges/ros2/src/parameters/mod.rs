//! Parameters of modules as those of the agent's node.

mod definitions;
mod handler;

use std::sync::Arc;

use slate_control::ControlSurface;
use slate_topics::{AgentOperations, ParameterAccess};

use crate::participant::RosParticipant;
use crate::services::{ServiceGroup, ServiceServer};
use crate::settings::{RosSettings, TABLE};
pub use definitions::MESSAGES;
use definitions::{SERVICES, service_type};
use handler::ParameterHandler;
use slate_topics::RosError;

/// The services of the node's parameters.
///
/// # Errors
/// When DDS refuses.
pub fn parameter_services(
    participant: &RosParticipant,
    surface: &Arc<ControlSurface>,
    settings: &RosSettings,
) -> Result<Option<ServiceGroup>, RosError> {
    if settings.options.parameters == ParameterAccess::None {
        return Ok(None);
    }
    let mut servers = Vec::new();
    for (name, kind, _) in SERVICES {
        let service = settings.node.topic(&format!("~/{name}")).map_err(|reason| {
            let help = "take a shorter name for the node: node = \"r2\" in [ros2]";
            RosError::Definition { name: name.into(), reason, help }
        })?;
        let of = service_type(kind).map_err(|reason| RosError::definition(kind, reason))?;
        servers.push(ServiceServer::open(participant, &service, &of)?);
    }
    let handler = Box::new(ParameterHandler {
        operations: AgentOperations::new(surface, TABLE)?,
        composer: surface.agent.composer().clone(),
        is_settable: settings.options.parameters == ParameterAccess::Set,
    });
    Ok(Some(ServiceGroup { name: "ros2-parameters", servers, handler }))
}
