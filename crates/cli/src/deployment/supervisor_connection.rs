//! Supervised side of an agent that was started together with others.

use std::io::{self, Read, Write};
use std::os::fd::AsFd;
use std::os::unix::net::UnixStream;

use rustix::process::{Signal, set_parent_process_death_signal};

use super::TIMEOUT;
use crate::failure::Failure;

/// Connection of an agent to its supervisor, on stdin.
pub struct SupervisorConnection(UnixStream);

impl SupervisorConnection {
    /// Takes it; from now on the agent ends when that process does.
    pub fn new() -> Result<Self, Failure> {
        let take = || -> io::Result<UnixStream> {
            set_parent_process_death_signal(Some(Signal::TERM))?;
            // Tools list it by the name of its file, and that was /proc/self/exe.
            rustix::thread::set_name(c"slate")?;
            let stream = UnixStream::from(io::stdin().as_fd().try_clone_to_owned()?);
            rustix::stdio::dup2_stdin(std::fs::File::open("/dev/null")?)?;
            Ok(stream)
        };
        let failed = |source| Failure::File { path: "standard input".into(), source };
        take().map(Self).map_err(failed)
    }

    /// Reports that this agent is ready, and waits for the others; false if one fails.
    pub fn wait(&mut self) -> bool {
        self.0.write_all(&[0]).and_then(|()| self.0.read_exact(&mut [0])).is_ok()
    }
}

/// Ends this process when it was asked to end and has not done so.
pub fn end_later() {
    let end = || {
        std::thread::sleep(TIMEOUT);
        std::process::exit(130);
    };
    // Without a thread for it, the supervisor does it.
    let _ = std::thread::Builder::new().name("end".into()).spawn(end);
}
