//! Validation of a configuration against a catalogue of kinds.
//! The result is a composition, or a report of all errors.
//!
//! It creates no thread, no property and no agent: [`check`] works without an agent, which then creates the items of a
//! [`Survey`] as a [`BuildPlan`] says. A [`CheckedComposition`] knows the properties of that agent too, so tools check
//! what names them ([`PropertyIndex`], [`ExternalPorts`]) with an agent and without one.

mod catalogue;
mod checked;
mod diagnostic_collector;
mod external_ports;
pub mod link;
mod link_end;
mod linked_configuration;
pub mod own;
pub mod parameters;
mod plan;
mod played;
mod property_index;
mod remote_path;
mod setup;
mod setup_problems;
mod survey;

pub use catalogue::{Catalogue, RemoteProperty};
pub use checked::{CheckedComposition, RestoredStates};
pub use diagnostic_collector::DiagnosticCollector;
pub use external_ports::{ExternalInputError, ExternalPorts};
pub use link_end::LinkEnd;
pub use linked_configuration::{LinkedConfiguration, sends};
pub use plan::{
    BuildPlan, PlannedGate, PlannedPort, PlannedProperty, SAME_ACTUATOR, SAME_PATH, SPARE_READERS,
    gate_stores, interface_conflict, planned_gate, planned_properties, reader_refusal, shallow_source,
};
pub use played::Played;
pub use property_index::{PropertyFacts, PropertyIndex, check_facts};
pub use remote_path::RemotePath;
pub use setup::{Describe, OwnSetup, SetUp, SetupTrial, describe, set_up};
pub use setup_problems::{add_refusal, has_enough_memory};
use slate_configuration::{Configuration, Report};
pub use survey::{
    Absent, DescribedLimits, GATE, Host, Implied, Inferred, LOOP_STORE, LinkConversion, LinkMismatch,
    LinkSignature, LinkSource, RESERVED, Remote, ResolvedLink, Survey, Surveyed, bridge_refusal,
    carrier_mismatch, described_limits, inbox_part, infer, manual_value_refusal, needs, part, remote_path,
    scope, stage_histogram, survey, ungated_command, unlinked_warnings,
};

/// Checks a configuration against the kinds of a catalogue.
/// [`LinkedConfiguration`] adds the inferred links.
///
/// # Errors
/// All that is wrong.
///
/// ```
/// use slate_composition::{Catalogue, check};
/// use slate_configuration::{Configuration, Options};
///
/// let text = "[modules.eye]\nkind = \"camera\"";
/// let configuration = Configuration::from_text("robot.toml", text, &Options::default())?;
/// let report = check(&configuration, &Catalogue::default()).err().map(|report| report.to_string());
/// assert!(report.is_some_and(|report| report.contains("no plugin brings a module `camera`")));
/// # Ok::<(), slate_configuration::Report>(())
/// ```
pub fn check<'a>(configuration: &'a Configuration, catalogue: &Catalogue) -> Result<Survey<'a>, Report> {
    let mut collector = DiagnosticCollector::new(configuration);
    let survey = survey(configuration, catalogue, &mut collector);
    if collector.diagnostics.is_empty() { Ok(survey) } else { Err(Report::from(collector.diagnostics)) }
}
