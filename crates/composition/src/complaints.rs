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
}

impl<'a> Complaints<'a> {
    /// Without diagnostics.
    pub fn new(configuration: &'a Configuration) -> Self {
        Self { configuration, undecided: BTreeSet::new(), diagnostics: Vec::new() }
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
