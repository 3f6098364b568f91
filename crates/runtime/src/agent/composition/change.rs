//! Change of an agent's modules: new ones come, and superfluous ones are removed.

use std::sync::Arc;

use super::{Composition, CompositionChange, CompositionTarget, Fitting};
use crate::agent::assembly::{ModuleStates, Unlinked, listeners};
use slate_composition::{Catalogue, LinkedConfiguration, Surveyed};
use slate_configuration::Report;
use slate_engine::main_loop::SharedLoop;
use slate_sorted::SortedMap;

impl Composition {
    /// Returns the target with a changed catalogue.
    pub fn target(&self, change: impl FnOnce(&mut Catalogue)) -> CompositionTarget {
        let mut catalogue = self.catalogue.clone();
        change(&mut catalogue);
        CompositionTarget { configuration: Arc::clone(&self.configuration), catalogue, keep: false }
    }

    /// Returns the configuration of a target with its inferred links.
    /// Types and roles decide these. Links of present modules are kept; a change that makes one of them ambiguous is
    /// refused.
    fn linked(&self, target: &CompositionTarget) -> LinkedConfiguration {
        let is_present = |name: &str| self.assembly.modules.contains_key(name);
        LinkedConfiguration::new(&target.configuration, &target.catalogue, &is_present)
    }

    /// Checks a target, and returns the modules that it has.
    pub fn check(&self, target: &CompositionTarget) -> Result<SortedMap<String, Fitting>, Report> {
        let linked = self.linked(target);
        let survey = linked.check(&target.catalogue)?;
        let described = |surveyed: Surveyed<'_>| {
            let Surveyed { module, kind, description, setup, params, .. } = surveyed;
            (module.name.value.clone(), Fitting { kind, description, setup, params })
        };
        Ok(survey.modules.into_iter().map(described).collect())
    }

    /// Changes the agent into the target.
    /// New modules begin with their states, and modules that the target lacks are removed. The others are not touched.
    pub fn change(
        &mut self,
        target: CompositionTarget,
        shared: &Arc<SharedLoop>,
        states: &ModuleStates,
    ) -> Result<CompositionChange, Report> {
        let linked = self.linked(&target);
        let configuration = linked.configuration();
        let survey = linked.check(&target.catalogue)?;
        let assembly = &mut self.assembly;
        assembly.deepen(configuration, &survey, shared).map_err(|module| Unlinked::late(&module).report)?;
        let arrivals = assembly.admit(configuration, &survey, states)?;
        let leaving = assembly.take_leaving(&survey);
        if self.armed {
            assembly.arm(&arrivals);
        }
        assembly.compose(assembly.stages(&survey), shared);
        assembly.start_arrived(&arrivals, shared);
        let left = assembly.dispose(leaving, shared, target.keep);
        assembly.listeners = listeners(&survey);
        assembly.forget(&survey.absent.iter().map(|absent| absent.path.as_str()).collect(), &left);
        self.configuration = Arc::clone(configuration);
        self.catalogue = target.catalogue;
        assembly.resources.service_context.plugins.show(self.catalogue.list());
        if assembly.modules.len() > arrivals.names.len() {
            // Links of modules that stay to parts of what came or left.
            self.settle_links(configuration, shared);
        } else {
            assembly.mismatches = survey.mismatches;
            self.waiting.unlinked = None;
        }
        Ok(CompositionChange { arrived: arrivals.names, left, restored: arrivals.restored })
    }
}
