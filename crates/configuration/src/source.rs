use std::fmt;
use std::ops::{Deref, Range};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Range of the text of a [`SettingSource`].
/// Spans are ordered by source, then by place.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Span {
    pub(super) source: usize,
    pub(super) start: usize,
    pub(super) end: usize,
}

/// Value and its place in a text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spanned<T> {
    /// The value.
    pub value: T,
    /// Place where it is written; for a derived value that of its origin.
    pub span: Span,
}

impl<T> Spanned<T> {
    pub(super) fn new(value: T, span: Span) -> Self {
        Self { value, span }
    }
}

impl<T> Deref for Spanned<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

/// Layer of a [`SettingSource`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SourceKind {
    /// Built in.
    Default,
    /// A file, or a text given in place of one.
    File,
    /// A setting of the command line.
    Set,
    /// Setting of an edited file that changes at the next start.
    Waiting,
    /// A change made at run time.
    Change,
    /// Plugin loaded by hand, with a module that no text names.
    Plugin,
}

/// Text with settings.
#[derive(Clone, Debug)]
pub struct SettingSource {
    pub(super) name: String,
    pub(super) kind: SourceKind,
    pub(super) path: Option<PathBuf>,
    pub(super) text: Arc<str>,
    /// Rank; a source of higher rank overrides the others.
    pub(super) rank: usize,
    pub(super) place: TextPlace,
    /// Document with its comments and blanks, for saving.
    pub(super) document: Option<toml_edit::Document<Arc<str>>>,
}

/// Place of a text in a file that describes several agents or variants.
#[derive(Clone, Debug, Default)]
pub(super) struct TextPlace {
    /// File that includes this one in the end.
    /// Its table of an agent overrides all of them.
    pub(super) root: usize,
    /// Text of which this is a table: that of the agent, or of a chosen variant.
    pub(super) part_of: Option<usize>,
    /// The path of that table.
    pub(super) table: Vec<String>,
    /// True if the table of that agent includes it.
    pub(super) own: bool,
}

impl SettingSource {
    /// Makes the source of a single setting.
    pub(super) fn setting(kind: SourceKind, text: &str) -> Self {
        let name = match kind {
            SourceKind::Set => "--set",
            SourceKind::Default => "default of the program",
            SourceKind::Waiting => "until the next start",
            SourceKind::File | SourceKind::Change | SourceKind::Plugin => "change",
        };
        let text = text.into();
        let place = TextPlace::default();
        Self { name: name.into(), kind, path: None, text, rank: usize::MAX, place, document: None }
    }

    /// Name: the file's path as given, `--set`, `change`, or `built-in defaults`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Layer of the text.
    pub fn kind(&self) -> SourceKind {
        self.kind
    }

    /// Path, if the text is a file.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// The whole text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Parsed text with its comments, to be changed and saved.
    /// `None` for a single setting.
    pub fn document(&self) -> Option<&toml_edit::Document<Arc<str>>> {
        self.document.as_ref()
    }

    /// Returns the bytes of a span, cut to whole characters of the text.
    pub(super) fn range(&self, span: Span) -> Range<usize> {
        let start = self.text.floor_char_boundary(span.start.min(self.text.len()));
        let end = self.text.ceil_char_boundary(span.end.min(self.text.len()));
        start..end.max(start)
    }

    /// Returns line and column of a byte, both counted from one.
    pub(super) fn line_and_column(&self, byte: usize) -> (usize, usize) {
        let before = &self.text[..self.text.floor_char_boundary(byte.min(self.text.len()))];
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
    }
}

/// Origin of a value, for display.
/// Examples are `exp1.toml:12`, `--set loop.period=10ms`, `change loop.period=10ms`, `built-in defaults` and `until the
/// next start`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// Layer.
    pub kind: SourceKind,
    /// The file as given, or the text of the setting.
    pub name: String,
    /// The line, counted from one.
    pub line: usize,
    /// The column in characters, counted from one.
    pub column: usize,
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.kind {
            SourceKind::Default | SourceKind::Waiting | SourceKind::Plugin => f.write_str(&self.name),
            SourceKind::File => write!(f, "{}:{}", self.name, self.line),
            SourceKind::Set => write!(f, "--set {}", self.name),
            SourceKind::Change => write!(f, "change {}", self.name),
        }
    }
}

/// All texts of a configuration.
#[derive(Clone, Debug, Default)]
pub(super) struct Sources(pub(super) Vec<SettingSource>);

impl Sources {
    pub(super) fn of(&self, span: Span) -> &SettingSource {
        // A span is made only for a source of this list, which never shrinks.
        &self.0[span.source]
    }

    /// Returns the folder of the file of a place; empty if it is in no file.
    pub(super) fn folder(&self, span: Span) -> PathBuf {
        let file = self.of(span).path.as_deref();
        file.and_then(Path::parent).map(Path::to_owned).unwrap_or_default()
    }

    /// Returns a path relative to the file that it is written in.
    /// Paths of the command line are relative to its working directory.
    pub(super) fn beside(&self, text: &Spanned<String>) -> Spanned<PathBuf> {
        Spanned::new(self.folder(text.span).join(&text.value), text.span)
    }

    pub(super) fn rank(&self, span: Span) -> usize {
        self.of(span).rank
    }

    pub(super) fn origin(&self, span: Span) -> Origin {
        let source = self.of(span);
        let (line, column) = source.line_and_column(span.start);
        let name = match source.kind {
            SourceKind::Set | SourceKind::Change => source.text.to_string(),
            SourceKind::Default | SourceKind::File | SourceKind::Waiting | SourceKind::Plugin => {
                source.name.clone()
            }
        };
        Origin { kind: source.kind, name, line, column }
    }
}
