//! Serial device of the robot.

pub use slate_device_line::{PortError, SerialPort as Port};
