//! Parameters of modules as those of the agent's node.

mod definitions;
mod handler;

use std::sync::Arc;

use slate_control::ControlSurface;
use slate_topics::{AgentOperations, NodeAccess};

use crate::services::{ServiceGroup, ServiceServer};
use crate::settings::{RosSettings, TABLE};
use crate::wire::NodeWire;
pub use definitions::MESSAGES;
use definitions::{SERVICES, service_type};
use handler::ParameterHandler;
use slate_topics::RosError;

/// Returns the services of the node's parameters.
///
/// # Errors
/// When the middleware refuses.
pub fn parameter_services(
    wire: &dyn NodeWire,
    surface: &Arc<ControlSurface>,
    settings: &RosSettings,
) -> Result<Option<ServiceGroup>, RosError> {
    if settings.options.parameters == NodeAccess::None {
        return Ok(None);
    }
    let mut servers = Vec::new();
    for (name, kind, _) in SERVICES {
        let service = settings.node.private(name)?;
        let of = service_type(kind).map_err(|reason| RosError::definition(kind, reason))?;
        servers.push(ServiceServer::open(wire, &service, &of)?);
    }
    let handler = Box::new(ParameterHandler {
        operations: AgentOperations::new(surface, TABLE)?,
        composer: surface.agent.composer().clone(),
        is_settable: settings.options.parameters == NodeAccess::Set,
    });
    Ok(Some(ServiceGroup { name: "ros2-parameters", servers, handler }))
}
