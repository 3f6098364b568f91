//! Check of a start, without an agent.

use slate_composition::{Catalogue, CheckedComposition, check_facts};
use slate_configuration::Report;

use super::memories::Memories;
use super::snapshot::check_trigger;

/// Checks what a start needs besides a composition that fits.
/// Modules must be set up and take their memories, and the properties of automatic snapshots and of facts must exist.
/// It makes no agent: each module is made once on trial, as only its code knows whether it can be set up.
///
/// # Errors
/// As [`Agent::load`](crate::Agent::load).
pub fn check_start(composition: &CheckedComposition<'_>, catalogue: &Catalogue) -> Result<(), Report> {
    let configuration = composition.configuration();
    let (memories, states) = Memories::read(configuration, false)?;
    let states = states.into_iter().filter_map(|(module, state)| Some((module, state.ok()?)));
    let restored = composition.try_modules(catalogue, &states.collect())?;
    let is_loaded = |module: &str| {
        composition.survey().modules.iter().any(|surveyed| surveyed.module.name.value == module)
    };
    memories.check(configuration, &restored, is_loaded)?;
    check_trigger(configuration, composition)?;
    check_facts(configuration, composition, is_loaded)
}
