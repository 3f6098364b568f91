use std::cell::Cell;

use slate_blackboard::Stamp;

use crate::Random;

/// Frame of one tick: inputs and room for outputs, filled by the host.
///
/// No atomic is part of it: the host pins all inputs before the step and commits the outputs after it, so one path
/// serves modules that are linked in, loaded, isolated, replayed and tested.
#[repr(C)]
pub struct Frame {
    /// Slots of the ports, in the order of the description.
    pub ports: *const PortSlot,
    /// Number of ports.
    pub port_count: usize,
    /// Value of the module's parameter interface.
    pub params: *const u8,
    /// Size of the parameters, bytes.
    pub params_size: usize,
    /// Counts the changes of the parameters.
    pub params_version: u64,
    /// Host's time, ns.
    pub now: u64,
    /// Time since this module's last tick, ns; 0 in the first.
    pub elapsed: u64,
    /// Counts this module's ticks from 1.
    pub number: u64,
    /// Random stream of the module.
    pub random: *const Cell<Random>,
    /// Services of the host during a tick.
    pub host: *const Host,
}

/// Services of the host during a tick.
#[repr(C)]
pub struct Host {
    /// Context, passed to each call.
    pub context: *const (),
    /// Takes a log message; `level` is a [`Level`].
    pub log: unsafe extern "C" fn(context: *const (), level: u32, text: *const u8, length: usize),
}

/// Severity of a log message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub enum Level {
    /// Failure of a part.
    Error = 0,
    /// Problem with which the robot goes on.
    Warn = 1,
    /// Information for users.
    Info = 2,
    /// Information for developers.
    Debug = 3,
    /// Detailed trace.
    Trace = 4,
}

impl Level {
    /// Returns the level of that number; beyond the last one, the last.
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

/// Port of a frame.
#[repr(C)]
#[derive(Debug)]
pub struct PortSlot {
    /// Schema hash of the port's interface, which binding checks.
    pub schema: u64,
    /// Input: value. Output: working slot; null for a debug output without a reader.
    pub data: *mut u8,
    /// Tail items of the value.
    pub items: Cell<usize>,
    /// Output: room in the tail. Outbox: how many messages fit.
    pub capacity: usize,
    /// Input: stamp of the value. Outbox: its sequence counts earlier messages.
    /// Earlier messages are those of earlier ticks.
    pub stamp: Stamp,
    /// See [`Flags`].
    pub flags: Cell<u32>,
    /// [`Direction`](crate::Direction), which binding checks.
    pub direction: u32,
    /// Command: priority.
    pub priority: Cell<u32>,
    /// Queue, inbox, outbox: the values.
    pub entries: *const Entry,
    /// Number of entries that hold a value.
    pub count: Cell<usize>,
    /// Input and queue: values that this reader never saw.
    pub missed: u64,
}

/// Value in a queue, an inbox or an outbox.
#[repr(C)]
#[derive(Debug)]
pub struct Entry {
    /// Value.
    pub data: *mut u8,
    /// Number of tail items.
    pub items: Cell<usize>,
    /// Stamp of the value.
    /// Outbox: its sequence is the number of an earlier message, to which `answer` belongs.
    pub stamp: Stamp,
    /// Answer to a message.
    /// Inbox: answer of the receiver; 0 is done, else the reason of the refusal. Outbox: delivery of that message; 0 is
    /// waiting, 1 done, 2 lost without an answer, 65536 plus the reason a refusal.
    pub answer: Cell<u32>,
    /// Inbox: number of the sender.
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
