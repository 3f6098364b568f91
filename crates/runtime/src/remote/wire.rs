//! What carries calls to an agent, and its answers back.

use std::fmt;
use std::io::{BufReader, Error, ErrorKind, Result, Write};
use std::os::unix::net::UnixStream;
use std::time::Duration;

use super::line::{self, Line};

/// How long an agent may take to take a call.
const PATIENCE: Duration = Duration::from_secs(60);

/// The longest answer, bytes: a tool trusts its agent more than the agent its tools.
const ANSWER_LIMIT: usize = 1 << 28;

/// A connection to an agent that carries messages, each of them one JSON value; see [`Client::over`](super::Client::over).
pub trait Wire: fmt::Debug + Send {
    /// Sends a call.
    ///
    /// # Errors
    /// When the connection is lost.
    fn send(&mut self, message: &str) -> Result<()>;

    /// The next message of the agent, which is waited for so long at most.
    ///
    /// # Errors
    /// [`UnexpectedEof`](ErrorKind::UnexpectedEof) when the agent has closed the connection, [`TimedOut`](ErrorKind::TimedOut)
    /// when nothing came in time, [`InvalidData`](ErrorKind::InvalidData) when it is no message.
    fn receive(&mut self, within: Duration) -> Result<Vec<u8>>;
}

/// The agent's socket, with a message a line.
#[derive(Debug)]
pub(super) struct LocalWire {
    stream: UnixStream,
    reader: BufReader<UnixStream>,
}

impl LocalWire {
    pub fn new(stream: UnixStream) -> Result<Self> {
        stream.set_write_timeout(Some(PATIENCE))?;
        let reader = BufReader::new(stream.try_clone()?);
        Ok(Self { stream, reader })
    }
}

impl Wire for LocalWire {
    fn send(&mut self, message: &str) -> Result<()> {
        self.stream.write_all(format!("{message}\n").as_bytes())
    }

    fn receive(&mut self, within: Duration) -> Result<Vec<u8>> {
        self.stream.set_read_timeout(Some(within))?;
        match line::read(&mut self.reader, ANSWER_LIMIT) {
            Ok(Line::Whole(line)) => Ok(line),
            Ok(Line::TooLong) => {
                Err(Error::new(ErrorKind::InvalidData, format!("more than {ANSWER_LIMIT} bytes in a line")))
            }
            Ok(Line::End) => Err(Error::new(ErrorKind::UnexpectedEof, "it has closed the connection")),
            // It has either name.
            Err(error) if error.kind() == ErrorKind::WouldBlock => Err(ErrorKind::TimedOut.into()),
            Err(error) => Err(error),
        }
    }
}
