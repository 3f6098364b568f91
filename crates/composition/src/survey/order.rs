//! The order of the modules in each stage, from their links.

use slate_module::{Direction, Stage};

use super::levels::{CycleFound, levels};
use super::writers::writers;
use super::{LinkEnd, LinkSource, ResolvedLink, Surveyed};
use crate::diagnostic_collector::DiagnosticCollector;
use slate_configuration::Configuration;
use slate_configuration::ErrorCode;

/// Returns the levels of modules in each stage; reports cycles.
pub(super) fn survey_order(
    configuration: &Configuration,
    modules: &[Surveyed<'_>],
    links: &[ResolvedLink<'_>],
    collector: &mut DiagnosticCollector<'_>,
) -> Vec<Vec<Vec<usize>>> {
    let mut order = Vec::new();
    for stage in Stage::ALL {
        let members: Vec<usize> =
            (0..modules.len()).filter(|module| modules[*module].stage == stage).collect();
        let position = |module: usize| members.iter().position(|member| *member == module);
        let mut edges = Vec::new();
        for resolved in links {
            let Some(own) = position(resolved.port.0) else { continue };
            let sends = matches!(resolved.port.1, LinkEnd::Port(port)
                if modules[resolved.port.0].description.ports[port].direction == Direction::Outbox);
            // A writer comes before its reader and a sender before the receiver, unless last cycle's value is meant.
            let own_first = resolved.previous != sends;
            let sources = writers(configuration, modules, links, resolved.target);
            for target in sources.into_iter().filter_map(position) {
                // A value from the module itself, or from the gate that it commands, is always from before its tick.
                let unordered = sends
                    || resolved.previous
                    || matches!(resolved.target, LinkSource::Command(_) | LinkSource::Gate(_));
                if own != target || !unordered {
                    edges.push(if own_first { (own, target) } else { (target, own) });
                }
            }
        }
        match levels(members.len(), &edges) {
            Ok(sorted) => order.push(
                sorted.into_iter().map(|level| level.into_iter().map(|i| members[i]).collect()).collect(),
            ),
            Err(CycleFound(cycle)) => {
                let names: Vec<_> =
                    cycle.iter().map(|i| modules[members[*i]].module.name.value.as_str()).collect();
                let first = links.iter().find(|resolved| {
                    position(resolved.port.0).is_some_and(|own| cycle.contains(&own))
                        && writers(configuration, modules, links, resolved.target)
                            .into_iter()
                            .any(|target| position(target).is_some_and(|at| cycle.contains(&at)))
                });
                let message = ErrorCode::Circle.of(format!(
                    "cyclic dependency in stage {}: {} -> {}",
                    stage.name(),
                    names.join(" -> "),
                    names.first().copied().unwrap_or_default()
                ));
                let help = "mark one of the links `previous = true`, or move a module to another stage";
                match first {
                    Some(resolved) => collector.add(resolved.link.from.span, message, help),
                    None => collector.add(modules[members[cycle[0]]].module.name.span, message, help),
                }
                order.push(Vec::new());
            }
        }
    }
    order
}
