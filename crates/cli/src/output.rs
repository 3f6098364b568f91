//! What goes to stdout.

use std::fmt::Display;
use std::io::{ErrorKind, Write};

/// Prints a line. Who reads it may have gone, as `head` does; then nobody misses the rest.
pub fn line(text: impl Display) {
    if let Err(error) = writeln!(std::io::stdout(), "{text}")
        && error.kind() != ErrorKind::BrokenPipe
    {
        eprintln!("stdout can't be written: {error}");
    }
}
