//! Manual values of inputs, and inputs that reject them.
//! A person, the configuration or a bridge sets them.

use slate_configuration::{Configuration, Message};

use super::names::port_at;
use super::{Survey, actuation, knowledge_inputs};
use crate::diagnostic_collector::DiagnosticCollector;

/// Reports configured values of inputs that reject manual values.
pub(super) fn check_values<'a>(
    configuration: &'a Configuration,
    survey: &Survey<'a>,
    collector: &mut DiagnosticCollector<'a>,
) {
    for (module, surveyed) in survey.modules.iter().enumerate() {
        for port in surveyed.inputs.keys() {
            let Some((message, help)) = refusal(configuration, survey, (module, *port)) else { continue };
            let name = surveyed.description.ports[*port].name.as_str();
            let place = surveyed.module.inputs.iter().find(|(own, _)| *own == name);
            collector.add(place.map_or(surveyed.module.name.span, |(_, entry)| entry.key), message, help);
        }
    }
}

/// Returns the error and the help for a manual value that an input rejects.
fn refusal(
    configuration: &Configuration,
    survey: &Survey<'_>,
    port: (usize, usize),
) -> Option<(Message, String)> {
    actuation::value_refusal(configuration, survey, port)
        .or_else(|| knowledge_inputs::value_refusal(configuration, survey, port))
}

/// Returns the error and the help if the input at a path rejects manual values.
pub fn manual_value_refusal(
    configuration: &Configuration,
    survey: &Survey<'_>,
    path: &str,
) -> Option<(Message, String)> {
    refusal(configuration, survey, port_at(survey, path)?)
}
