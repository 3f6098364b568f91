//! Lines around a place in a text.

use std::ops::Range;
use std::sync::Arc;

use miette::{MietteError, MietteSpanContents, SourceCode, SourceSpan, SpanContents};

/// Lines around a place in a text, which a report may show.
///
/// Miette looks for the lines of a place from the beginning of its text, several times for each error; of a long text it gets
/// these lines alone.
#[derive(Clone, Debug)]
pub(super) struct ContextLines {
    name: String,
    text: Arc<str>,
    /// Range of the lines in the text.
    lines: Range<usize>,
    /// Number of lines before these.
    lines_before: usize,
}

/// Lines that are kept before and after the place; a report shows one.
const CONTEXT: usize = 3;

impl ContextLines {
    /// Makes the context around a range of a text.
    pub fn around(name: &str, text: &Arc<str>, range: &Range<usize>) -> Self {
        let bytes = text.as_bytes();
        let (before, after) = (&bytes[..range.start.min(bytes.len())], &bytes[range.end.min(bytes.len())..]);
        let newlines = |bytes: &[u8]| bytes.iter().filter(|byte| **byte == b'\n').count();
        let mut ends = before.iter().enumerate().rev().filter(|(_, byte)| **byte == b'\n');
        let start = ends.nth(CONTEXT).map_or(0, |(newline, _)| newline + 1);
        let mut ends = after.iter().enumerate().filter(|(_, byte)| **byte == b'\n');
        let end =
            ends.nth(CONTEXT).map_or(bytes.len(), |(newline, _)| bytes.len() - after.len() + newline + 1);
        let lines_before = newlines(&bytes[..start]);
        Self { name: name.into(), text: Arc::clone(text), lines: start..end, lines_before }
    }

    /// Name of the text.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The whole text.
    pub fn text(&self) -> &Arc<str> {
        &self.text
    }
}

impl SourceCode for ContextLines {
    fn read_span<'a>(
        &'a self,
        span: &SourceSpan,
        lines_before: usize,
        lines_after: usize,
    ) -> Result<Box<dyn SpanContents<'a> + 'a>, MietteError> {
        let start = self.lines.start;
        let offset = span.offset().checked_sub(start).ok_or(MietteError::OutOfBounds)?;
        let lines = &self.text.as_bytes()[self.lines.clone()];
        let found =
            lines.read_span(&SourceSpan::new(offset.into(), span.len()), lines_before, lines_after)?;
        let shown = SourceSpan::new((found.span().offset() + start).into(), found.span().len());
        let line = found.line() + self.lines_before;
        let (name, data) = (self.name.clone(), found.data());
        let contents =
            MietteSpanContents::new_named(name, data, shown, line, found.column(), found.line_count());
        Ok(Box::new(contents))
    }
}
