//! Validation of a configuration against a catalogue of kinds.
//! The result is a composition, or a report of all mistakes.
//!
//! It creates no thread, no property and no agent: [`check`] works without an agent, which then creates the items of a
//! [`Survey`].

mod catalogue;
mod diagnostic_collector;
pub mod link;
pub mod own;
pub mod parameters;
mod played;
mod remote_path;
mod setup;
mod survey;
mod wired;

pub use catalogue::{Catalogue, RemoteProperty};
pub use diagnostic_collector::DiagnosticCollector;
pub use played::Played;
pub use remote_path::RemotePath;
pub use setup::{Describe, OwnSetup, Wire, describe};
use slate_configuration::{Configuration, Report};
pub use survey::{
    Absent, DescribedLimits, GATE, Host, Implied, Inferred, LinkConversion, LinkSignature, LinkSource,
    Misfit, RESERVED, Remote, ResolvedLink, Survey, Surveyed, TRUTH, bridge_refusal, carrier_misfit,
    described_limits, inbox_part, infer, manual_value_refusal, needs, part, remote_path, scope, survey,
    ungated_command, unlinked_warnings,
};
pub use wired::{Wired, sends};

/// Checks a configuration against the kinds of a catalogue.
/// [`Wired`] adds the inferred links.
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
