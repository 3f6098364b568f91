//! Participation of a run in a network.

use slate_network::{NetworkSettings, check_properties};
use slate_runtime::ExternalPorts;
use slate_runtime::configuration::{Configuration, Report};

/// Settings of the table `[network]`, when the configuration has one.
///
/// # Errors
/// An invalid table, or a program without networks.
pub fn network_settings(configuration: &Configuration) -> Result<Option<NetworkSettings>, Report> {
    let settings = NetworkSettings::of(configuration)?;
    let table = configuration.value(slate_network::TABLE).filter(|_| !cfg!(feature = "zenoh"));
    match table {
        Some(table) => {
            let help = "build it with the feature `zenoh`: cargo build --release --features zenoh; or take the table away";
            let message = slate_runtime::ErrorCode::Feature
                .of("this program is built without Zenoh, which [network] needs");
            Err(configuration.diagnostic(table.span, message, Some(help.into())).into())
        }
        None => Ok(settings),
    }
}

/// Checks that an agent could take part in the network of its configuration.
/// It opens nothing.
///
/// # Errors
/// An invalid table, or an input that can't read.
pub fn check(ports: &impl ExternalPorts, configuration: &Configuration) -> Result<(), Report> {
    let Some(settings) = network_settings(configuration)? else { return Ok(()) };
    check_properties(ports, &settings).map_err(|error| error.report(configuration))
}

#[cfg(feature = "zenoh")]
mod built_in {
    use std::sync::Arc;

    use slate_control::ControlSurface;
    use slate_network::AgentNetwork;

    use super::{Configuration, NetworkSettings, Report};

    /// Network participation of an agent, as long as this value lives.
    pub type RunNetwork = AgentNetwork;

    pub fn connect(
        surface: &Arc<ControlSurface>,
        settings: &NetworkSettings,
        configuration: &Configuration,
    ) -> Result<RunNetwork, Report> {
        slate_network::log_rejections();
        AgentNetwork::start(surface, settings).map_err(|error| error.report(configuration))
    }
}

#[cfg(not(feature = "zenoh"))]
mod built_in {
    use std::sync::Arc;

    use slate_control::ControlSurface;

    use super::{Configuration, NetworkSettings, Report};

    /// Placeholder without the feature: no configuration has settings.
    pub struct RunNetwork;

    pub fn connect(
        _: &Arc<ControlSurface>,
        _: &NetworkSettings,
        _: &Configuration,
    ) -> Result<RunNetwork, Report> {
        Ok(RunNetwork)
    }
}

pub use built_in::connect;
