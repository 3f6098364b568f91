use std::fmt;
use std::sync::Arc;

use miette::{GraphicalReportHandler, GraphicalTheme, LabeledSpan, SourceCode};

use super::context_lines::ContextLines;
use super::set::first_equals;
use super::source::{SourceKind, Sources, Span};
use crate::error_code::{ErrorCode, Message};

/// Error in a configuration: message, place and help.
#[derive(Clone, Debug)]
pub struct Diagnostic {
    message: String,
    error_code: Option<ErrorCode>,
    help: Option<String>,
    place: Option<DiagnosticPlace>,
}

#[derive(Clone, Debug)]
struct DiagnosticPlace {
    context: ContextLines,
    label: LabeledSpan,
    line: usize,
    column: usize,
    /// True if the text was written by hand.
    /// The text of a change at run time is made from a tool's request.
    is_written: bool,
}

impl Diagnostic {
    /// Diagnostic without a place in a text, such as for an unreadable file.
    pub fn without_place(message: impl Into<Message>, help: impl Into<Option<String>>) -> Self {
        let Message { text, error_code } = message.into();
        Self { message: text, error_code, help: help.into(), place: None }
    }

    pub(super) fn at(sources: &Sources, span: Span, message: Message, help: Option<String>) -> Self {
        let source = sources.of(span);
        if source.kind == SourceKind::Plugin {
            let text = format!("{}: {message}", source.name);
            return Self::without_place(Message { text, ..message }, help);
        }
        let range = source.range(span);
        let (line, column) = source.line_and_column(range.start);
        let context = ContextLines::around(&source.name, &source.text, &range);
        let label = LabeledSpan::new_with_span(Some("here".into()), range);
        let is_written = source.kind != SourceKind::Change;
        let Message { text, error_code } = message;
        Self {
            message: text,
            error_code,
            help,
            place: Some(DiagnosticPlace { context, label, line, column, is_written }),
        }
    }

    /// Returns place, message and help in one line.
    pub(super) fn in_a_line(&self) -> String {
        DiagnosticLine(self).to_string()
    }

    /// Returns true if it is at a place in a text written by hand.
    pub fn is_written(&self) -> bool {
        self.place.as_ref().is_some_and(|place| place.is_written)
    }

    /// Message after its place in a text written by hand.
    pub fn placed(&self) -> String {
        match self.place.as_ref().filter(|place| place.is_written) {
            Some(DiagnosticPlace { context, line, column, .. }) => {
                format!("{}:{line}:{column}: {}", context.name(), self.message)
            }
            None => match self.setting() {
                Some(path) if !self.message.contains(path) => format!("{path}: {}", self.message),
                _ => self.message.clone(),
            },
        }
    }

    /// Returns the setting of a change at run time.
    /// A link's message contains it already.
    fn setting(&self) -> Option<&str> {
        let text = self.place.as_ref().filter(|place| !place.is_written)?.context.text();
        let path = text[..first_equals(text)?].trim();
        (!path.starts_with("links")).then_some(path)
    }

    /// Returns true if it is at the same place as another diagnostic.
    pub fn is_at_place_of(&self, other: &Self) -> bool {
        let place = |one: &Self| {
            let place = one.place.as_ref()?;
            Some((
                place.context.name().to_owned(),
                Arc::clone(place.context.text()),
                place.line,
                place.column,
            ))
        };
        place(self).is_some_and(|own| place(other) == Some(own))
    }

    /// Returns the diagnostic with words before its message.
    pub fn prefixed(mut self, words: &str) -> Self {
        self.message.insert_str(0, words);
        self
    }

    /// The message.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// Error code, if any.
    pub fn error_code(&self) -> Option<ErrorCode> {
        self.error_code
    }

    /// The diagnostic with a kind, unless it has one.
    pub fn or(mut self, error_code: ErrorCode) -> Self {
        self.error_code.get_or_insert(error_code);
        self
    }

    /// The beginning of its line: the severity and the code, such as `warning[S201]`.
    pub fn heading(&self, severity: &str) -> String {
        self.error_code
            .map_or_else(|| severity.into(), |error_code| format!("{severity}[{}]", error_code.code()))
    }

