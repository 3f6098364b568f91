//! Output on stdout.

use std::fmt::Display;
use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::ValueEnum;
use serde_json::{Value, json};
use slate_runtime::printable_text;

/// Whether something could not be written.
static LOST: AtomicBool = AtomicBool::new(false);

/// Whether who read it has gone.
static UNREAD: AtomicBool = AtomicBool::new(false);

/// A text that may be somebody else's: it breaks lines and nothing else, and a terminal obeys nothing in it.
pub fn harmless(text: impl Display) -> String {
    let text = text.to_string();
    text.split('\n').map(printable_text).collect::<Vec<_>>().join("\n")
}

/// Prints a line. Who reads it may have gone, as `head` does; then nobody misses the rest.
pub fn line(text: impl Display) {
    note(writeln!(std::io::stdout(), "{}", harmless(text)));
}

/// Notes the result of a write to stdout, and reports the first one that failed; a closed pipe is no failure.
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

/// Whether nobody reads what is printed any more.
pub fn is_unread() -> bool {
    UNREAD.load(Ordering::Relaxed) || is_lost()
}

/// Whether something could not be written, so that whoever relies on it must know.
pub fn is_lost() -> bool {
    LOST.load(Ordering::Relaxed)
}

/// When what is written has colours.
#[allow(missing_docs, reason = "a comment here would become help of the command")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Colour {
    Auto,
    Always,
    Never,
}

/// The colour option.
static COLOUR: OnceLock<Colour> = OnceLock::new();

/// Decides on colours, once.
pub fn set_colour(colour: Colour) {
    // Whoever was first is this program, too.
    let _ = COLOUR.set(colour);
}

/// Whether what is written there may have colours.
pub fn has_colour(stream: &impl IsTerminal) -> bool {
    match COLOUR.get() {
        Some(Colour::Always) => return true,
        Some(Colour::Never) => return false,
        Some(Colour::Auto) | None => {}
    }
    let variable = |name| std::env::var_os(name).filter(|value| !value.is_empty());
    let is_forced = variable("CLICOLOR_FORCE").is_some_and(|value| value != "0");
    variable("NO_COLOR").is_none() && (is_forced || stream.is_terminal())
}

/// Whether a program reads what is printed.
static JSON: AtomicBool = AtomicBool::new(false);

/// Sets whether errors are printed as JSON.
pub fn set_json(is_asked: bool) {
    JSON.store(is_asked, Ordering::Relaxed);
}

/// Whether what is wrong is said as JSON.
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

/// A document of a form that has a name, in a line. What is no object stands in it under `value`.
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
