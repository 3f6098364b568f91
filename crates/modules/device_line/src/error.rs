use std::path::{Path, PathBuf};

use rustix::io::Errno;

/// Reason why a device can't be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PortError {
    /// Missing device.
    #[error("{} does not exist: is its cable plugged in?", .0.display())]
    Missing(PathBuf),
    /// No permission to open the device.
    #[error(
        "{} may not be opened: add yourself to its group (`sudo usermod -aG {} $USER`) and log in again",
        .0.display(), group(.0)
    )]
    Forbidden(PathBuf),
    /// Device in use by another program.
    #[error("{} is in use: end the other program that has it open", .0.display())]
    Busy(PathBuf),
    /// Path of another type of file.
    #[error("{} is not a serial device", .0.display())]
    NotSerial(PathBuf),
    /// Unsupported baud rate.
    #[error("{} does not support {baud} baud", .path.display())]
    Speed {
        /// Device.
        path: PathBuf,
        /// Requested value.
        baud: u32,
    },
    /// Device removed while open.
    #[error("{} was disconnected: was the cable pulled?", .0.display())]
    Gone(PathBuf),
    /// No connection to a host.
    #[error("no connection to {address}: {reason}; has the device power, and this address?")]
    Unreachable {
        /// Host and port.
        address: String,
        /// Error of the system.
        reason: String,
    },
    /// Connection ended by the host.
    #[error("{0} ended the connection: was its power or cable pulled?")]
    Disconnected(String),
    /// Other error.
    #[error("{}: {reason}", .path.display())]
    Other {
        /// Device.
        path: PathBuf,
        /// Error of the system.
        reason: String,
    },
}

/// Returns the group that Linux gives such a device.
fn group(path: &Path) -> &'static str {
    if path.starts_with("/dev/input") { "input" } else { "dialout" }
}

impl PortError {
    /// Returns the error of a device that could not be opened.
    pub(crate) fn opening(path: &Path, error: Errno) -> Self {
        match error {
            Errno::NOENT | Errno::NXIO | Errno::NODEV => Self::Missing(path.into()),
            // A pseudo-terminal whose other end is gone, or an adapter that is just going.
            Errno::IO => Self::Gone(path.into()),
            Errno::ACCESS | Errno::PERM => Self::Forbidden(path.into()),
            Errno::BUSY => Self::Busy(path.into()),
            Errno::ISDIR => Self::NotSerial(path.into()),
            error => Self::other(path, error),
        }
    }

    /// Returns the error of a failed request to an open device.
    pub(crate) fn using(path: &Path, error: Errno) -> Self {
        match error {
            Errno::IO | Errno::NXIO | Errno::NODEV | Errno::NOENT | Errno::BADF => Self::Gone(path.into()),
            error => Self::other(path, error),
        }
    }

    pub(crate) fn other(path: &Path, error: Errno) -> Self {
        Self::Other { path: path.into(), reason: std::io::Error::from(error).to_string() }
    }
}
