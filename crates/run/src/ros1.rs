//! Participation of a run in ROS 1.

use slate_runtime::configuration::{Configuration, Report};
use slate_runtime::{Agent, ExternalPorts};

#[cfg(feature = "ros1")]
mod built_in {
    use std::sync::Arc;

    use slate_control::ControlSurface;
    use slate_ros1::{Ros1Bridge, Ros1Settings, check_topics};

    use super::{Agent, Configuration, ExternalPorts, Report};
    use crate::RunError;

    /// ROS 1 node of an agent, as long as this value lives.
    pub struct Ros1Run(Ros1Bridge);

    impl Ros1Run {
        /// Registers with the ROS 1 master of a configuration, if it names one.
        /// Nothing is sent or set yet.
        pub fn open(agent: &Agent, surface: &Arc<ControlSurface>) -> Result<Option<Self>, Report> {
            let configuration = agent.configuration();
            let Some(settings) = Ros1Settings::of(&configuration)? else { return Ok(None) };
            let bridge = Ros1Bridge::open(surface, &settings);
            bridge.map(|bridge| Some(Self(bridge))).map_err(|error| error.report(&configuration))
        }

        /// Begins to send and to set inputs.
        pub fn start(&mut self, agent: &Agent) -> Result<(), RunError> {
            self.0.start().map_err(|error| error.report(&agent.configuration()).into())
        }
    }

    /// Checks that an agent could be the ROS 1 node of its configuration.
    /// It opens nothing.
    ///
    /// # Errors
    /// An invalid table `[ros1]`, or a property that does not fit its topic.
    pub fn check(ports: &impl ExternalPorts, configuration: &Configuration) -> Result<(), Report> {
        let Some(settings) = Ros1Settings::of(configuration)? else { return Ok(()) };
        check_topics(ports, &settings).map_err(|error| error.report(configuration))
    }
}

#[cfg(not(feature = "ros1"))]
mod built_in {
    use std::sync::Arc;

    use slate_control::ControlSurface;

    use super::{Agent, Configuration, ExternalPorts, Report};
    use crate::RunError;

    /// Placeholder without the feature: no agent is a node.
    pub struct Ros1Run;

    impl Ros1Run {
        pub fn open(agent: &Agent, _: &Arc<ControlSurface>) -> Result<Option<Self>, Report> {
            check(&agent.composer(), &agent.configuration()).map(|()| None)
        }

        pub fn start(&mut self, _: &Agent) -> Result<(), RunError> {
            Ok(())
        }
    }

    /// Links are refused with those of all bridges that are not built in.
    pub fn check(_: &impl ExternalPorts, configuration: &Configuration) -> Result<(), Report> {
        let Some(table) = configuration.value("ros1") else { return Ok(()) };
        let help =
            "build it with the feature `ros1`: cargo build --release --features ros1; or take the table away";
        let message =
            slate_runtime::ErrorCode::Feature.of("this program is built without ROS 1, which [ros1] needs");
        Err(configuration.diagnostic(table.span, message, Some(help.into())).into())
    }
}

pub use built_in::{Ros1Run, check};
