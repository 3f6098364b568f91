//! Configuration with inferred links, and its checked composition.

use std::sync::Arc;

use slate_configuration::{Configuration, Diagnostic, Report};
use slate_module::aspect::{MainLoop, Service};
use slate_module::{Description, Direction, Trigger};
use slate_sorted::SortedSet;

use crate::catalogue::Catalogue;
use crate::diagnostic_collector::DiagnosticCollector;
use crate::survey::{Inferred, LinkKeeping, Survey, Surveyed, infer, needs, survey};

/// Configuration with the links that types and roles determine uniquely.
pub struct LinkedConfiguration {
    configuration: Arc<Configuration>,
    /// Ambiguous links.
    ambiguous: Vec<Diagnostic>,
    /// Ports of the ambiguous links.
    undecided: SortedSet<String>,
}

impl LinkedConfiguration {
    /// Infers those links; modules for which `keeps_links` is true keep theirs.
    pub fn new(
        configuration: &Configuration,
        catalogue: &Catalogue,
        keeps_links: &dyn Fn(&str) -> bool,
    ) -> Self {
        Self::keeping(configuration, catalogue, &LinkKeeping { keeps_links, before: None })
    }

    /// Infers links for ports that `before` configures and `configuration` does not.
    /// All other links remain unchanged.
    pub fn after(configuration: &Configuration, before: &Configuration, catalogue: &Catalogue) -> Self {
        Self::keeping(configuration, catalogue, &LinkKeeping { keeps_links: &|_| true, before: Some(before) })
    }

    fn keeping(configuration: &Configuration, catalogue: &Catalogue, keeping: &LinkKeeping<'_>) -> Self {
        let mut collector = DiagnosticCollector::new(configuration);
        let Inferred { configuration, undecided } = infer(configuration, catalogue, keeping, &mut collector);
        Self { configuration: Arc::new(configuration), ambiguous: collector.diagnostics, undecided }
    }

    /// Returns the diagnostics of links with several possible sources or inboxes.
    pub fn ambiguous(&self) -> &[Diagnostic] {
        &self.ambiguous
    }

    /// Returns the configuration with the inferred links.
    pub fn configuration(&self) -> &Arc<Configuration> {
        &self.configuration
    }

    /// Returns a collector for the configuration, without ambiguous links.
    pub fn collector(&self) -> DiagnosticCollector<'_> {
        let mut collector = DiagnosticCollector::new(&self.configuration);
        collector.undecided.clone_from(&self.undecided);
        collector
    }

    /// Checks the configuration; returns the composition.
    ///
    /// # Errors
    /// Everything that does not fit or is ambiguous.
    pub fn check(&self, catalogue: &Catalogue) -> Result<Survey<'_>, Report> {
        let mut collector = self.collector();
        let survey = survey(&self.configuration, catalogue, &mut collector);
        collector.diagnostics.extend(self.ambiguous.iter().cloned());
        if collector.diagnostics.is_empty() { Ok(survey) } else { Err(Report::from(collector.diagnostics)) }
    }
}

impl Survey<'_> {
    /// Returns the stages of the main loop, each with its modules in execution order.
    /// The agent runs all modules on the loop, except isolated modules with their own time.
    pub fn stages(&self, configuration: &Configuration) -> Vec<(String, Vec<String>)> {
        let lockstep = configuration.time_source().is_some();
        let is_on_loop = |surveyed: &&Surveyed<'_>| {
            lockstep
                || !surveyed.is_isolated
                || surveyed.trigger == Trigger::Stage
                || needs(&surveyed.description, MainLoop::DESCRIPTOR.hash)
        };
        let stages = configuration.schedule().stages().iter().map(|stage| {
            let levels = stage.members.iter().filter_map(|member| self.order.get(*member as usize));
            let modules = levels.flatten().flatten().map(|index| &self.modules[*index]);
            let names = modules.filter(is_on_loop).map(|surveyed| surveyed.module.name.value.clone());
            (stage.name.clone(), names.collect())
        });
        stages.collect()
    }

    /// Returns whether the link from `from` to `to` carries messages.
    /// It then leads from an outbox to an inbox.
    pub fn sends(&self, to: &str, from: &str) -> bool {
        let modules = || self.modules.iter().map(|own| (own.module.name.value.as_str(), &own.description));
        sends(modules, to, from)
    }
}

/// Returns whether the link between these paths of given modules carries messages.
/// It then leads from an outbox to an inbox.
pub fn sends<'d, M>(modules: impl Fn() -> M, to: &str, from: &str) -> bool
where
    M: Iterator<Item = (&'d str, &'d Description)>,
{
    let direction = |path: &str| {
        let port = modules().find_map(|(name, description)| {
            let rest = path.strip_prefix(name)?.strip_prefix('/')?;
            description.ports.iter().find(|port| port.name == rest)
        });
        port.map(|port| port.direction)
    };
    let direction_to = direction(to);
    to.starts_with("slate://")
        || direction_to == Some(Direction::Inbox)
        || direction_to.is_none() && direction(from) == Some(Direction::Outbox)
}
