//! Pseudo-terminal, of which a driver opens the other end.

use std::os::unix::ffi::OsStringExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::OwnedFd;
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

/// Reason why no pseudo-terminal is available.
#[derive(Debug, thiserror::Error)]
pub enum TerminalError {
    /// The system has no free pseudo-terminal.
    #[error("no pseudo-terminal: {0}")]
    System(#[from] std::io::Error),
    /// The link can't be created.
    #[error("{}: {error}; expected a path where there is nothing, or an older link", .path.display())]
    Link {
        /// Expected path.
        path: PathBuf,
        /// Error of the system.
        error: std::io::Error,
    },
}

/// Device's end of a line.
#[derive(Debug)]
pub struct PseudoTerminal {
    file: OwnedFd,
    path: PathBuf,
    link: Option<PathBuf>,
}

impl PseudoTerminal {
    /// Opens a pseudo-terminal, and links `link` to the driver's end.
    ///
    /// # Errors
    /// When the system gives none, or the link can't be made.
    pub fn open(link: Option<&Path>) -> Result<Self, TerminalError> {
        let io = std::io::Error::from;
        let file = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).map_err(io)?;
        grantpt(&file).map_err(io)?;
        unlockpt(&file).map_err(io)?;
        rustix::io::ioctl_fionbio(&file, true).map_err(io)?;
        // A new terminal echoes its input.
        let mut settings = tcgetattr(&file).map_err(io)?;
        settings.make_raw();
        tcsetattr(&file, OptionalActions::Now, &settings).map_err(io)?;
        let path =
            PathBuf::from(std::ffi::OsString::from_vec(ptsname(&file, Vec::new()).map_err(io)?.into_bytes()));
        if let Some(link) = link {
            let wrong = |error| TerminalError::Link { path: link.into(), error };
            if link.is_symlink() {
                std::fs::remove_file(link).map_err(wrong)?;
            }
            std::os::unix::fs::symlink(&path, link).map_err(wrong)?;
        }
        Ok(Self { file, path, link: link.map(Path::to_owned) })
    }

    /// Returns the path for the driver.
    pub fn path(&self) -> &Path {
        self.link.as_deref().unwrap_or(&self.path)
    }

    /// Returns true if a program has the other end open.
    pub fn is_open(&self) -> bool {
        let mut files = [PollFd::new(&self.file, PollFlags::IN)];
        poll(&mut files, Some(&Timespec { tv_sec: 0, tv_nsec: 0 })).is_ok()
            && !files[0].revents().contains(PollFlags::HUP)
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

    /// Reads the available bytes.
    pub fn read(&self, bytes: &mut [u8]) -> usize {
        rustix::io::read(&self.file, bytes).unwrap_or(0)
    }

    /// Writes as many bytes as fit, and returns their number.
    /// On a real line the others are lost.
    pub fn write(&self, bytes: &[u8]) -> usize {
        let mut written = 0;
        while written < bytes.len() {
            match rustix::io::write(&self.file, &bytes[written..]) {
                Ok(count) => written += count,
                Err(Errno::INTR) => {}
                Err(_) => break,
            }
        }
        written
    }
}

impl Drop for PseudoTerminal {
    fn drop(&mut self) {
        // A newer terminal may have the link by now.
        if let Some(link) = &self.link
            && std::fs::read_link(link).is_ok_and(|path| path == self.path)
        {
            let _ = std::fs::remove_file(link);
        }
    }
}
