use std::cell::Cell;
use std::fmt::{self, Write};

use crate::{Frame, Host, Level, Random};

/// A step's time, random numbers and log; the only source of time and chance that a module has.
pub struct Tick {
    now: u64,
    elapsed: u64,
    number: u64,
    random: *const Cell<Random>,
    host: *const Host,
}

impl Tick {
    /// The tick of a frame.
    ///
    /// # Safety
    /// The frame's pointers stay valid while the result lives.
    pub unsafe fn new(frame: &Frame) -> Self {
        Self {
            now: frame.now,
            elapsed: frame.elapsed,
            number: frame.number,
            random: frame.random,
            host: frame.host,
        }
    }

    /// The host's time, nanoseconds.
    pub fn now(&self) -> u64 {
        self.now
    }

    /// The host's time, seconds.
    pub fn seconds(&self) -> f64 {
        self.now as f64 * 1e-9
    }

    /// Seconds since this module's last tick; 0 in the first.
    pub fn elapsed(&self) -> f64 {
        self.elapsed as f64 * 1e-9
    }

    /// Counts this module's ticks from 1.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The module's own random stream.
    pub fn random<R>(&self, draw: impl FnOnce(&mut Random) -> R) -> R {
        // SAFETY: `new` requires the pointer to be valid; a `Cell` is not shared between threads.
        let cell = unsafe { &*self.random };
        let mut random = cell.get();
        let result = draw(&mut random);
        cell.set(random);
        result
    }

    /// Writes to the agent's log; beyond 512 bytes a message is cut.
    pub fn log(&self, level: Level, message: fmt::Arguments<'_>) {
        let mut line = Line { bytes: [0; 512], length: 0 };
        // A message that doesn't fit is cut, which is no error to anybody.
        let _ = line.write_fmt(message);
        // SAFETY: `new` requires the host to be valid, and the text lives until the call returns.
        unsafe { ((*self.host).log)((*self.host).context, level as u32, line.bytes.as_ptr(), line.length) }
    }

    /// Logs what a user wants to know.
    pub fn info(&self, message: fmt::Arguments<'_>) {
        self.log(Level::Info, message);
    }

    /// Logs what is wrong though the robot goes on.
    pub fn warn(&self, message: fmt::Arguments<'_>) {
        self.log(Level::Warn, message);
    }

    /// Logs what is broken.
    pub fn error(&self, message: fmt::Arguments<'_>) {
        self.log(Level::Error, message);
    }
}

/// A log line on the stack, as a tick must not allocate.
struct Line {
    bytes: [u8; 512],
    length: usize,
}

impl Write for Line {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut end = text.len().min(self.bytes.len() - self.length);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        self.bytes[self.length..self.length + end].copy_from_slice(&text.as_bytes()[..end]);
        self.length += end;
        if end < text.len() { Err(fmt::Error) } else { Ok(()) }
    }
}
