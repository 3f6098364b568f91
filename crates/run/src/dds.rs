//! How a run takes part in DDS.

use slate_runtime::Agent;
use slate_runtime::configuration::{Configuration, Report};

#[cfg(feature = "dds")]
mod built_in {
    use std::sync::Arc;

    use slate_control::ControlSurface;
    use slate_dds::{DdsBridge, DdsSettings, check_topics};

    use super::{Agent, Configuration, Report};
    use crate::RunError;

    /// An agent is a participant of DDS as long as this lives.
    pub struct DdsRun(DdsBridge);

    impl DdsRun {
        /// Joins the domain that a configuration names, if it names DDS; nothing is sent or set yet.
        pub fn open(agent: &Agent, surface: &Arc<ControlSurface>) -> Result<Option<Self>, Report> {
            let configuration = agent.configuration();
            let Some(settings) = DdsSettings::of(&configuration)? else { return Ok(None) };
            let bridge = DdsBridge::open(surface, &settings);
            bridge.map(|bridge| Some(Self(bridge))).map_err(|error| error.report(&configuration))
        }

        /// Begins to send and to set inputs.
        pub fn start(&mut self, agent: &Agent) -> Result<(), RunError> {
            self.0.start().map_err(|error| error.report(&agent.configuration()).into())
        }
    }

    pub fn check(agent: &Agent, configuration: &Configuration) -> Result<(), Report> {
        let Some(settings) = DdsSettings::of(configuration)? else { return Ok(()) };
        check_topics(&agent.composer(), &settings).map_err(|error| error.report(configuration))
    }
}

#[cfg(not(feature = "dds"))]
mod built_in {
    use std::sync::Arc;

    use slate_control::ControlSurface;

    use super::{Agent, Configuration, Report};
    use crate::RunError;

    /// Nothing: without the feature, no agent takes part.
    pub struct DdsRun;

    impl DdsRun {
        pub fn open(agent: &Agent, _: &Arc<ControlSurface>) -> Result<Option<Self>, Report> {
            check(agent, &agent.configuration()).map(|()| None)
        }

        pub fn start(&mut self, _: &Agent) -> Result<(), RunError> {
            Ok(())
        }
    }

    /// Links are refused with those of all bridges that are not built in.
    pub fn check(_: &Agent, configuration: &Configuration) -> Result<(), Report> {
        let Some(table) = configuration.value("dds") else { return Ok(()) };
        let help =
            "build it with the feature `dds`: cargo build --release --features dds; or take the table away";
        let message =
            slate_runtime::Mistake::Feature.of("this program is built without DDS, which [dds] needs");
        Err(configuration.diagnostic(table.span, message, Some(help.into())).into())
    }
}

pub use built_in::DdsRun;

/// Whether an agent could have the topics of DDS that its configuration describes; nothing is opened.
///
/// # Errors
/// Mistake in the table `[dds]`, or a property that does not fit its topic.
pub fn check_dds(agent: &Agent) -> Result<(), Report> {
    built_in::check(agent, &agent.configuration())
}
