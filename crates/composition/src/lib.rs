//! Validation of a configuration against a catalogue of kinds.
//! The result is a composition, or a report of all mistakes.
//!
//! It creates no thread, no property and no agent: [`check`] works without an agent, which then creates the items of a
//! [`Survey`].

mod catalogue;
mod complaints;
pub mod link;
pub mod own;
pub mod parameters;
mod played;
mod remote_path;
mod setup;
mod survey;
mod wired;

pub use catalogue::{Catalogue, RemoteProperty};
pub use complaints::Complaints;
pub use played::Played;
pub use remote_path::RemotePath;
pub use setup::{Describe, OwnSetup, Wire, describe};
use slate_configuration::{Configuration, Report};
pub use survey::{
    Absent, DescribedLimits, GATE, Host, Implied, Inferred, Lead, LinkConversion, LinkSource, Misfit,
    RESERVED, Remote, ResolvedLink, Survey, Surveyed, TRUTH, bridge_refusal, described_limits, elsewhere,
    hand_refusal, inbox_part, infer, loose, needs, part, past_gate, remote_path, scope, survey,
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
    let mut complaints = Complaints::new(configuration);
    let survey = survey(configuration, catalogue, &mut complaints);
    if complaints.diagnostics.is_empty() { Ok(survey) } else { Err(Report::from(complaints.diagnostics)) }
}
