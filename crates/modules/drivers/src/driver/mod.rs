//! Common part of all drivers: the thread that owns the line, and its tick.

mod protocol;
mod reader;
mod reading;
mod step;
mod watch;

pub use protocol::{DeviceFault, DeviceProtocol};
pub(crate) use reading::{DriverReading, reading};
pub use step::{DriverIo, DriverState};
pub(crate) use step::{DriverStart, device, step};
