//! Where a panic came from: only the panic hook is told, and the log of the module wants it.

use std::cell::Cell;
use std::fmt::{self, Write};
use std::sync::Once;

/// A file and a line; a long path loses its end.
#[derive(Clone, Copy)]
pub(crate) struct Place {
    text: [u8; 120],
    length: usize,
}

thread_local! {
    /// Has nothing to drop: a thread's destructors would keep the library of the module open.
    static LAST: Cell<Option<Place>> = const { Cell::new(None) };
}

/// Makes panics leave their place; whatever else is done about them still is.
pub(crate) fn remember() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            LAST.set(panic.location().map(|location| {
                let mut place = Place { text: [0; 120], length: 0 };
                // What doesn't fit is cut.
                let _ = write!(place, "{}:{}", location.file(), location.line());
                place
            }));
            before(panic);
        }));
    });
}

/// The place of this thread's last panic, once.
pub(crate) fn take() -> Option<Place> {
    LAST.take()
}

impl Write for Place {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let room = &mut self.text[self.length..];
        let length = text.floor_char_boundary(room.len());
        room[..length].copy_from_slice(&text.as_bytes()[..length]);
        self.length += length;
        if length < text.len() { Err(fmt::Error) } else { Ok(()) }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(std::str::from_utf8(&self.text[..self.length]).unwrap_or_default())
    }
}