    /// The help.
    pub fn help_text(&self) -> Option<&str> {
        self.help.as_deref()
    }

    /// The name of the file, or `--set`.
    pub fn source_name(&self) -> Option<&str> {
        self.place.as_ref().map(|place| place.context.name())
    }

    /// The line, counted from one.
    pub fn line(&self) -> Option<usize> {
        self.place.as_ref().map(|place| place.line)
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Diagnostic {}

impl miette::Diagnostic for Diagnostic {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.place.as_ref().map(|place| &place.context as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.place.as_ref().map(|place| Box::new(std::iter::once(place.label.clone())) as Box<_>)
    }
}

/// Errors of a configuration, at most 200.
///
/// `Display` writes a line for each, [`Report::render`] and `Debug` show file, line and caret.
#[derive(Clone)]
pub struct Report {
    diagnostics: Vec<Diagnostic>,
}

/// Most errors that a report shows.
pub(super) const MAX_SHOWN_ERRORS: usize = 200;

impl Report {
    /// Makes a report of the first errors, and the number of omitted ones.
    pub(super) fn of(mut diagnostics: Vec<Diagnostic>, unsaid: usize) -> Self {
        let unsaid = unsaid + diagnostics.len().saturating_sub(MAX_SHOWN_ERRORS);
        diagnostics.truncate(MAX_SHOWN_ERRORS);
        if unsaid > 0 {
            let help = "fix these first";
            diagnostics
                .push(Diagnostic::without_place(format!("and {unsaid} more errors"), Some(help.into())));
        }
        Self { diagnostics }
    }

    /// The diagnostics, in the order of the texts.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }

    /// Returns the code of the first error that has one.
    pub fn error_code(&self) -> Option<ErrorCode> {
        self.diagnostics.iter().find_map(Diagnostic::error_code)
    }

    /// Renders the report for a terminal.
    /// Each error has a code, message, excerpt with a caret, and help.
    pub fn render(&self, color: bool) -> String {
        let theme = if color { GraphicalTheme::unicode() } else { GraphicalTheme::unicode_nocolor() };
        let handler = GraphicalReportHandler::new_themed(theme).with_links(false).with_width(110);
        let mut text = String::new();
        for diagnostic in &self.diagnostics {
            if handler.render_report(&mut text, &Coded(diagnostic)).is_err() {
                text.push_str(&format!("{}\n", DiagnosticLine(diagnostic)));
            }
        }
        text
    }
}

/// Diagnostic with its code before the message: `error[S016]: a Plan reads ...`.
#[derive(Debug)]
struct Coded<'a>(&'a Diagnostic);

impl fmt::Display for Coded<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.0.heading("error"), self.0.message)
    }
}

impl std::error::Error for Coded<'_> {}

impl miette::Diagnostic for Coded<'_> {
    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.0.help()
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        self.0.source_code()
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        self.0.labels()
    }
}

impl From<Diagnostic> for Report {
    fn from(diagnostic: Diagnostic) -> Self {
        Self { diagnostics: vec![diagnostic] }
    }
}

impl From<Vec<Diagnostic>> for Report {
    fn from(diagnostics: Vec<Diagnostic>) -> Self {
        Self::of(diagnostics, 0)
    }
}

/// Diagnostic in one line: `exp1.toml:3:1: message (help)`.
struct DiagnosticLine<'a>(&'a Diagnostic);

impl fmt::Display for DiagnosticLine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Diagnostic { message, help, place, .. } = self.0;
        if let Some(place) = place {
            write!(f, "{}:{}:{}: ", place.context.name(), place.line, place.column)?;
        }
        f.write_str(message)?;
        help.as_ref().map_or(Ok(()), |help| write!(f, " ({help})"))
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, diagnostic) in self.diagnostics.iter().enumerate() {
            write!(f, "{}{}", if i == 0 { "" } else { "\n" }, DiagnosticLine(diagnostic))?;
        }
        Ok(())
    }
}

impl fmt::Debug for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl std::error::Error for Report {}

impl miette::Diagnostic for Report {
    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn miette::Diagnostic> + 'a>> {
        Some(Box::new(self.diagnostics.iter().map(|diagnostic| diagnostic as &dyn miette::Diagnostic)))
    }
}
