//! Publication of a run's behavior trees to monitors.

use slate_runtime::configuration::{Configuration, Report};
use slate_runtime::{Agent, ExternalPorts};

#[cfg(feature = "groot")]
mod built_in {
    use slate_groot::{GrootBridge, GrootSettings, check_trees};

    use super::{Agent, Configuration, ExternalPorts, Report};

    /// Monitors see the trees of an agent as long as this lives.
    pub struct GrootRun(#[allow(dead_code, reason = "it ends with this")] GrootBridge);

    impl GrootRun {
        /// Opens the ports that a configuration names, if any.
        /// It prints the addresses of the trees.
        pub fn open(agent: &Agent) -> Result<Option<Self>, Report> {
            let configuration = agent.configuration();
            let Some(settings) = GrootSettings::of(&configuration)? else { return Ok(None) };
            let bridge = GrootBridge::open(&agent.composer(), &settings);
            let bridge = bridge.map_err(|error| error.report(&configuration))?;
            for (plan, address) in bridge.addresses() {
                eprintln!("groot: the tree of /{plan} is at {address}");
            }
            Ok(Some(Self(bridge)))
        }
    }

    /// Checks that an agent has the trees that its configuration shows to monitors.
    /// It opens nothing.
    ///
    /// # Errors
    /// An invalid table `[groot]`, or a Plan that follows no tree.
    pub fn check(ports: &impl ExternalPorts, configuration: &Configuration) -> Result<(), Report> {
        let Some(settings) = GrootSettings::of(configuration)? else { return Ok(()) };
        check_trees(ports, &settings).map_err(|error| error.report(configuration))
    }
}

#[cfg(not(feature = "groot"))]
mod built_in {
    use super::{Agent, Configuration, ExternalPorts, Report};

    /// Placeholder without the feature: no tree is shown.
    pub struct GrootRun;

    impl GrootRun {
        pub fn open(agent: &Agent) -> Result<Option<Self>, Report> {
            check(&agent.composer(), &agent.configuration()).map(|()| None)
        }
    }

    pub fn check(_: &impl ExternalPorts, configuration: &Configuration) -> Result<(), Report> {
        let Some(table) = configuration.value("groot") else { return Ok(()) };
        let help = "build it with the feature `groot`: cargo build --release --features groot; or take the table away";
        let message =
            slate_runtime::ErrorCode::Feature.of("this program is built without Groot, which [groot] needs");
        Err(configuration.diagnostic(table.span, message, Some(help.into())).into())
    }
}

pub use built_in::{GrootRun, check};
