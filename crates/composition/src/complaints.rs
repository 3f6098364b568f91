//! Diagnostics with their places in the configuration.

use std::collections::BTreeSet;

use slate_blackboard::nearest_paths;
use slate_configuration::{Configuration, Diagnostic, Message, Span};

/// Collects complaints.
pub struct Complaints<'a> {
    configuration: &'a Configuration,
    /// Ports with several possible links, of which nothing else is said.
    pub undecided: BTreeSet<String>,
    /// The diagnostics so far.
    pub diagnostics: Vec<Diagnostic>,
    /// Those of settings that parameters follow: the module that the setting is of may complain, too.
    of_followers: Vec<Diagnostic>,
}

impl<'a> Complaints<'a> {
    /// Without diagnostics.
    pub fn new(configuration: &'a Configuration) -> Self {
        Self { configuration, undecided: BTreeSet::new(), diagnostics: Vec::new(), of_followers: Vec::new() }
    }

    /// Sets the diagnostics from an index on aside that are at settings which parameters follow.
    pub fn set_followers_aside(&mut self, from: usize, settings: impl Iterator<Item = Span>) {
        let settings: Vec<_> = settings.map(|span| self.configuration.diagnostic(span, "", None)).collect();
        let is_at_setting = |one: &Diagnostic| settings.iter().any(|setting| one.is_at_place_of(setting));
        let (aside, own) = self.diagnostics.split_off(from).into_iter().partition(is_at_setting);
        self.diagnostics.extend::<Vec<_>>(own);
        self.of_followers.extend::<Vec<_>>(aside);
    }

    /// Adds those that were set aside, but for places that have one already: one mistake has one diagnostic.
    pub fn add_followers(&mut self) {
        for one in std::mem::take(&mut self.of_followers) {
            if !self.diagnostics.iter().any(|other| other.is_at_place_of(&one)) {
                self.diagnostics.push(one);
            }
        }
    }

    /// Adds one at a place of the configuration.
    pub fn add(&mut self, span: Span, message: impl Into<Message>, help: impl Into<String>) {
        let help: String = help.into();
        self.diagnostics.push(self.configuration.diagnostic(span, message, Some(help)));
    }

    /// A place in words, such as `line 12` of the same file, or `robot.toml:12`.
    pub fn place(&self, span: Span) -> String {
        let diagnostic = self.configuration.diagnostic(span, "", None);
        match (diagnostic.source_name(), diagnostic.line()) {
            (Some(file), Some(line)) if diagnostic.is_written() && file != "--set" => {
                format!("{file}:{line}")
            }
            _ => "the command line".into(),
        }
    }

    /// Adds one whose message says what to do.
    pub fn add_plain(&mut self, span: Span, message: impl Into<Message>) {
        self.diagnostics.push(self.configuration.diagnostic(span, message, None));
    }
}

/// Words for "did you mean".
pub(crate) fn suggest<'n>(name: &str, names: impl Iterator<Item = &'n str> + Clone) -> String {
    // A module's name may be the beginning of what was named.
    let near = nearest_paths(name, '/', names.clone());
    if near.is_empty() {
        format!("there are: {}", names.collect::<Vec<_>>().join(", "))
    } else {
        format!("did you mean {}?", near.join(" or "))
    }
}
