use slate_ros_messages::WireFormat;
use slate_runtime::ExternalPorts;
use slate_topics::{RosError, check_ports};

use crate::settings::Ros1Settings;

/// Checks that the ports that settings name exist and fit topics and services.
/// It opens nothing.
///
/// # Errors
/// The first that does not fit.
pub fn check_topics(ports: &impl ExternalPorts, settings: &Ros1Settings) -> Result<(), RosError> {
    let services = (&settings.serve[..], &settings.call[..]);
    check_ports(WireFormat::Ros1, ports, &settings.topics, services, &settings.options)
}
