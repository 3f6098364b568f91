use std::fmt;
use std::ops::{Deref, Range};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A stretch of the text of a [`SettingSource`]; in the order of the sources, and in each of the places.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Span {
    pub(super) source: usize,
    pub(super) start: usize,
    pub(super) end: usize,
}

/// A value and where it is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spanned<T> {
    /// The value.
    pub value: T,
    /// Where it is written; for a value that follows from another one, where that one is written.
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

/// The layer of a [`SettingSource`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SourceKind {
    /// Built in.
    Default,
    /// A file, or a text given in place of one.
    File,
    /// A setting of the command line.
    Set,
    /// A setting that an edited file changes at the next start.
    Waiting,
    /// A change made at run time.
    Change,
    /// A plugin that was loaded by hand, and brought a module that no text names.
    Plugin,
}

/// A text that settings come from.
#[derive(Clone, Debug)]
pub struct SettingSource {
    pub(super) name: String,
    pub(super) kind: SourceKind,
    pub(super) path: Option<PathBuf>,
    pub(super) text: Arc<str>,
    /// Of two sources, the one with the higher rank overrides the other.
    pub(super) rank: usize,
    pub(super) place: TextPlace,
    /// Kept with its comments and blanks, so that it can be saved back.
    pub(super) document: Option<toml_edit::Document<Arc<str>>>,
}

/// Where a text stands in a file that describes several agents or variants.
#[derive(Clone, Debug, Default)]
pub(super) struct TextPlace {
    /// The file that this one was included by in the end; what its table of an agent says goes over all of them.
    pub(super) root: usize,
    /// The text of which this is a table: that of the agent, or of a chosen variant.
    pub(super) part_of: Option<usize>,
    /// The path of that table.
    pub(super) table: Vec<String>,
    /// Whether the table of that agent includes it.
    pub(super) own: bool,
}

impl SettingSource {
    /// A single setting.
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

    /// The file's path as given, `--set`, `change`, or `built-in defaults`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Where the text comes from.
    pub fn kind(&self) -> SourceKind {
        self.kind
    }

    /// The path of a file that was read.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// The whole text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The parsed text with its comments, to be changed and saved back; none for a single setting.
    pub fn document(&self) -> Option<&toml_edit::Document<Arc<str>>> {
        self.document.as_ref()
    }

    /// The bytes of a span, cut to whole characters of the text.
    pub(super) fn range(&self, span: Span) -> Range<usize> {
        let start = self.text.floor_char_boundary(span.start.min(self.text.len()));
        let end = self.text.ceil_char_boundary(span.end.min(self.text.len()));
        start..end.max(start)
    }

    /// Line and column of a byte, both counted from one.
    pub(super) fn line_and_column(&self, byte: usize) -> (usize, usize) {
        let before = &self.text[..self.text.floor_char_boundary(byte.min(self.text.len()))];
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        (before.matches('\n').count() + 1, before[line_start..].chars().count() + 1)
    }
}

/// The origin of a value, for people: `exp1.toml:12`, `--set loop.period=10ms`, `change loop.period=10ms`,
/// `built-in defaults`, `until the next start`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// Which layer.
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

    /// The folder of the file that a place is in; empty where there is none.
    pub(super) fn folder(&self, span: Span) -> PathBuf {
        let file = self.of(span).path.as_deref();
        file.and_then(Path::parent).map(Path::to_owned).unwrap_or_default()
    }

    /// A path as it is written in a file: relative to that file. The command line's are relative to where it was given.
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
