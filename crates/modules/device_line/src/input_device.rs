//! Input device, such as a joystick, which is only read.

use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::fd::OwnedFd;
use rustix::fs::{FileType, Mode, OFlags, fstat, open};
use rustix::io::Errno;

use crate::error::PortError;
use crate::serial_port::wait;

/// Open input device; other programs may read it, too.
#[derive(Debug)]
pub(crate) struct InputDevice {
    file: OwnedFd,
    path: PathBuf,
}

impl InputDevice {
    pub fn open(path: &Path) -> Result<Self, PortError> {
        let flags = OFlags::RDONLY | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let file = open(path, flags, Mode::empty()).map_err(|error| PortError::opening(path, error))?;
        let status = fstat(&file).map_err(|error| PortError::using(path, error))?;
        if FileType::from_raw_mode(status.st_mode) != FileType::CharacterDevice {
            return Err(PortError::Other { path: path.into(), reason: "it is not an input device".into() });
        }
        Ok(Self { file, path: path.into() })
    }

    pub fn wait(&self, limit: Duration) -> Result<(), PortError> {
        wait(&self.file, limit).map_err(|error| PortError::using(&self.path, error))
    }

    pub fn read(&self, bytes: &mut [u8]) -> Result<usize, PortError> {
        match rustix::io::read(&self.file, bytes) {
            Ok(0) => Err(PortError::Gone(self.path.clone())),
            Ok(count) => Ok(count),
            Err(Errno::AGAIN | Errno::INTR) => Ok(0),
            Err(error) => Err(PortError::using(&self.path, error)),
        }
    }
}
