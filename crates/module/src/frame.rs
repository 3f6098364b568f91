use std::cell::Cell;

use slate_blackboard::Stamp;

use crate::Random;

/// One tick's view of the world, filled by the host: what the module reads, and where it writes.
///
/// No atomic is part of it: the host pins all inputs before the step and commits the outputs after it, so one path
/// serves modules that are linked in, loaded, isolated, replayed and tested.
#[repr(C)]
pub struct Frame {
    /// A slot per port, in the order of the description.
    pub ports: *const PortSlot,
    /// How many ports there are.
    pub port_count: usize,
    /// A value of the module's parameter interface.
    pub params: *const u8,
    /// Its bytes.
    pub params_size: usize,
    /// Counts the changes of the parameters.
    pub params_version: u64,
    /// The host's time in nanoseconds.
    pub now: u64,
    /// Nanoseconds since this module's last tick; 0 in the first.
    pub elapsed: u64,
    /// Counts this module's ticks from 1.
    pub number: u64,
    /// The module's own random stream.
    pub random: *const Cell<Random>,
    /// What the module may ask of the host.
    pub host: *const Host,
}

/// What a module may ask of the host during a tick.
#[repr(C)]
pub struct Host {
    /// Given back to each call.
    pub context: *const (),
    /// Takes a log message; `level` is a [`Level`].
    pub log: unsafe extern "C" fn(context: *const (), level: u32, text: *const u8, length: usize),
}

/// The importance of a log message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub enum Level {
    /// Something is broken.
    Error = 0,
    /// Something is wrong but the robot goes on.
    Warn = 1,
    /// What a user wants to know.
    Info = 2,
    /// What a developer wants to know.
    Debug = 3,
    /// Everything.
    Trace = 4,
}

impl Level {
    /// The level of that number; beyond the last one, the last.
    pub fn from_number(number: u32) -> Self {
        match number {
            0 => Self::Error,
            1 => Self::Warn,
            2 => Self::Info,
            3 => Self::Debug,
            _ => Self::Trace,
        }
    }
}

/// A port of a frame.
#[repr(C)]
#[derive(Debug)]
pub struct PortSlot {
    /// Schema hash of what the port carries, which binding checks.
    pub schema: u64,
    /// Input: the value. Output: the working slot; null for a debug output that nobody watches.
    pub data: *mut u8,
    /// Tail items of the value.
    pub items: Cell<usize>,
    /// Output: room in the tail. Outbox: how many messages fit.
    pub capacity: usize,
    /// Input: when the value was written. Outbox: its sequence counts the messages of earlier ticks.
    pub stamp: Stamp,
    /// See [`Flags`].
    pub flags: Cell<u32>,
    /// A [`Direction`](crate::Direction), which binding checks.
    pub direction: u32,
    /// Command: how urgent.
    pub priority: Cell<u32>,
    /// Queue, inbox, outbox: the values.
    pub entries: *const Entry,
    /// How many of the entries hold a value.
    pub count: Cell<usize>,
    /// Input and queue: values that this reader never saw.
    pub missed: u64,
}

/// A value in a queue, an inbox or an outbox.
#[repr(C)]
#[derive(Debug)]
pub struct Entry {
    /// The value.
    pub data: *mut u8,
    /// Its tail items.
    pub items: Cell<usize>,
    /// When it was written. Outbox: its sequence is the number of an earlier message, which `answer` is about.
    pub stamp: Stamp,
    /// Inbox: what the receiver answers; 0 is done, else the reason of the refusal. Outbox: how that message fares; 0 it waits, 1 it is done,
    /// 2 nobody will answer, 65536 and the reason it was refused.
    pub answer: Cell<u32>,
    /// Inbox: who sent it.
    pub sender: u32,
}

/// Bits of [`PortSlot::flags`].
#[derive(Debug)]
pub struct Flags;

impl Flags {
    /// Input: not read by an earlier tick.
    pub const NEW: u32 = 1;
    /// Input: older than its declaration allows, or its writer is gone or late.
    pub const STALE: u32 = 2;
    /// Input: something writes it now, by a link.
    pub const ALIVE: u32 = 4;
    /// Output: was written in this tick.
    pub const SET: u32 = 8;
    /// Output: is just being written in place.
    pub const BUSY: u32 = 16;
}
