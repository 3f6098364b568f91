use slate_record::ros::WireFormat;
use slate_runtime::Composer;
use slate_topics::{RosError, check_actions, check_ports};

use crate::settings::RosSettings;

/// Checks that the ports that settings name exist and fit topics and services.
/// It opens nothing.
///
/// # Errors
/// The first that does not fit.
pub fn check_topics(composer: &Composer, settings: &RosSettings) -> Result<(), RosError> {
    let services = (&settings.serve[..], &settings.call[..]);
    check_actions(composer, &settings.offered_actions, &settings.called_actions)?;
    check_ports(WireFormat::Cdr, composer, &settings.topics, services, &settings.options)
}
