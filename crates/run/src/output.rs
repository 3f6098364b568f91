//! Output on stdout.

use std::fmt::Display;
use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::ValueEnum;
use serde_json::{Value, json};
use slate_runtime::printable_text;

/// Lost output: a write has failed.
static LOST: AtomicBool = AtomicBool::new(false);

/// Closed output: its reader has gone.
static UNREAD: AtomicBool = AtomicBool::new(false);

/// Returns untrusted text that is safe to print.
/// It breaks lines and contains no other control characters that a terminal would obey.
pub fn harmless(text: impl Display) -> String {
    let text = text.to_string();
    text.split('\n').map(printable_text).collect::<Vec<_>>().join("\n")
}

/// Prints a line.
/// If its reader has gone, as `head` does, the output is dropped silently.
pub fn line(text: impl Display) {
    note(writeln!(std::io::stdout(), "{}", harmless(text)));
}

/// Notes the result of a write to stdout, and reports the first failed one.
/// A closed pipe is not a failure.
pub fn note(written: std::io::Result<()>) {
    match written {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::BrokenPipe => UNREAD.store(true, Ordering::Relaxed),
        Err(error) => {
            if !LOST.swap(true, Ordering::Relaxed) {
                eprintln!("stdout can't be written: {error}");
            }
        }
    }
}

/// Returns whether the reader of the output has gone.
pub fn is_unread() -> bool {
    UNREAD.load(Ordering::Relaxed) || is_lost()
}

/// Returns whether output could not be written, so that it is incomplete.
pub fn is_lost() -> bool {
    LOST.load(Ordering::Relaxed)
}

/// Use of colors in the output.
#[allow(missing_docs, reason = "a comment here would become help of the command")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ColorChoice {
    Auto,
    Always,
    Never,
}

/// Color option.
static COLOR: OnceLock<ColorChoice> = OnceLock::new();

/// Decides on colors, once.
pub fn set_color(color: ColorChoice) {
    // The first user is this program, too.
    let _ = COLOR.set(color);
}

/// Returns whether a stream may have colors.
pub fn has_color(stream: &impl IsTerminal) -> bool {
    match COLOR.get() {
        Some(ColorChoice::Always) => return true,
        Some(ColorChoice::Never) => return false,
        Some(ColorChoice::Auto) | None => {}
    }
    let variable = |name| std::env::var_os(name).filter(|value| !value.is_empty());
    let is_forced = variable("CLICOLOR_FORCE").is_some_and(|value| value != "0");
    variable("NO_COLOR").is_none() && (is_forced || stream.is_terminal())
}

/// JSON output for programs.
static JSON: AtomicBool = AtomicBool::new(false);

/// Sets whether errors are printed as JSON.
pub fn set_json(is_asked: bool) {
    JSON.store(is_asked, Ordering::Relaxed);
}

/// Returns whether errors are printed as JSON.
pub fn is_json() -> bool {
    JSON.load(Ordering::Relaxed)
}

/// Formats a count with its noun.
pub fn counted(count: u64, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// Prints a value as JSON, in a line.
pub fn json(value: &impl serde::Serialize) {
    match serde_json::to_string(value) {
        Ok(text) => line(text),
        Err(error) => eprintln!("the result can't be written as JSON: {error}"),
    }
}

/// Prints a document of a form that has a name.
pub fn document(schema: &str, value: &impl serde::Serialize) {
    match named(schema, value) {
        Ok(document) => line(document),
        Err(error) => eprintln!("the result can't be written as JSON: {error}"),
    }
}

/// Returns a document with the name of its schema, in a line.
/// A value that is not an object is in it under `value`.
///
/// # Errors
/// The value has no JSON.
pub fn named(schema: &str, value: &impl serde::Serialize) -> Result<Value, serde_json::Error> {
    let mut document = match serde_json::to_value(value)? {
        object @ Value::Object(_) => object,
        other => json!({ "value": other }),
    };
    document["schema"] = json!(schema);
    Ok(document)
}

/// Prints rows with their columns below each other.
pub fn columns<const N: usize>(rows: impl IntoIterator<Item = [String; N]>) {
    aligned(rows).iter().for_each(line);
}

/// Rows with their columns below each other.
pub fn aligned<const N: usize>(rows: impl IntoIterator<Item = [String; N]>) -> Vec<String> {
    let rows: Vec<_> = rows.into_iter().collect();
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..N).map(width).collect();
    let aligned = rows.iter().map(|row| {
        let cells = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:width$}"));
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    });
    aligned.collect()
}
