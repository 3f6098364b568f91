//! Far ends of lines: simulated devices for tests and to try a driver.

mod device;
mod faults;
mod line_end;
mod terminal;

pub use device::{DeviceFirmware, SimulatedDevice, SimulatedLine, SimulationError};
pub use faults::Faults;
pub use terminal::{PseudoTerminal, TerminalError};
