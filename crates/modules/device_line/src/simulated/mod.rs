//! The other ends of lines: simulated devices for tests, and for trying a driver without its device.

mod device;
mod faults;
mod line_end;
mod terminal;

pub use device::{DeviceFirmware, SimulatedDevice, SimulatedLine, SimulationError};
pub use faults::Faults;
pub use terminal::{PseudoTerminal, TerminalError};
