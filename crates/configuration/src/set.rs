use toml_edit::Document;

use super::compare::leaves;
use super::problems::Problems;
use super::scope::flatten;
use super::source::{Span, Spanned};
use super::value::{Table, Value};

/// Setting in one text, `path=value`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Written<'a> {
    pub(super) text: &'a str,
    /// End of the path, if known, in bytes.
    pub(super) equals: Option<usize>,
}

/// Parses a `path=value`, the text of `source`.
/// `equals` is the end of the path, if known.
///
/// The value is TOML; what isn't, such as a bare word, is text. Nothing is cut off: a `#` or `=` belongs to the value.
pub(super) fn parse_set(
    setting: &str,
    equals: Option<usize>,
    source: usize,
    problems: &mut Problems,
) -> Option<Table> {
    let span = |start: usize, end: usize| Span { source, start, end };
    let example =
        "a setting is path=value, such as loop.period=10ms or, in a shell, 'log.levels.\"r2/planner\"=debug'";
    let Some(equals) = equals.or_else(|| first_equals(setting)) else {
        problems.add(span(0, setting.len()), "the setting has no `=`", example);
        return None;
    };
    let (path, written) = (&setting[..equals], &setting[equals + 1..]);
    if let Err(error) = toml_edit::Key::parse(path) {
        problems.add(span(0, equals), format!("the path is not valid: {}", error.message()), example);
        return None;
    }
    let value = written.trim();
    let start = equals + 1 + (written.len() - written.trim_start().len());
    let place = span(start, start + value.len());
    match value.parse::<toml_edit::Value>() {
        Ok(toml) if !toml.is_datetime() => table(setting, source, problems),
        _ if value.is_empty() => {
            problems.add(place, "the value is missing", "for an empty text write path='\"\"'");
            None
        }
        Err(error) if value.starts_with(['"', '\'', '[', '{']) => {
            let range = error.span().unwrap_or(0..value.len());
            problems.add(
                span(start + range.start, start + range.end),
                format!("the value is not valid: {}", error.message()),
                "texts inside lists and tables need quotes; mind that the shell takes one level of them",
            );
            None
        }
        // The spans of the keys are the same, whatever the value.
        _ => {
            let mut table = table(&format!("{path}=\"\""), source, problems)?;
            replace_leaf(&mut table, Spanned::new(Value::Text(value.into()), place));
            Some(table)
        }
    }
}

fn table(text: &str, source: usize, problems: &mut Problems) -> Option<Table> {
    match Document::parse(text) {
        Ok(document) => Some(Table::of_item(document.as_table(), source, problems)),
        Err(error) => {
            let span = Span { source, start: 0, end: text.len() };
            problems.add(span, error.message(), "a setting is path=value");
            None
        }
    }
}

/// Replaces the value at the end of a chain of tables with one entry each.
fn replace_leaf(table: &mut Table, value: Spanned<Value>) {
    let Some(entry) = table.entries.values_mut().next() else { return };
    match &mut entry.value.value {
        Value::Table(inner) => replace_leaf(inner, value),
        _ => entry.value = value,
    }
}

/// Returns the place of the `=` that ends the path, the first outside of quotes.
pub(super) fn first_equals(text: &str) -> Option<usize> {
    let (mut quote, mut escaped) = (None, false);
    for (i, c) in text.char_indices() {
        match (quote, c) {
            (None, '=') => return Some(i),
            (None, '"' | '\'') => quote = Some(c),
            (Some('"'), '\\') if !escaped => {
                escaped = true;
                continue;
            }
            (Some(open), _) if open == c && !escaped => quote = None,
            _ => {}
        }
        escaped = false;
    }
    None
}

/// Returns the flat table of a setting; `None` if it can't be read.
/// Names of modules contain those of their robots.
pub(super) fn flat(setting: &str) -> Option<Table> {
    let mut problems = Problems::default();
    let table = flatten(parse_set(setting, None, 0, &mut problems)?, &mut problems);
    problems.0.is_empty().then_some(table)
}

/// Returns the paths with a value in a setting.
pub(super) fn flat_paths(setting: &str) -> Vec<Vec<String>> {
    let mut paths = Vec::new();
    leaves(&flat(setting).unwrap_or_default(), &[], &mut |path, _| paths.push(path));
    paths
}
