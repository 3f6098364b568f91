//! Diagnostics with their places in the configuration.

use slate_blackboard::nearest_paths;
use slate_configuration::{Configuration, Diagnostic, Message, Span};
use slate_sorted::SortedSet;

/// Collector of diagnostics.
pub struct DiagnosticCollector<'a> {
    configuration: &'a Configuration,
    /// Ports with several possible links and no other diagnostic.
    pub undecided: SortedSet<String>,
    /// The diagnostics so far.
    pub diagnostics: Vec<Diagnostic>,
    /// Deferred diagnostics at settings that parameters follow.
    /// The module that owns the setting may report the same error.
    deferred: Vec<Diagnostic>,
}

impl<'a> DiagnosticCollector<'a> {
    /// Creates a collector without diagnostics.
    pub fn new(configuration: &'a Configuration) -> Self {
        Self { configuration, undecided: SortedSet::new(), diagnostics: Vec::new(), deferred: Vec::new() }
    }

    /// Defers the diagnostics from index `from` on that are at the given settings.
    /// Parameters follow these settings.
    pub fn defer_at(&mut self, from: usize, settings: impl Iterator<Item = Span>) {
        let settings: Vec<_> = settings.map(|span| self.configuration.diagnostic(span, "", None)).collect();
        let is_at_setting = |one: &Diagnostic| settings.iter().any(|setting| one.is_at_place_of(setting));
        let (at_settings, own) = self.diagnostics.split_off(from).into_iter().partition(is_at_setting);
        self.diagnostics.extend::<Vec<_>>(own);
        self.deferred.extend::<Vec<_>>(at_settings);
    }

    /// Adds the deferred diagnostics, except at places that already have one.
    /// One error has one diagnostic.
    pub fn add_deferred(&mut self) {
        for one in std::mem::take(&mut self.deferred) {
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

    /// Returns a place in words, such as `line 12` or `robot.toml:12`.
    /// Without a name it is a line of the same file.
    pub fn place(&self, span: Span) -> String {
        let diagnostic = self.configuration.diagnostic(span, "", None);
        match (diagnostic.source_name(), diagnostic.line()) {
            (Some(file), Some(line)) if diagnostic.is_written() && file != "--set" => {
                format!("{file}:{line}")
            }
            _ => "the command line".into(),
        }
    }

    /// Adds a diagnostic whose message contains the help.
    pub fn add_without_help(&mut self, span: Span, message: impl Into<Message>) {
        self.diagnostics.push(self.configuration.diagnostic(span, message, None));
    }
}

/// Returns a "did you mean" hint for a name, or the list of all names.
pub(crate) fn suggest<'n>(name: &str, names: impl Iterator<Item = &'n str> + Clone) -> String {
    // A module's name may be the beginning of what was named.
    let near = nearest_paths(name, '/', names.clone());
    if near.is_empty() {
        format!("available: {}", names.collect::<Vec<_>>().join(", "))
    } else {
        format!("did you mean {}?", near.join(" or "))
    }
}
