use std::time::Duration;

use crate::address::LineAddress;
use crate::error::PortError;
use crate::input_device::InputDevice;
use crate::serial_port::SerialPort;
use crate::tcp_connection::TcpConnection;

/// Open line to a device.
#[derive(Debug)]
pub struct DeviceLine(OpenLine);

#[derive(Debug)]
enum OpenLine {
    Serial(SerialPort),
    Tcp(TcpConnection),
    Input(InputDevice),
}

impl DeviceLine {
    /// Opens a line; a connection may take 0.4 s.
    ///
    /// # Errors
    /// Returns the remedy.
    pub fn open(address: &LineAddress) -> Result<Self, PortError> {
        Ok(Self(match address {
            LineAddress::Serial { path, baud } => OpenLine::Serial(SerialPort::open(path, *baud)?),
            LineAddress::Tcp(address) => OpenLine::Tcp(TcpConnection::open(address)?),
            LineAddress::Input(path) => OpenLine::Input(InputDevice::open(path)?),
        }))
    }

    /// Waits until something can be read, or the time is up.
    ///
    /// # Errors
    /// When the device is gone.
    pub fn wait(&self, limit: Duration) -> Result<(), PortError> {
        match &self.0 {
            OpenLine::Serial(port) => port.wait(limit),
            OpenLine::Tcp(connection) => connection.wait(limit),
            OpenLine::Input(device) => device.wait(limit),
        }
    }

    /// Reads available bytes; returns their number.
    ///
    /// # Errors
    /// When the device is gone.
    pub fn read(&self, bytes: &mut [u8]) -> Result<usize, PortError> {
        match &self.0 {
            OpenLine::Serial(port) => port.read(bytes),
            OpenLine::Tcp(connection) => connection.read(bytes),
            OpenLine::Input(device) => device.read(bytes),
        }
    }

    /// Writes as many bytes as fit, and removes them from `bytes`.
    /// An input device accepts no bytes.
    ///
    /// # Errors
    /// When the device is gone.
    pub fn write(&self, bytes: &mut Vec<u8>) -> Result<(), PortError> {
        match &self.0 {
            OpenLine::Serial(port) => port.write(bytes),
            OpenLine::Tcp(connection) => connection.write(bytes),
            OpenLine::Input(_) => {
                bytes.clear();
                Ok(())
            }
        }
    }

    /// Sets the line DTR of a serial port; see [`SerialPort::set_data_terminal_ready`].
    pub fn set_data_terminal_ready(&self, is_ready: bool) {
        if let OpenLine::Serial(port) = &self.0 {
            port.set_data_terminal_ready(is_ready);
        }
    }
}
