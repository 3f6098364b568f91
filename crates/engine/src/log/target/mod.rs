//! Targets of the log.

mod console;
mod file;
mod memory;
mod outage;
mod remote;
mod syslog;

pub use console::ConsoleTarget;
pub use file::{FileTarget, Rotation};
pub use memory::MemoryTarget;
pub use remote::RemoteTarget;
pub use syslog::{SyslogAddress, SyslogTarget};

use super::Record;
use super::record::level_name;

/// Target of the log.
pub trait LogTarget: Send {
    /// Writes a line.
    /// No module waits for it, but other targets do, so it should not take long.
    fn write(&mut self, record: &Record);

    /// Performs pending work when no line has come for some milliseconds.
    /// True requests another call as soon.
    fn idle(&mut self) -> bool {
        false
    }

    /// Returns a message about the target for the log, such as that its disk is full.
    /// Called after each line.
    fn diagnostic(&mut self) -> Option<String> {
        None
    }
}
