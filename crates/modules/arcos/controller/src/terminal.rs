//! A pseudo-terminal, of which a driver opens the other end.

use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::OwnedFd;
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

use crate::error::ControllerError;

/// The controller's end of the line.
#[derive(Debug)]
pub struct Terminal {
    file: OwnedFd,
    path: PathBuf,
    link: Option<PathBuf>,
}

impl Terminal {
    /// Opens one, and makes `link` lead to the end that is for the driver.
    ///
    /// # Errors
    /// When the system gives none, or the link can't be made.
    pub fn open(link: Option<&Path>) -> Result<Self, ControllerError> {
        let io = std::io::Error::from;
        let file = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).map_err(io)?;
        grantpt(&file).map_err(io)?;
        unlockpt(&file).map_err(io)?;
        rustix::io::ioctl_fionbio(&file, true).map_err(io)?;
        // A new one says back what it is told.
        let mut settings = tcgetattr(&file).map_err(io)?;
        settings.make_raw();
        tcsetattr(&file, OptionalActions::Now, &settings).map_err(io)?;
        let path =
            PathBuf::from(std::ffi::OsString::from_vec(ptsname(&file, Vec::new()).map_err(io)?.into_bytes()));
        if let Some(link) = link {
            let wrong = |error| ControllerError::Link { path: link.into(), error };
            if link.is_symlink() {
                std::fs::remove_file(link).map_err(wrong)?;
            }
            std::os::unix::fs::symlink(&path, link).map_err(wrong)?;
        }
        Ok(Self { file, path, link: link.map(Path::to_owned) })
    }

    /// Path for the driver.
    pub fn path(&self) -> &Path {
        self.link.as_deref().unwrap_or(&self.path)
    }

    /// Waits for bytes, at most so long.
    pub fn wait(&self, limit: Duration) {
        let time = Timespec { tv_sec: limit.as_secs().cast_signed(), tv_nsec: limit.subsec_nanos().into() };
        let mut files = [PollFd::new(&self.file, PollFlags::IN)];
        let _ = poll(&mut files, Some(&time));
        if files[0].revents().contains(PollFlags::HUP) {
            // While the other end is closed, `poll` does not wait.
            std::thread::sleep(limit);
        }
    }

    /// Reads what is there.
    pub fn read(&self, bytes: &mut [u8]) -> usize {
        rustix::io::read(&self.file, bytes).unwrap_or(0)
    }

    /// Writes what there is room for; what there is none for is lost, as on a line.
    pub fn write(&self, mut bytes: &[u8]) {
        while !bytes.is_empty() {
            match rustix::io::write(&self.file, bytes) {
                Ok(count) => bytes = &bytes[count..],
                Err(Errno::INTR) => {}
                Err(_) => return,
            }
        }
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // A newer terminal may have the link by now.
        if let Some(link) = &self.link
            && std::fs::read_link(link).is_ok_and(|path| path == self.path)
        {
            let _ = std::fs::remove_file(link);
        }
    }
}
