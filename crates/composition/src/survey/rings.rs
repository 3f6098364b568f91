//! Rings of modules that wait for each other's first value.

use slate_module::Direction;

use super::levels::{CycleFound, levels};
use super::{LinkEnd, LinkSource, ResolvedLink, Surveyed};
use crate::diagnostic_collector::DiagnosticCollector;
use slate_configuration::ErrorCode;

/// Reports rings of required inputs that only modules of the ring fill.
/// None of these modules would ever run.
///
/// A value of the configuration fills an input first, and so does an output's safe value. A link marked `previous` does
/// not: there is no value of a cycle before the first.
pub(super) fn check_rings(
    modules: &[Surveyed<'_>],
    links: &[ResolvedLink<'_>],
    collector: &mut DiagnosticCollector<'_>,
) {
    let edges: Vec<_> = links.iter().filter_map(|resolved| waits_for(modules, resolved)).collect();
    let Err(CycleFound(ring)) = levels(modules.len(), &edges) else { return };
    let name = |module: usize| modules[module].module.name.value.as_str();
    let mut names: Vec<_> = ring.iter().map(|module| name(*module)).collect();
    names.extend(names.first().copied());
    let first = links.iter().find(|resolved| {
        waits_for(modules, resolved)
            .is_some_and(|(writer, reader)| ring.contains(&writer) && ring.contains(&reader))
    });
    let span = first.map_or(modules[ring[0]].module.name.span, |resolved| resolved.link.from.span);
    collector.add(
        span,
        ErrorCode::Circle.of(format!("{} wait for each other's first value", names.join(" -> "))),
        "each of these inputs is required, so that none of the modules ever runs: make one of them an `Input<T>`, which \
         the module reads with `get()`, or give the output that it reads a first value with `#[safe(...)]`",
    );
}

/// Returns writer and reader of a link if the reader must wait for the writer.
fn waits_for(modules: &[Surveyed<'_>], resolved: &ResolvedLink<'_>) -> Option<(usize, usize)> {
    let (reader, LinkEnd::Port(input)) = resolved.port else { return None };
    let LinkSource::Port(writer, output) = resolved.target else { return None };
    let (own, other) = (&modules[reader], &modules[writer].description.ports[output]);
    let is_filled = own.inputs.contains_key(&input)
        || other.safe.is_some()
        || !matches!(other.direction, Direction::Output | Direction::Debug);
    (own.description.ports[input].required && !is_filled).then_some((writer, reader))
}
