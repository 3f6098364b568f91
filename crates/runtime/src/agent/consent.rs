//! Whether modules take other settings: those that are there are asked, those that are away are known by what they were.

use std::collections::BTreeSet;
use std::sync::Arc;

use slate_module::ModuleKind;

use super::composition::Composition;
use crate::configuration::{Configuration, Diagnostic, Report, Span};
use crate::runner::{OwnSetup, Patience, Retired};
use slate_composition::parameters;
use slate_composition::{Complaints, Survey};

/// A module that could begin with other parameters, or could not.
pub(super) struct Question {
    kind: ModuleKind,
    setup: OwnSetup,
    params: Vec<u8>,
    patience: Patience,
    /// Where the module stands.
    place: Span,
}

impl Composition {
    /// What to ask the modules that get other parameters. They must be able to begin with them, as they do at the next
    /// start.
    pub fn questions(&self, survey: Survey<'_>, modules: &BTreeSet<&str>) -> Vec<Question> {
        let changed = survey
            .modules
            .into_iter()
            .filter(|surveyed| modules.contains(surveyed.module.name.value.as_str()));
        let question = changed.map(|surveyed| {
            let module = surveyed.module;
            let present = self.present.get(&module.name.value);
            Question {
                kind: present.map_or_else(|| surveyed.kind.clone(), |present| present.placed(&surveyed.kind)),
                setup: surveyed.setup,
                params: surveyed.params,
                patience: self.ground.patience(&Arc::from(module.name.value.as_str()), module.isolated.value),
                place: module.name.span,
            }
        });
        question.collect()
    }

    /// Checks the parameters of modules whose code is away by what they were when it was there.
    pub fn check_dormant(&self, configuration: &Configuration, complaints: &mut Complaints<'_>) {
        for module in configuration.modules() {
            if self.catalogue.is_dormant(&module.kind.value)
                && let Some(description) = self.last_known.get(&module.name.value)
            {
                parameters::bytes(description, &module.params, complaints);
            }
        }
    }
}

/// Makes an instance for each, which is thrown away.
pub(super) fn ask(questions: Vec<Question>, configuration: &Configuration) -> Result<(), Report> {
    let mut diagnostics = Vec::new();
    for Question { kind, setup, params, patience, place } in questions {
        match patience.create(&kind, &setup, &params) {
            Ok(instance) => drop(Retired::new(kind, instance, patience)),
            Err(refusal) => {
                let message = format!("`{}` can't begin with these parameters: {refusal}", setup.name);
                diagnostics.push(objection(configuration, &refusal.0, place, message));
            }
        }
    }
    if diagnostics.is_empty() { Ok(()) } else { Err(Report::from(diagnostics)) }
}

fn objection(configuration: &Configuration, complaint: &str, place: Span, message: String) -> Diagnostic {
    let place = configuration.place_of(complaint, place);
    configuration.diagnostic(place, message, Some("it has to begin with them at the next start".into()))
}
