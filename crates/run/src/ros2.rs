//! Participation of a run in ROS 2.

use slate_runtime::configuration::{Configuration, Report};
use slate_runtime::{Agent, ExternalPorts};

#[cfg(feature = "ros2")]
mod built_in {
    use std::sync::Arc;

    use slate_control::ControlSurface;
    use slate_ros2::{RosBridge, RosSettings, check_topics};

    use super::{Agent, Configuration, ExternalPorts, Report};
    use crate::RunError;

    /// ROS 2 node of an agent, as long as this value lives.
    pub struct RunBridge(RosBridge);

    impl RunBridge {
        /// Joins the ROS 2 domain of a configuration, if it names one.
        /// Nothing is sent or set yet.
        pub fn open(agent: &Agent, surface: &Arc<ControlSurface>) -> Result<Option<Self>, Report> {
            let configuration = agent.configuration();
            let Some(settings) = RosSettings::of(&configuration)? else { return Ok(None) };
            let bridge = RosBridge::open(surface, &settings);
            bridge.map(|bridge| Some(Self(bridge))).map_err(|error| error.report(&configuration))
        }

        /// Begins to send and to set inputs.
        pub fn start(&mut self, agent: &Agent) -> Result<(), RunError> {
            self.0.start().map_err(|error| error.report(&agent.configuration()).into())
        }
    }

    /// Checks that an agent could be the ROS 2 node of its configuration.
    /// It opens nothing.
    ///
    /// # Errors
    /// An invalid table `[ros2]`, or a property that does not fit its topic.
    pub fn check(ports: &impl ExternalPorts, configuration: &Configuration) -> Result<(), Report> {
        let Some(settings) = RosSettings::of(configuration)? else { return Ok(()) };
        check_topics(ports, &settings).map_err(|error| error.report(configuration))
    }
}

#[cfg(not(feature = "ros2"))]
mod built_in {
    use std::sync::Arc;

    use slate_control::ControlSurface;

    use super::{Agent, Configuration, ExternalPorts, Report};
    use crate::RunError;

    /// Name of the table.
    const TABLE: &str = "ros2";

    /// Placeholder without the feature: no agent is a node.
    pub struct RunBridge;

    impl RunBridge {
        pub fn open(agent: &Agent, _: &Arc<ControlSurface>) -> Result<Option<Self>, Report> {
            check(&agent.composer(), &agent.configuration()).map(|()| None)
        }

        pub fn start(&mut self, _: &Agent) -> Result<(), RunError> {
            Ok(())
        }
    }

    pub fn check(_: &impl ExternalPorts, configuration: &Configuration) -> Result<(), Report> {
        let Some(table) = configuration.value(TABLE) else { return Ok(()) };
        let help =
            "build it with the feature `ros2`: cargo build --release --features ros2; or take the table away";
        let message =
            slate_runtime::ErrorCode::Feature.of("this program is built without ROS 2, which [ros2] needs");
        Err(configuration.diagnostic(table.span, message, Some(help.into())).into())
    }
}

pub use built_in::{RunBridge, check};
