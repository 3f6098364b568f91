//! Modules that can't be set up, as diagnostics.

use slate_configuration::{Configuration, ErrorCode, Module};
use slate_module::Refusal;

use crate::diagnostic_collector::DiagnosticCollector;
use crate::survey::Surveyed;

/// Memory that a process allocates beside its module, bytes.
/// It includes room for its stack and its log.
const LEAST_MEMORY: usize = 1 << 20;

/// Adds the refusal of a module to be made, at the setting that it names.
pub fn add_refusal(
    configuration: &Configuration,
    module: &Module,
    refusal: &Refusal,
    collector: &mut DiagnosticCollector<'_>,
) {
    let message = format!("`{}` can't be set up: {refusal}", module.name.value);
    match (module.place_of(&refusal.0), message.rsplit_once("; ")) {
        // What to do about a parameter stands at the end.
        (Some(place), Some((message, help))) => {
            collector.add(place, ErrorCode::Value.of(message.to_owned()), help);
        }
        (Some(place), None) => collector.add_without_help(place, ErrorCode::Value.of(message)),
        (None, _) => match configuration.place_of(&refusal.0) {
            Some(place) => collector.add_without_help(place, message),
            None => collector.add(module.name.span, message, "fix its parameters or its setup"),
        },
    }
}

/// Returns true if a module's memory limit suffices for copies of its values.
/// Only isolated modules have a limit. One that is too low is added to `collector`.
pub fn has_enough_memory(surveyed: &Surveyed<'_>, collector: &mut DiagnosticCollector<'_>) -> bool {
    let (description, wanted) = (&surveyed.description, surveyed.module.isolation);
    let values = description.ports.iter().map(|port| {
        let shape = port.descriptor.shape(port.capacity);
        shape.bytes(shape.capacity).saturating_mul(port.window.max(1))
    });
    let needed = values.fold(LEAST_MEMORY + description.params.size, usize::saturating_add) as u64;
    let limit = wanted.memory_at.filter(|_| surveyed.is_isolated && wanted.memory < needed);
    let Some(span) = limit else { return true };
    let message = format!(
        "`{}` may allocate {} bytes, and its ports and what every module needs have {needed}",
        surveyed.module.name.value, wanted.memory
    );
    collector.add(span, message, "give it more memory, such as \"100MB\"");
    false
}
