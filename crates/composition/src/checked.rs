//! Checked composition: all that an agent would have, without the agent.

use std::time::Duration;

use slate_blackboard::{AddressSpace, BoardError};
use slate_configuration::{Configuration, Report};
use slate_module::PortDescription;
use slate_sorted::SortedMap;

use crate::LinkedConfiguration;
use crate::catalogue::Catalogue;
use crate::diagnostic_collector::DiagnosticCollector;
use crate::external_ports::ExternalPorts;
use crate::plan::{BuildPlan, PlannedProperty, planned_properties};
use crate::property_index::PropertyIndex;
use crate::setup::SetupTrial;
use crate::setup_problems::{add_refusal, has_enough_memory};
use crate::survey::{Survey, port_at};

/// Composition whose modules, links, gates and paths fit.
/// An agent would make them; this has no thread, no memory for values and no instance of a module.
pub struct CheckedComposition<'a> {
    configuration: &'a Configuration,
    survey: Survey<'a>,
    properties: AddressSpace<PlannedProperty>,
}

/// Modules that took over a state, or the reason for which they did not.
pub type RestoredStates = SortedMap<String, Result<(), String>>;

impl LinkedConfiguration {
    /// Checks the configuration, and what an agent would have at its start.
    ///
    /// # Errors
    /// Everything that does not fit or is ambiguous.
    pub fn composition(&self, catalogue: &Catalogue) -> Result<CheckedComposition<'_>, Report> {
        let (configuration, survey) = (self.configuration().as_ref(), self.check(catalogue)?);
        let mut collector = DiagnosticCollector::new(configuration);
        let plan = BuildPlan { configuration, survey: &survey };
        let properties = planned_properties(plan, &mut collector);
        match collector.diagnostics {
            none if none.is_empty() => Ok(CheckedComposition { configuration, survey, properties }),
            diagnostics => Err(Report::from(diagnostics)),
        }
    }
}

impl<'a> CheckedComposition<'a> {
    /// Returns the configuration, with the inferred links.
    pub fn configuration(&self) -> &'a Configuration {
        self.configuration
    }

    /// Returns the modules and links.
    pub fn survey(&self) -> &Survey<'a> {
        &self.survey
    }

    /// Makes an instance of each module and ends it.
    /// Only its code knows whether it can be set up. Modules in `states` restore their state.
    ///
    /// # Errors
    /// The modules that can't be set up.
    pub fn try_modules(
        &self,
        catalogue: &Catalogue,
        states: &SortedMap<String, Vec<u8>>,
    ) -> Result<RestoredStates, Report> {
        let mut collector = DiagnosticCollector::new(self.configuration);
        let mut restored = RestoredStates::new();
        for surveyed in &self.survey.modules {
            if !has_enough_memory(surveyed, &mut collector) {
                continue;
            }
            let name = &surveyed.module.name.value;
            let state = states.get(name);
            let trial = SetupTrial {
                kind: surveyed.kind.clone(),
                setup: surveyed.setup.clone(),
                params: surveyed.params.clone(),
                ports: surveyed.description.ports.clone(),
                memory: surveyed.is_isolated.then_some(surveyed.module.isolation.memory),
                state: state.cloned(),
            };
            match (catalogue.set_up)(trial, Duration::from_nanos(self.configuration.hang().value)) {
                Ok(result) if state.is_some() => {
                    restored.insert(name.clone(), result.map_err(|refusal| refusal.0));
                }
                Ok(_) => {}
                Err(refusal) => add_refusal(self.configuration, surveyed.module, &refusal, &mut collector),
            }
        }
        match collector.diagnostics {
            none if none.is_empty() => Ok(restored),
            diagnostics => Err(Report::from(diagnostics)),
        }
    }
}

impl PropertyIndex for CheckedComposition<'_> {
    type Property = PlannedProperty;

    fn agent(&self) -> &str {
        self.configuration.agent_name()
    }

    fn find(&self, path: &str) -> Result<(PlannedProperty, String), BoardError> {
        self.properties.find(path).map(|(property, field)| (property.clone(), field))
    }

    fn properties(&self) -> Vec<PlannedProperty> {
        self.properties.properties().cloned().collect()
    }
}

impl ExternalPorts for CheckedComposition<'_> {
    fn port(&self, path: &str) -> Option<PortDescription> {
        let (module, port) = port_at(&self.survey, path)?;
        let surveyed = &self.survey.modules[module];
        let found = &surveyed.description.ports[port];
        // Not a field of it.
        let name = &surveyed.module.name.value;
        (path.len() == name.len() + 1 + found.name.len()).then(|| found.clone())
    }

    fn is_lockstep(&self) -> bool {
        self.configuration.time_source().is_some()
    }

    fn apply<T>(&self, rule: impl FnOnce(&Configuration, &Survey<'_>) -> T) -> T {
        rule(self.configuration, &self.survey)
    }
}
