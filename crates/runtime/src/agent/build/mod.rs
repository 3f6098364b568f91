//! Builder of a checked survey: properties, links, gates, instances.

mod actuators;
mod deepening;
mod isolation;
mod properties;
mod resources;
mod rewiring;
mod runners;
mod wiring;

use std::fmt::Display;
use std::sync::Arc;

use slate_blackboard::channel::{Budget, Latest, Writer};
use slate_blackboard::interface::Descriptor;
use slate_blackboard::wake::Wake;
use slate_blackboard::{Access, BoardError, Placement, Property, Store};
use slate_sorted::SortedSet;

use super::Mode;
use actuators::GateBuilder;
pub(super) use deepening::deepening;
use isolation::IsolationBuilder;
use properties::PropertyBuilder;
pub(super) use resources::{HostResources, ResourceMark};
pub(super) use rewiring::{Rewiring, rewire};
use runners::RunnerBuilder;
use slate_composition::{
    BuildPlan, DiagnosticCollector, LinkEnd, SAME_PATH, SPARE_READERS, Survey, interface_conflict,
    reader_refusal,
};
use slate_configuration::{Configuration, Diagnostic};
use slate_engine::runner::Runner;
use wiring::WiringBuilder;

/// Makes the listed modules of a survey, by index.
pub(super) fn build(
    configuration: &Configuration,
    survey: &Survey<'_>,
    resources: &mut HostResources,
    arriving: &[usize],
) -> Result<Vec<Runner>, Vec<Diagnostic>> {
    let mut builder =
        ModuleBuilder::new(BuildPlan { configuration, survey }, resources, BuildMoment::AtStart);
    let runners = builder.all(arriving);
    if builder.diagnostics.diagnostics.is_empty() {
        Ok(runners)
    } else {
        Err(builder.diagnostics.diagnostics)
    }
}

/// Moment at which properties are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BuildMoment {
    /// With their module; configured values have the time 0.
    AtStart,
    /// For new links of a running module, at that time of the agent.
    Later(u64),
    /// To check that links fit; recorders do not see the properties.
    OnTrial,
}

impl BuildMoment {
    /// Returns the time of a configured value.
    fn time(self) -> u64 {
        match self {
            Self::Later(now) => now,
            Self::AtStart | Self::OnTrial => 0,
        }
    }
}

struct Failed;

/// Common state of the builders of properties, gates, links and runners.
/// It holds the plan, the resources and the diagnostics.
struct ModuleBuilder<'a, 's> {
    plan: BuildPlan<'a, 's>,
    resources: &'s mut HostResources,
    diagnostics: DiagnosticCollector<'a>,
    /// Placements on the board at the exchange of links.
    placements: Vec<Placement>,
    /// Ports that links filled before, and fill again.
    kept: SortedSet<(usize, LinkEnd)>,
    made: BuildMoment,
}

impl<'a, 's> ModuleBuilder<'a, 's> {
    fn new(plan: BuildPlan<'a, 's>, resources: &'s mut HostResources, made: BuildMoment) -> Self {
        let diagnostics = DiagnosticCollector::new(plan.configuration);
        Self { plan, resources, diagnostics, placements: Vec::new(), kept: SortedSet::new(), made }
    }

    fn all(&mut self, arriving: &[usize]) -> Vec<Runner> {
        for module in arriving {
            // The error was reported.
            let _ = self.properties().of_module(*module);
        }
        GateBuilder::new(self).all();
        if !self.diagnostics.diagnostics.is_empty() {
            return Vec::new();
        }
        RunnerBuilder::new(self).all(arriving)
    }

