//! Serial device: raw bytes at a speed, without ever waiting.
#![allow(unsafe_code, reason = "rustix has no safe call for the modem lines")]

use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::OwnedFd;
use rustix::fs::{FlockOperation, Mode, OFlags, flock, open};
use rustix::io::Errno;
use rustix::ioctl::{Opcode, Setter, ioctl};
use rustix::termios::{
    ControlModes, OptionalActions, QueueSelector, SpecialCodeIndex, ioctl_tiocexcl, ioctl_tiocnxcl, isatty,
    tcflush, tcgetattr, tcsetattr,
};

use crate::error::PortError;

/// Open serial device, which no other program can open meanwhile.
#[derive(Debug)]
pub struct SerialPort {
    file: OwnedFd,
    path: PathBuf,
}

impl SerialPort {
    /// Opens and flushes a device: 8 data bits, no parity, 1 stop bit.
    /// No flow control.
    ///
    /// # Errors
    /// Returns the remedy.
    pub fn open(path: &Path, baud: u32) -> Result<Self, PortError> {
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let file = open(path, flags, Mode::empty()).map_err(|error| PortError::opening(path, error))?;
        if !isatty(&file) {
            return Err(PortError::NotSerial(path.into()));
        }
        flock(&file, FlockOperation::NonBlockingLockExclusive).map_err(|error| match error {
            Errno::WOULDBLOCK => PortError::Busy(path.into()),
            error => PortError::other(path, error),
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

    /// Sets the line DTR, by which some devices switch their motor.
    /// A line without it ignores the request.
    pub fn set_data_terminal_ready(&self, is_ready: bool) {
        const SET: Opcode = libc::TIOCMBIS as Opcode;
        const CLEAR: Opcode = libc::TIOCMBIC as Opcode;
        // A pseudo-terminal has no such line and refuses, as does an adapter without it.
        if is_ready {
            // SAFETY: both calls read an `int` of bits, which `ioctl` borrows while it lasts.
            let _ = unsafe { ioctl(&self.file, Setter::<SET, libc::c_int>::new(libc::TIOCM_DTR)) };
        } else {
            // SAFETY: as above.
            let _ = unsafe { ioctl(&self.file, Setter::<CLEAR, libc::c_int>::new(libc::TIOCM_DTR)) };
        }
    }

    /// Waits until something can be read, or the time is up.
    ///
    /// # Errors
    /// When the device is gone.
    pub fn wait(&self, limit: Duration) -> Result<(), PortError> {
        wait(&self.file, limit).map_err(|error| self.failed(error))
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
        PortError::using(&self.path, error)
    }
}

impl Drop for SerialPort {
    fn drop(&mut self) {
        // It can fail when the device is gone, and then it does not matter.
        let _ = ioctl_tiocnxcl(&self.file);
    }
}

/// Waits until a file can be read, or the time is up.
pub(crate) fn wait(file: impl rustix::fd::AsFd, limit: Duration) -> Result<(), Errno> {
    let limit = Timespec { tv_sec: limit.as_secs().cast_signed(), tv_nsec: limit.subsec_nanos().into() };
    match poll(&mut [PollFd::new(&file, PollFlags::IN)], Some(&limit)) {
        Ok(_) | Err(Errno::INTR) => Ok(()),
        Err(error) => Err(error),
    }
}
