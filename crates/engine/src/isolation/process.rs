use std::io::{self, IoSlice};
use std::mem::MaybeUninit;
use std::os::fd::BorrowedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, ExitStatus};
use std::sync::Arc;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::net::{SendAncillaryBuffer, SendAncillaryMessage, SendFlags, sendmsg};
use slate_module::table::DONE;
use slate_module::{Refusal, decode, encode};

use super::child::ARENA_LIMIT;
use super::launcher::launch;
use super::wire::{Begin, Code, Topic, build, receive, send};

/// Timeout of the start of a process, and of the setup of a module.
const START_TIMEOUT: Duration = Duration::from_secs(10);
/// The same for an interpreter, which may import large packages.
const PYTHON_START_TIMEOUT: Duration = Duration::from_secs(60);

/// Timeout of a requested exit.
const EXIT_TIMEOUT: Duration = Duration::from_millis(500);

/// Description of a regular end, on request.
pub(super) const REGULAR_END: &str = "ended with exit code 0";

/// Sink for lines of the log: level and text.
pub(super) type Log<'a> = &'a mut dyn FnMut(i32, &[u8]);

/// Host's end of a process that runs a module.
#[derive(Debug)]
pub(super) struct Process {
    child: Child,
    start_timeout: Duration,
    stream: Arc<UnixStream>,
    /// Present timeout of the stream.
    timeout: Duration,
    /// Payload of the last answer.
    body: Vec<u8>,
    /// True once the process has said that it is of this build.
    is_same_build: bool,
    /// Description of the end; `None` while the process runs.
    end: Option<String>,
}

impl Process {
    /// Starts one that maps those arenas; returns where it has them.
    pub fn start(
        program: Option<&Path>,
        begin: &Begin,
        arenas: &[BorrowedFd<'_>],
    ) -> Result<(Self, Vec<usize>), Refusal> {
        let mut process = Self::launch(program, &begin.code)?;
        let addresses = process.begin(begin, arenas)?;
        Ok((process, addresses))
    }

    /// Starts an idle process for that code.
    pub fn launch(program: Option<&Path>, code: &Code) -> Result<Self, Refusal> {
        let (child, stream) = launch(program, code)
            .map_err(|error| Refusal(format!("its process can't be started: {error}")))?;
        let start_timeout = match code {
            Code::Linked | Code::Library(_) => START_TIMEOUT,
            Code::Python(_) => PYTHON_START_TIMEOUT,
        };
        let (stream, timeout) = (Arc::new(stream), Duration::ZERO);
        Ok(Self { child, start_timeout, stream, timeout, body: Vec::new(), is_same_build: false, end: None })
    }

    /// Returns the timeout of the start, and of the setup of a module.
    pub fn start_timeout(&self) -> Duration {
        self.start_timeout
    }

    /// Requests to open the code and to map the arenas; returns their addresses there.
    pub fn begin(&mut self, begin: &Begin, arenas: &[BorrowedFd<'_>]) -> Result<Vec<usize>, Refusal> {
        // It fails when the process has ended already, and then the first question says how.
        let passed = self.pass(arenas);
        let (own, begin) = (build(), encode(begin)?);
        let mut begun = self.request(Topic::Build, own.as_bytes(), self.start_timeout).map(drop);
        self.is_same_build = begun.is_ok();
        if begun.is_ok() {
            begun = self.request(Topic::Begin, &begin, self.start_timeout).map(drop);
        }
        if let Err(refusal) = begun {
            return Err(match self.end() {
                Some(end) => format!("its process {end} before it was ready").into(),
                None => passed.map_or_else(
                    |error| format!("its process can't be given its memory: {error}").into(),
                    |()| refusal,
                ),
            });
        }
        let addresses: Vec<u64> = decode(&self.body)?;
        if addresses.len() != arenas.len() {
            return Err("its process did not map its memory".into());
        }
        Ok(addresses.into_iter().map(|address| address as usize).collect())
    }

    /// Passes the arenas' files on, with a byte, as they can't go alone.
    fn pass(&self, arenas: &[BorrowedFd<'_>]) -> io::Result<()> {
        let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(ARENA_LIMIT))];
        let mut control = SendAncillaryBuffer::new(&mut space);
        if !arenas.is_empty() && !control.push(SendAncillaryMessage::ScmRights(arenas)) {
            return Err(io::ErrorKind::ArgumentListTooLong.into());
        }
        sendmsg(&self.stream, &[IoSlice::new(&[0])], &mut control, SendFlags::NOSIGNAL)?;
        Ok(())
    }

    /// Returns the connection to the process.
    pub fn stream(&self) -> Arc<UnixStream> {
        Arc::clone(&self.stream)
    }

    /// Returns true if the process was built as this program; known once it was begun.
    pub fn is_same_build(&self) -> bool {
        self.is_same_build
    }

    /// Returns the process id.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Returns the description of the end; `None` while the process runs.
    pub fn end(&self) -> Option<&str> {
        self.end.as_deref()
    }

    /// Sends a request and waits; returns the payload, or the reason of a refusal.
    pub fn request(&mut self, topic: Topic, body: &[u8], timeout: Duration) -> Result<&[u8], Refusal> {
        match self.call(topic, body, timeout, &mut |_, _| {}) {
            Some(DONE) => Ok(&self.body),
            Some(_) => Err(Refusal(String::from_utf8_lossy(&self.body).into_owned())),
            None => Err(Refusal(self.end.clone().unwrap_or_default())),
        }
    }

    /// Sends a request and waits; returns the code of the answer.
    /// `None` if the process has ended: by itself, or because it did not answer in time.
    pub fn call(&mut self, topic: Topic, body: &[u8], timeout: Duration, log: Log<'_>) -> Option<i32> {
        if self.end.is_some() {
            return None;
        }
        match self.converse(topic, body, timeout, log) {
            Ok(code) => Some(code),
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                self.kill(&format!("did not return within {timeout:?} and was ended"));
                None
            }
            Err(_) => {
                self.await_exit();
                None
            }
        }
    }

