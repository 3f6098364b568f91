//! The serial device: raw bytes at a speed, without ever waiting.

use std::path::{Path, PathBuf};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::OwnedFd;
use rustix::fs::{FlockOperation, Mode, OFlags, flock, open};
use rustix::io::Errno;
use rustix::termios::{
    ControlModes, OptionalActions, QueueSelector, SpecialCodeIndex, ioctl_tiocexcl, ioctl_tiocnxcl, isatty,
    tcflush, tcgetattr, tcsetattr,
};

/// Why a device can't be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PortError {
    /// The device is missing.
    #[error("{} is not there: is the robot's cable plugged in?", .0.display())]
    Missing(PathBuf),
    /// It may not be opened.
    #[error(
        "{} may not be opened: add yourself to its group (`sudo usermod -aG dialout $USER`) and log in again",
        .0.display()
    )]
    Forbidden(PathBuf),
    /// Another program has it.
    #[error("{} is in use: end the other program that has it open", .0.display())]
    Busy(PathBuf),
    /// It is something else.
    #[error("{} is no serial device", .0.display())]
    NotSerial(PathBuf),
    /// It can't be set to that speed.
    #[error("{} has no speed of {baud} baud", .path.display())]
    Speed {
        /// The device.
        path: PathBuf,
        /// Requested value.
        baud: u32,
    },
    /// It was taken away while it was open.
    #[error("{} is gone: was the cable pulled?", .0.display())]
    Gone(PathBuf),
    /// Something else.
    #[error("{}: {reason}", .path.display())]
    Other {
        /// The device.
        path: PathBuf,
        /// Error of the system.
        reason: String,
    },
}

/// An open serial device, which no other program can open meanwhile.
#[derive(Debug)]
pub struct Port {
    file: OwnedFd,
    path: PathBuf,
}

impl Port {
    /// Opens a device with 8 data bits, no parity, 1 stop bit and no flow control, and flushes it.
    ///
    /// # Errors
    /// Returns the remedy.
    pub fn open(path: &Path, baud: u32) -> Result<Self, PortError> {
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let file = open(path, flags, Mode::empty()).map_err(|error| match error {
            Errno::NOENT | Errno::NXIO | Errno::NODEV => PortError::Missing(path.into()),
            // A pseudo-terminal whose other end is gone, or an adapter that is just going.
            Errno::IO => PortError::Gone(path.into()),
            Errno::ACCESS | Errno::PERM => PortError::Forbidden(path.into()),
            Errno::BUSY => PortError::Busy(path.into()),
            Errno::ISDIR => PortError::NotSerial(path.into()),
            error => other(path, error),
        })?;
        if !isatty(&file) {
            return Err(PortError::NotSerial(path.into()));
        }
        flock(&file, FlockOperation::NonBlockingLockExclusive).map_err(|error| match error {
            Errno::WOULDBLOCK => PortError::Busy(path.into()),
            error => other(path, error),
        })?;
        let port = Self { file, path: path.into() };
        port.set_up(baud)?;
        Ok(port)
    }

    fn set_up(&self, baud: u32) -> Result<(), PortError> {
        let failed = |error| self.failed(error);
        // Programs that do not lock devices are kept out too.
        ioctl_tiocexcl(&self.file).map_err(failed)?;
        let mut settings = tcgetattr(&self.file).map_err(failed)?;
        settings.make_raw();
        settings.control_modes |= ControlModes::CREAD | ControlModes::CLOCAL | ControlModes::CS8;
        settings.control_modes &= !(ControlModes::CSTOPB | ControlModes::PARENB | ControlModes::CRTSCTS);
        settings.special_codes[SpecialCodeIndex::VMIN] = 1;
        settings.special_codes[SpecialCodeIndex::VTIME] = 0;
        let no_such_speed = |_| PortError::Speed { path: self.path.clone(), baud };
        settings.set_speed(baud).map_err(no_such_speed)?;
        tcsetattr(&self.file, OptionalActions::Now, &settings).map_err(failed)?;
        // A device may take the settings and keep a speed of its own.
        let speed = tcgetattr(&self.file).map_err(failed)?.output_speed();
        if speed.abs_diff(baud) > baud / 50 {
            return Err(PortError::Speed { path: self.path.clone(), baud });
        }
        tcflush(&self.file, QueueSelector::IOFlush).map_err(failed)
    }

    /// Waits until something can be read, or the time is up.
    ///
    /// # Errors
    /// When the device is gone.
    pub fn wait(&self, limit: std::time::Duration) -> Result<(), PortError> {
        let limit = Timespec { tv_sec: limit.as_secs().cast_signed(), tv_nsec: limit.subsec_nanos().into() };
        match poll(&mut [PollFd::new(&self.file, PollFlags::IN)], Some(&limit)) {
            Ok(_) | Err(Errno::INTR) => Ok(()),
            Err(error) => Err(self.failed(error)),
        }
    }

    /// Reads available bytes; returns their number.
    ///
    /// # Errors
    /// When the device is gone.
    pub fn read(&self, bytes: &mut [u8]) -> Result<usize, PortError> {
        match rustix::io::read(&self.file, bytes) {
            // A terminal ends when its line does.
            Ok(0) => Err(PortError::Gone(self.path.clone())),
            Ok(count) => Ok(count),
            Err(Errno::AGAIN | Errno::INTR) => Ok(0),
            Err(error) => Err(self.failed(error)),
        }
    }

    /// Writes as many bytes as fit, and removes them from `bytes`.
    ///
    /// # Errors
    /// When the device is gone.
    pub fn write(&self, bytes: &mut Vec<u8>) -> Result<(), PortError> {
        while !bytes.is_empty() {
            match rustix::io::write(&self.file, bytes) {
                Ok(count) => drop(bytes.drain(..count)),
                Err(Errno::AGAIN) => break,
                Err(Errno::INTR) => {}
                Err(error) => return Err(self.failed(error)),
            }
        }
        Ok(())
    }

    fn failed(&self, error: Errno) -> PortError {
        match error {
            Errno::IO | Errno::NXIO | Errno::NODEV | Errno::NOENT | Errno::BADF => {
                PortError::Gone(self.path.clone())
            }
            error => other(&self.path, error),
        }
    }
}

impl Drop for Port {
    fn drop(&mut self) {
        // It can fail when the device is gone, and then it does not matter.
        let _ = ioctl_tiocnxcl(&self.file);
    }
}

fn other(path: &Path, error: Errno) -> PortError {
    PortError::Other { path: path.into(), reason: std::io::Error::from(error).to_string() }
}
