//! Participation of a run in DDS.

use slate_runtime::configuration::{Configuration, Report};
use slate_runtime::{Agent, ExternalPorts};

#[cfg(feature = "dds")]
mod built_in {
    use std::sync::Arc;

    use slate_control::ControlSurface;
    use slate_dds::{DdsBridge, DdsSettings, check_topics};

    use super::{Agent, Configuration, ExternalPorts, Report};
    use crate::RunError;

    /// DDS participant of an agent, as long as this value lives.
    pub struct DdsRun(DdsBridge);

    impl DdsRun {
        /// Joins the DDS domain of a configuration, if it names one.
        /// Nothing is sent or set yet.
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

    /// Checks that an agent could have the DDS topics of its configuration.
    /// It opens nothing.
    ///
    /// # Errors
    /// Error in the table `[dds]`, or a property that does not fit its topic.
    pub fn check(ports: &impl ExternalPorts, configuration: &Configuration) -> Result<(), Report> {
        let Some(settings) = DdsSettings::of(configuration)? else { return Ok(()) };
        check_topics(ports, &settings).map_err(|error| error.report(configuration))
    }
}

#[cfg(not(feature = "dds"))]
mod built_in {
    use std::sync::Arc;

    use slate_control::ControlSurface;

    use super::{Agent, Configuration, ExternalPorts, Report};
    use crate::RunError;

    /// Placeholder without the feature: no agent takes part.
    pub struct DdsRun;

    impl DdsRun {
        pub fn open(agent: &Agent, _: &Arc<ControlSurface>) -> Result<Option<Self>, Report> {
            check(&agent.composer(), &agent.configuration()).map(|()| None)
        }

        pub fn start(&mut self, _: &Agent) -> Result<(), RunError> {
            Ok(())
        }
    }

    /// Links are refused with those of all bridges that are not built in.
    pub fn check(_: &impl ExternalPorts, configuration: &Configuration) -> Result<(), Report> {
        let Some(table) = configuration.value("dds") else { return Ok(()) };
        let help =
            "build it with the feature `dds`: cargo build --release --features dds; or take the table away";
        let message =
            slate_runtime::ErrorCode::Feature.of("this program is built without DDS, which [dds] needs");
        Err(configuration.diagnostic(table.span, message, Some(help.into())).into())
    }
}

pub use built_in::{DdsRun, check};
