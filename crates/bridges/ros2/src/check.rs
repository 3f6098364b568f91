use slate_ros_messages::WireFormat;
use slate_runtime::ExternalPorts;
use slate_topics::{RosError, check_actions, check_ports};

use crate::settings::RosSettings;

/// Checks that the ports that settings name exist and fit topics and services.
/// It opens nothing.
///
/// # Errors
/// The first that does not fit.
pub fn check_topics(ports: &impl ExternalPorts, settings: &RosSettings) -> Result<(), RosError> {
    let services = (&settings.serve[..], &settings.call[..]);
    check_actions(ports, &settings.offered_actions, &settings.called_actions)?;
    check_ports(WireFormat::Cdr, ports, &settings.topics, services, &settings.options)
}
