use std::cell::Cell;
use std::fmt::{self, Write};

use crate::{Frame, Host, Level, Random};

/// Time, random numbers and log of a step.
/// It is the only source of time and chance that a module has.
pub struct Tick {
    now: u64,
    elapsed: u64,
    number: u64,
    random: *const Cell<Random>,
    host: *const Host,
}

impl Tick {
    /// Returns the tick of a frame.
    ///
    /// # Safety
    /// The frame's pointers stay valid while the result lives.
    #[inline]
    pub unsafe fn new(frame: &Frame) -> Self {
        Self {
            now: frame.now,
            elapsed: frame.elapsed,
            number: frame.number,
            random: frame.random,
            host: frame.host,
        }
    }

    /// Returns the host's time, ns.
    pub fn now(&self) -> u64 {
        self.now
    }

    /// Returns the host's time, s.
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

    /// Draws from the module's random stream.
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
        self.log_with(level, message, &[]);
    }

    /// Writes to the agent's log, with fields that tools read without parsing the text.
    /// Values that change from one message to the next belong in fields: messages of the same text count as repetitions
    /// of each other.
    ///
    /// All fields together hold 256 bytes, and one that doesn't fit is left out rather than cut; the text is cut so
    /// that both are within 512 bytes.
    ///
    /// ```
    /// # use slate_module::{Level, Tick};
    /// # fn tick(now: &Tick) {
    /// now.log_with(Level::Info, format_args!("arrived"), &[("distance", 0.2.into()), ("goal", "door".into())]);
    /// # }
    /// ```
    pub fn log_with(&self, level: Level, message: fmt::Arguments<'_>, fields: &[(&str, FieldValue<'_>)]) {
        let mut parts = LogText::<256>::new();
        for (key, value) in fields {
            let before = parts.length;
            if parts.field(key, *value).is_err() {
                parts.length = before;
            }
        }
        let mut line = LogText::<512>::new();
        line.room = line.bytes.len() - parts.length;
        // A message that doesn't fit is truncated, which is not an error.
        let _ = ControlFilter { line: &mut line, unwanted: &[SEPARATOR] }.write_fmt(message);
        line.room = line.bytes.len();
        // It has room, as the text left it.
        let _ = line.write_str(parts.as_str());
        // SAFETY: `new` requires the host to be valid, and the text lives until the call returns.
        unsafe { ((*self.host).log)((*self.host).context, level as u32, line.bytes.as_ptr(), line.length) }
    }

    /// Logs information for users.
    pub fn info(&self, message: fmt::Arguments<'_>) {
        self.log(Level::Info, message);
    }

    /// Logs a problem with which the robot continues.
    pub fn warn(&self, message: fmt::Arguments<'_>) {
        self.log(Level::Warn, message);
    }

    /// Logs a failure.
    pub fn error(&self, message: fmt::Arguments<'_>) {
        self.log(Level::Error, message);
    }
}

/// Separator before each field of a log message: ASCII's unit separator.
const SEPARATOR: char = '\u{1f}';

/// Value of a field of a log message.
/// Made by `into` from a number, a truth value or text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldValue<'a> {
    /// Truth value.
    Bool(bool),
    /// Signed integer.
    Integer(i64),
    /// Unsigned integer.
    Unsigned(u64),
    /// Number.
    Float(f64),
    /// Number of single precision, apart as it has fewer digits.
    Single(f32),
    /// Text.
    Text(&'a str),
}

macro_rules! field_values {
    ($($kind:ident($wide:ty): $($type:ty),*;)*) => { $($(
        impl From<$type> for FieldValue<'_> {
            fn from(value: $type) -> Self {
                Self::$kind(value as $wide)
            }
        }
    )*)* };
}
field_values! {
    Bool(bool): bool;
    Integer(i64): i8, i16, i32, i64, isize;
    Unsigned(u64): u8, u16, u32, u64, usize;
    Float(f64): f64;
    Single(f32): f32;
}

impl<'a> From<&'a str> for FieldValue<'a> {
    fn from(value: &'a str) -> Self {
        Self::Text(value)
    }
}

impl fmt::Display for FieldValue<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bool(value) => value.fmt(f),
            Self::Integer(value) => value.fmt(f),
            Self::Unsigned(value) => value.fmt(f),
            Self::Float(value) => value.fmt(f),
            Self::Single(value) => value.fmt(f),
            Self::Text(value) => value.fmt(f),
        }
    }
}

/// Log line on the stack, as a tick must not allocate.
struct LogText<const N: usize> {
    bytes: [u8; N],
    length: usize,
    /// Usable size of the buffer, bytes.
    room: usize,
}

impl<const N: usize> LogText<N> {
    fn new() -> Self {
        Self { bytes: [0; N], length: 0, room: N }
    }

    fn as_str(&self) -> &str {
        // Only whole characters were written.
        str::from_utf8(&self.bytes[..self.length]).unwrap_or_default()
    }

    fn field(&mut self, key: &str, value: FieldValue<'_>) -> fmt::Result {
        self.write_char(SEPARATOR)?;
        ControlFilter { line: self, unwanted: &[SEPARATOR, '='] }.write_str(key)?;
        self.write_char('=')?;
        write!(ControlFilter { line: self, unwanted: &[SEPARATOR] }, "{value}")
    }
}

impl<const N: usize> Write for LogText<N> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let mut end = text.len().min(self.room - self.length);
        while !text.is_char_boundary(end) {
            end -= 1;
        }
        self.bytes[self.length..self.length + end].copy_from_slice(&text.as_bytes()[..end]);
        self.length += end;
        if end < text.len() { Err(fmt::Error) } else { Ok(()) }
    }
}

/// Writes `_` in place of characters that have a meaning of their own.
struct ControlFilter<'a, const N: usize> {
    line: &'a mut LogText<N>,
    unwanted: &'static [char],
}

impl<const N: usize> Write for ControlFilter<'_, N> {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for (place, part) in text.split(self.unwanted).enumerate() {
            if place > 0 {
                self.line.write_char('_')?;
            }
            self.line.write_str(part)?;
        }
        Ok(())
    }
}
