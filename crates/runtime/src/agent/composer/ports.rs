//! Properties and ports of a running agent, as programs outside of it see them.

use std::sync::Arc;

use slate_blackboard::{BoardError, Property};
use slate_composition::{DiagnosticCollector, ExternalPorts, PropertyIndex, Survey, survey};
use slate_configuration::Configuration;
use slate_module::PortDescription;

use super::Composer;

impl PropertyIndex for Composer {
    type Property = Arc<Property>;

    fn agent(&self) -> &str {
        self.board().agent()
    }

    fn find(&self, path: &str) -> Result<(Arc<Property>, String), BoardError> {
        self.board().find(path)
    }

    fn properties(&self) -> Vec<Arc<Property>> {
        self.board().properties()
    }
}

/// Ports of the running agent.
/// A bridge marks an input that it fills by [`set_external`](Property::set_external), for tools and recordings: a rerun
/// takes its values from the recording.
impl ExternalPorts for Composer {
    fn port(&self, path: &str) -> Option<PortDescription> {
        Self::port(self, path)
    }

    fn is_lockstep(&self) -> bool {
        Self::is_lockstep(self)
    }

    fn apply<T>(&self, rule: impl FnOnce(&Configuration, &Survey<'_>) -> T) -> T {
        let composition = self.agent.composition();
        let configuration = &composition.configuration;
        let mut collector = DiagnosticCollector::new(configuration);
        rule(configuration, &survey(configuration, &composition.catalogue, &mut collector))
    }
}
