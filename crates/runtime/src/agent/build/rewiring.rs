//! New links of running modules.

use std::sync::Arc;

use slate_blackboard::Placement;
use slate_blackboard::wake::Wake;
use slate_sorted::{SortedMap, SortedSet};

use super::{BuildMoment, HostResources, ModuleBuilder, WiringBuilder};
use slate_composition::{BuildPlan, LinkEnd, Survey};
use slate_configuration::{Configuration, Diagnostic};
use slate_engine::runner::Wiring;

/// New links of modules, not in effect before the exchange.
pub(in crate::agent) struct Rewiring {
    /// New wirings by module.
    pub wirings: SortedMap<String, Wiring>,
    /// The threads that outputs wake, by their paths.
    pub wakes: SortedMap<String, Vec<Arc<Wake>>>,
    pub placements: Vec<Placement>,
    /// Parameters that tools must not set any more, by module.
    pub reserved: SortedMap<String, Vec<(String, String)>>,
}

/// Makes new readers for the listed ports, by module.
/// Finds also the threads that the outputs at the listed paths wake.
pub(in crate::agent) fn rewire(
    configuration: &Configuration,
    survey: &Survey<'_>,
    resources: &mut HostResources,
    changed: &SortedMap<usize, SortedSet<LinkEnd>>,
    paths: &SortedSet<String>,
    made: BuildMoment,
) -> Result<Rewiring, Vec<Diagnostic>> {
    let plan = BuildPlan { configuration, survey };
    let mut builder = ModuleBuilder::new(plan, resources, made);
    let mut wirings = SortedMap::new();
    for (m, link_ends) in changed {
        // The error was reported.
        let _ = link_ends.iter().try_for_each(|link_end| builder.properties().relinked(*m, *link_end));
    }
    if builder.diagnostics.diagnostics.is_empty() {
        for (m, link_ends) in changed {
            let stays = |link_end| !link_ends.contains(&link_end);
            match WiringBuilder::new(&mut builder, *m, &stays).wiring() {
                Some(wiring) => drop(wirings.insert(plan.name(*m).to_owned(), wiring)),
                None if builder.diagnostics.diagnostics.is_empty() => {
                    let span = plan.surveyed(*m).module.name.span;
                    let message = format!("`{}` can't get its handles", plan.name(*m));
                    builder.diagnostics.add(span, message, "load its plugin anew");
                }
                None => {}
            }
        }
    }
    let parameters =
        changed.iter().filter(|(_, link_ends)| link_ends.contains(&LinkEnd::Params)).map(|(m, _)| *m);
    let reserved = parameters.map(|m| (plan.name(m).to_owned(), plan.reserved(m))).collect();
    let wakes = paths.iter().map(|path| (path.clone(), builder.wakes(path))).collect();
    let ModuleBuilder { diagnostics, placements, .. } = builder;
    if diagnostics.diagnostics.is_empty() {
        Ok(Rewiring { wirings, wakes, placements, reserved })
    } else {
        Err(diagnostics.diagnostics)
    }
}
