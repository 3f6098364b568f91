//! Lines to devices: serial ports, TCP connections and input devices.
//!
//! A [`LineAddress`] names a line, as the parameter `device` of a driver does, and a [`DeviceLine`] is an open one. No
//! call waits for a device but [`DeviceLine::wait`], and [`DeviceLine::open`] for a TCP connection.
//!
//! ```
//! use slate_device_line::LineAddress;
//!
//! assert_eq!(LineAddress::parse("tcp://192.168.0.10", 115_200, 10940)?.to_string(), "192.168.0.10:10940");
//! assert_eq!(LineAddress::parse("/dev/ttyACM0", 115_200, 10940)?.to_string(), "/dev/ttyACM0");
//! assert!(LineAddress::parse("ttyACM0", 115_200, 10940).is_err());
//! # Ok::<(), slate_device_line::AddressError>(())
//! ```
//!
//! [`simulated`] has the other ends: a pseudo-terminal and a server, with faults, for tests and for trying a driver
//! without its device.

mod address;
mod backoff;
mod device_line;
mod error;
mod input_device;
mod serial_port;
pub mod simulated;
mod tcp_connection;

pub use address::{AddressError, LineAddress};
pub use backoff::Backoff;
pub use device_line::DeviceLine;
pub use error::PortError;
pub use serial_port::SerialPort;
