//! Where lines of the log go.

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

/// Where lines of the log go.
pub trait LogTarget: Send {
    /// Takes a line. No module waits for it, but other targets do, so it should not take long.
    fn write(&mut self, record: &Record);

    /// Called when no line comes for some milliseconds. True asks to be called again as soon.
    fn idle(&mut self) -> bool {
        false
    }

    /// What the log should say about this target, such as that its disk is full; asked after each line.
    fn complaint(&mut self) -> Option<String> {
        None
    }
}
