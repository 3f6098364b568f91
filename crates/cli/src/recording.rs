//! Recordings as arguments and sources of commands.

use std::path::Path;

use slate::bag::Unread;
use slate::replay::Run;
use slate::report::page::{Followed, Known};
use slate::runtime::printable;

use crate::{output, scene};

/// Parses seconds after the first message, and returns nanoseconds.
pub fn parse_offset(text: &str) -> Result<u64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.0..=1e9).contains(&seconds) => Ok((seconds * 1e9).round() as u64),
        _ => Err("expected seconds after the first message, at least 0".into()),
    }
}

/// Reports the unreadable parts of a recording; true without any.
pub fn all_read(file: &Path, unread: &[Unread]) -> bool {
    for unread in unread {
        eprintln!("{}: {}", printable(file), output::harmless(unread));
    }
    unread.is_empty()
}

/// Returns the world and robots of a recording's configuration.
/// `None` if it has no configuration that can still be read; the rest of the recording is usable without.
pub fn known(recording: &Path) -> Option<Known> {
    let database = Run::read(recording).ok()?.configuration(Vec::new()).ok()?;
    let configuration = database.current();
    let scene = scene::of(&configuration).unwrap_or_default();
    Some(Known { scene, robots: Followed::of(&configuration) })
}