    fn properties(&mut self) -> PropertyBuilder<'_, 'a, 's> {
        PropertyBuilder::new(self)
    }

    fn isolation(&mut self) -> IsolationBuilder<'_, 'a, 's> {
        IsolationBuilder::new(self)
    }

    /// Complains about a module whose property could not be added to the board.
    fn added<T>(&mut self, module: usize, result: Result<T, BoardError>) -> Result<T, Failed> {
        result.map_err(|error| {
            let span = self.plan.surveyed(module).module.name.span;
            self.diagnostics.add(span, error.to_string(), SAME_PATH);
            Failed
        })
    }

    /// Returns the property at exactly that path.
    fn property(&self, path: &str) -> Option<Arc<Property>> {
        let placed = self.placements.iter().find_map(|placement| match placement {
            Placement::Property(property) if property.path() == path => Some(Arc::clone(property)),
            _ => None,
        });
        if placed.is_some() {
            return placed;
        }
        let (property, field) = self.resources.board.get(path)?;
        (field.is_empty() && property.path() == path).then_some(property)
    }

    /// Returns the port's own property.
    fn own_property(&self, module: usize, port: usize) -> Option<Arc<Property>> {
        self.property(&self.plan.port_path(module, port))
    }

    /// Returns the property at a path, if it has that interface.
    /// A property of another interface without readers is removed.
    fn existing(
        &mut self,
        module: usize,
        path: &str,
        descriptor: &Descriptor,
    ) -> Result<Option<Arc<Property>>, Failed> {
        let Some(property) = self.property(path) else { return Ok(None) };
        if property.descriptor().hash == descriptor.hash {
            return Ok(Some(property));
        }
        let plan = self.plan;
        if property.has_writer()
            || plan.survey.links.iter().any(|resolved| plan.target_path(resolved.target) == path)
        {
            let (message, help) = interface_conflict(path, descriptor, property.descriptor());
            self.diagnostics.add(plan.surveyed(module).module.name.span, message, help);
            return Err(Failed);
        }
        // It was there a moment ago.
        let _ = self.resources.board.remove(path);
        Ok(None)
    }

    /// Returns the wakes of the modules that are linked to a path.
    fn wakes(&mut self, path: &str) -> Vec<Arc<Wake>> {
        let names: SortedSet<_> = self.plan.links_to(path).collect();
        names.into_iter().filter_map(|name| self.wake_of(name)).collect()
    }

    /// Returns the wake of a module's thread, if it has or may get one.
    fn wake_of(&mut self, name: &str) -> Option<Arc<Wake>> {
        let mut modules = self.plan.survey.modules.iter();
        let threaded = match modules.find(|surveyed| surveyed.module.name.value == name) {
            Some(surveyed) => self.resources.has_own_thread(surveyed),
            None => self.resources.mode == Mode::Threaded || !self.resources.lockstep,
        };
        threaded.then(|| self.resources.signals(name).wake)
    }

    /// Returns a reader of the property that switches a module.
    fn switch(&mut self, m: usize) -> Option<Latest> {
        let path = match self.plan.link(m, LinkEnd::Enabled).map(|resolved| resolved.target) {
            Some(target) => self.plan.target_path(target),
            None => format!("{}/enabled", self.plan.name(m)),
        };
        let property = self.property(&path)?;
        let reader = property.channel()?.latest();
        self.granted(m, LinkEnd::Enabled, &property, reader)
    }

    /// Returns the writer of a property that every module has.
    fn implied_writer(
        &mut self,
        m: usize,
        name: &str,
        doc: &str,
        descriptor: &'static Descriptor,
    ) -> Option<Writer> {
        let path = format!("{}/{name}", self.plan.name(m));
        if let Some(existing) = self.existing(m, &path, descriptor).ok()? {
            return new_writer(&existing);
        }
        let budget = Budget { latest: SPARE_READERS, queues: 1, window: 1 };
        let store = Store { capacity: 0, depth: 1, budget };
        let added = self.resources.board.add_channel(&path, doc, descriptor, store, Access::Output);
        new_writer(&*self.added(m, added).ok()?)
    }

    /// Returns a handle; a failure is reported at the link that needs it.
    fn granted<T>(
        &mut self,
        m: usize,
        link_end: LinkEnd,
        property: &Property,
        result: Result<T, impl Display>,
    ) -> Option<T> {
        let error = match result {
            Ok(handle) => return Some(handle),
            Err(error) => error,
        };
        let link = self.plan.links(m, link_end).next().map(|resolved| resolved.link.from.span);
        let span = link.unwrap_or(self.plan.surveyed(m).module.name.span);
        let (message, help) = reader_refusal(property.path(), &error);
        self.diagnostics.add(span, message, help);
        None
    }
}

fn new_writer(property: &Property) -> Option<Writer> {
    property.channel()?.writer().ok()
}