    #[allow(clippy::disallowed_methods, reason = "a hang is a matter of wall-clock time")]
    fn converse(&mut self, topic: Topic, body: &[u8], timeout: Duration, log: Log<'_>) -> io::Result<i32> {
        if self.timeout != timeout {
            let socket_timeout = Some(timeout.max(Duration::from_micros(1)));
            self.stream.set_read_timeout(socket_timeout)?;
            self.stream.set_write_timeout(socket_timeout)?;
            self.timeout = timeout;
        }
        send(&self.stream, topic, 0, body)?;
        let start = Instant::now();
        loop {
            let (topic, code) = receive(&self.stream, &mut self.body)?;
            match topic {
                Topic::Answer => return Ok(code),
                Topic::Log => log(code, &self.body),
                _ => return Err(io::ErrorKind::InvalidData.into()),
            }
            if start.elapsed() > timeout {
                return Err(io::ErrorKind::TimedOut.into());
            }
        }
    }

    /// Returns true while the process runs; the check costs a system call.
    pub fn is_alive(&mut self) -> bool {
        if self.end.is_some() {
            return false;
        }
        let mut fds = [PollFd::new(&self.stream, PollFlags::empty())];
        let events = poll(&mut fds, Some(&Timespec { tv_sec: 0, tv_nsec: 0 }));
        if events.is_ok_and(|count| count > 0) {
            self.await_exit();
        }
        self.end.is_none()
    }

    /// Kills the process; `reason` describes its end.
    pub fn kill(&mut self, reason: &str) {
        if self.end.is_none() {
            // It fails when the process has just ended by itself.
            let _ = self.child.kill();
            let _ = self.child.wait();
            self.end = Some(reason.to_owned());
        }
    }

    /// Waits for a requested end of the process; kills it after the timeout.
    pub fn finish(&mut self) {
        if self.end.is_none() {
            self.await_exit();
        }
    }

    /// Handles a closed stream: the process is about to end, or misbehaves.
    #[allow(clippy::disallowed_methods, reason = "what ends in the system is a matter of wall-clock time")]
    fn await_exit(&mut self) {
        let start = Instant::now();
        while start.elapsed() < EXIT_TIMEOUT {
            match self.child.try_wait() {
                Ok(Some(status)) => {
                    self.end = Some(describe(status));
                    return;
                }
                Ok(None) => std::thread::sleep(Duration::from_micros(50)),
                Err(_) => break,
            }
        }
        self.kill("closed its connection and was ended");
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.kill("was not needed any more");
    }
}

/// Describes the end of a process.
/// Such as `ended with exit code 0` or `ended by signal 9 (killed)`.
pub fn describe(status: ExitStatus) -> String {
    let Some(signal) = status.signal() else {
        return format!("ended with exit code {}", status.code().unwrap_or_default());
    };
    let name = match signal {
        4 => "illegal instruction",
        6 => "abort",
        7 => "bus error",
        8 => "arithmetic fault",
        9 => "killed",
        11 => "segmentation fault",
        15 => "terminated",
        31 => "forbidden system call",
        _ => "a signal",
    };
    format!("ended by signal {signal} ({name})")
}
