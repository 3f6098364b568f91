//! How a run takes part in ROS 1.

use slate_runtime::Agent;
use slate_runtime::configuration::{Configuration, Report};

#[cfg(feature = "ros1")]
mod built_in {
    use std::sync::Arc;

    use slate_control::ControlSurface;
    use slate_ros1::{Ros1Bridge, Ros1Settings, check_topics};

    use super::{Agent, Configuration, Report};
    use crate::RunError;

    /// An agent is a node of ROS 1 as long as this lives.
    pub struct Ros1Run(Ros1Bridge);

    impl Ros1Run {
        /// Registers with the master that a configuration names, if it names ROS 1; nothing is sent or set yet.
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

    pub fn check(agent: &Agent, configuration: &Configuration) -> Result<(), Report> {
        let Some(settings) = Ros1Settings::of(configuration)? else { return Ok(()) };
        check_topics(&agent.composer(), &settings).map_err(|error| error.report(configuration))
    }
}

#[cfg(not(feature = "ros1"))]
mod built_in {
    use std::sync::Arc;

    use slate_control::ControlSurface;

    use super::{Agent, Configuration, Report};
    use crate::RunError;

    /// Nothing: without the feature, no agent is a node.
    pub struct Ros1Run;

    impl Ros1Run {
        pub fn open(agent: &Agent, _: &Arc<ControlSurface>) -> Result<Option<Self>, Report> {
            check(agent, &agent.configuration()).map(|()| None)
        }

        pub fn start(&mut self, _: &Agent) -> Result<(), RunError> {
            Ok(())
        }
    }

    /// Links are refused with those of all bridges that are not built in.
    pub fn check(_: &Agent, configuration: &Configuration) -> Result<(), Report> {
        let Some(table) = configuration.value("ros1") else { return Ok(()) };
        let help =
            "build it with the feature `ros1`: cargo build --release --features ros1; or take the table away";
        let message =
            slate_runtime::Mistake::Feature.of("this program is built without ROS 1, which [ros1] needs");
        Err(configuration.diagnostic(table.span, message, Some(help.into())).into())
    }
}

pub use built_in::Ros1Run;

/// Whether an agent could be the node of ROS 1 that its configuration describes; nothing is opened.
///
/// # Errors
/// What is wrong with the table `[ros1]`, or a property that does not fit its topic.
pub fn check_ros1(agent: &Agent) -> Result<(), Report> {
    built_in::check(agent, &agent.configuration())
}
