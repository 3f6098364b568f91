//! Consent of modules to new settings.
//! Present modules may refuse; absent ones are checked by their last known description.

use std::sync::Arc;

use slate_module::{Description, ModuleKind};
use slate_sorted::SortedMap;

use crate::agent::assembly::Assembly;
use slate_composition::parameters;
use slate_composition::{Catalogue, DiagnosticCollector, Surveyed};
use slate_configuration::{Configuration, Diagnostic, Report, Span};
use slate_engine::runner::{CallTimeout, OwnSetup, Retired};

/// Question to a module: new parameters that it must accept.
pub(super) struct ConsentQuestion {
    kind: ModuleKind,
    setup: OwnSetup,
    params: Vec<u8>,
    timeout: CallTimeout,
    /// Place of the module in the configuration.
    place: Span,
}

impl ConsentQuestion {
    /// Prepares the question for a module with new parameters.
    /// The module must be able to begin with them, as it does at the next start.
    pub fn of(surveyed: Surveyed<'_>, assembly: &Assembly) -> Self {
        let Surveyed { module, kind, is_isolated, setup, params, .. } = surveyed;
        let loaded = assembly.modules.get(&module.name.value);
        Self {
            kind: loaded.map_or_else(|| kind.clone(), |loaded| loaded.placed(&kind)),
            setup,
            params,
            timeout: assembly.resources.timeout(&Arc::from(module.name.value.as_str()), is_isolated),
            place: module.name.span,
        }
    }
}

/// Checks the parameters of absent modules by their last known description.
pub(super) fn check_dormant(
    configuration: &Configuration,
    catalogue: &Catalogue,
    last_known: &SortedMap<String, Description>,
    diagnostics: &mut DiagnosticCollector<'_>,
) {
    for module in configuration.modules() {
        if catalogue.is_dormant(&module.kind.value)
            && let Some(description) = last_known.get(&module.name.value)
        {
            let followed = parameters::followed(configuration, module, description);
            parameters::bytes(description, &module.params, &followed, diagnostics);
        }
    }
}

/// Makes an instance for each question, and discards it.
pub(super) fn check_consent(
    questions: Vec<ConsentQuestion>,
    configuration: &Configuration,
) -> Result<(), Report> {
    let mut diagnostics = Vec::new();
    for ConsentQuestion { kind, setup, params, timeout, place } in questions {
        match timeout.create(&kind, &setup, &params) {
            Ok(instance) => drop(Retired::new(kind, instance, timeout)),
            Err(refusal) => {
                let message = format!("`{}` refuses these parameters: {refusal}", setup.name);
                diagnostics.push(objection(configuration, (&setup.name, &refusal.0), place, message));
            }
        }
    }
    if diagnostics.is_empty() { Ok(()) } else { Err(Report::from(diagnostics)) }
}

fn objection(
    configuration: &Configuration,
    (name, complaint): (&str, &str),
    place: Span,
    message: String,
) -> Diagnostic {
    let module = configuration.modules().iter().find(|module| module.name.value == name);
    let said = module.and_then(|module| module.place_of(complaint));
    let place = said.or_else(|| configuration.place_of(complaint)).unwrap_or(place);
    configuration.diagnostic(place, message, Some("with them it could not start the next time".into()))
}
