//! Emergency stop line of an agent: a datagram socket with its own thread.
//! It works from the start on, also when nothing else of the agent can be reached.
//!
//! A stop over it needs no free descriptor, thread, memory or connection of the agent. The socket lies beside the agent's
//! socket, as `<agent>.stop`, in the folder that only its user may enter. A datagram contains the reason, and another one
//! the answer.

use std::io::{Error, ErrorKind, Result};
use std::net::Shutdown;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

/// Longest reason, bytes; a longer one is cut.
const REASON: usize = 1024;

/// Polling interval for the agent's end, where nothing else reports it.
const POLL_PERIOD: Duration = Duration::from_millis(500);

/// Time limit of one exchange with a client, in both directions.
/// It holds for a client to receive the answer, and for the agent to receive a client.
const TIMEOUT: Duration = Duration::from_secs(1);

/// Answer to a stop request.
const STOPPED: &[u8] = b"stopped";

/// Stop line of an agent, which exists until this is dropped.
#[derive(Debug)]
pub struct StopLine {
    path: PathBuf,
    socket: Arc<UnixDatagram>,
    closed: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// Returns the path of the stop line that belongs to an agent's socket.
fn beside(socket: &Path) -> PathBuf {
    socket.with_extension("stop")
}

impl StopLine {
    /// Opens the stop line beside an agent's socket.
    /// `stop` stops the agent's actuators for a reason; it must not block.
    ///
    /// # Errors
    /// The socket can't be made, or there is no thread left.
    pub fn open(socket: &Path, stop: impl Fn(&str) + Send + 'static) -> Result<Self> {
        let path = beside(socket);
        match std::fs::remove_file(&path) {
            // The socket of a killed agent is replaced.
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let socket = Arc::new(UnixDatagram::bind(&path)?);
        socket.set_read_timeout(Some(POLL_PERIOD))?;
        socket.set_write_timeout(Some(TIMEOUT))?;
        let closed = Arc::new(AtomicBool::new(false));
        let (own, ends) = (Arc::clone(&socket), Arc::clone(&closed));
        let thread = Builder::new().name("stop line".into()).spawn(move || listen(&own, &ends, &stop))?;
        Ok(Self { path, socket, closed, thread: Some(thread) })
    }
}

impl Drop for StopLine {
    fn drop(&mut self) {
        self.closed.store(true, Ordering::Release);
        // It looks by itself where this does not end its waiting.
        let _ = self.socket.shutdown(Shutdown::Both);
        if let Some(thread) = self.thread.take() {
            // The called code does not panic.
            let _ = thread.join();
        }
        // Another process may have removed it already.
        let _ = std::fs::remove_file(&self.path);
    }
}

fn listen(socket: &UnixDatagram, closed: &AtomicBool, stop: &impl Fn(&str)) {
    let mut reason = [0; REASON];
    while !closed.load(Ordering::Acquire) {
        match socket.recv_from(&mut reason) {
            Ok((0, _)) => std::thread::sleep(Duration::from_millis(1)),
            Ok((length, from)) => {
                stop(&String::from_utf8_lossy(&reason[..length]));
                if let Some(path) = from.as_pathname() {
                    // A client that has left needs no answer.
                    let _ = socket.send_to(STOPPED, path);
                }
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {}
            Err(_) => std::thread::sleep(Duration::from_millis(10)),
        }
    }
}

/// Returns true if an agent listens at its stop line.
/// The check does not disturb the agent, however busy it is.
pub fn is_there(socket: &Path) -> bool {
    UnixDatagram::unbound().is_ok_and(|own| own.connect(beside(socket)).is_ok())
}

/// Stops an agent's actuators over its stop line.
/// Returns when they have stopped, or after `patience`.
///
/// # Errors
/// No agent listens (`NotFound` or `ConnectionRefused`), or the stop is not confirmed.
pub fn stop(socket: &Path, reason: &str, timeout: Duration) -> Result<()> {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let line = beside(socket);
    let folder = line.parent().ok_or(ErrorKind::NotFound)?;
    let number = COUNT.fetch_add(1, Ordering::Relaxed);
    // Short, as the path of a socket can't be long.
    let own = Answering(folder.join(format!(".{}.{number}", std::process::id())));
    let _ = std::fs::remove_file(&own.0);
    let answers = UnixDatagram::bind(&own.0)?;
    answers.connect(&line)?;
    answers.set_write_timeout(Some(TIMEOUT))?;
    answers.set_read_timeout(Some(timeout))?;
    let reason = &reason.as_bytes()[..reason.floor_char_boundary(REASON.min(reason.len()))];
    answers.send(if reason.is_empty() { b"by a tool" } else { reason })?;
    let mut answer = [0; STOPPED.len()];
    let length = answers.recv(&mut answer)?;
    if &answer[..length] == STOPPED { Ok(()) } else { Err(Error::from(ErrorKind::InvalidData)) }
}

/// Socket of a client that waits for an answer.
struct Answering(PathBuf);

impl Drop for Answering {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}
