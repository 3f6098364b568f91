use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
use std::time::Duration;

use slate_module::aspect::SEND_LIMIT;

use super::{ReceivedBytes, is_for_later};
use slate_engine::digest::Digest;

/// Time limit of connecting to each address of a name.
const TIMEOUT: Duration = Duration::from_secs(5);

/// Connection with its data to be sent.
pub(super) struct ModuleConnection {
    stream: TcpStream,
    other: SocketAddr,
    outgoing: VecDeque<u8>,
    /// Bytes of `outgoing` from this tick.
    fresh: usize,
    /// Reason of its end.
    ended: Option<String>,
    /// True if the module knows of its end.
    end_reported: bool,
    /// True if this tick closes it.
    is_requested: bool,
    closing: bool,
}

impl ModuleConnection {
    /// # Errors
    /// When it has ended already.
    pub fn new(stream: TcpStream) -> io::Result<Self> {
        stream.set_nonblocking(true)?;
        // A command must not wait for the next one.
        stream.set_nodelay(true)?;
        let other = stream.peer_addr()?;
        Ok(Self {
            stream,
            other,
            outgoing: VecDeque::new(),
            fresh: 0,
            ended: None,
            end_reported: false,
            is_requested: false,
            closing: false,
        })
    }

    pub fn other(&self) -> SocketAddr {
        self.other
    }

    pub fn send(&mut self, data: &[u8]) -> Result<(), String> {
        if self.ended.is_some() {
            return Err(self.end());
        }
        if self.outgoing.len() + data.len() > SEND_LIMIT {
            return Err(format!(
                "{} bytes wait to be sent to {} already, and at most {SEND_LIMIT} may",
                self.outgoing.len(),
                self.other
            ));
        }
        self.outgoing.extend(data);
        self.fresh += data.len();
        Ok(())
    }

    pub fn receive(&mut self, room: &mut [u8]) -> ReceivedBytes {
        if room.is_empty() {
            return ReceivedBytes::Nothing;
        }
        match self.stream.read(room) {
            Ok(0) => self.ended("closed by the other end".into()),
            Ok(length) => return ReceivedBytes::Bytes(length, None),
            Err(error) if is_for_later(&error) && self.ended.is_none() => return ReceivedBytes::Nothing,
            Err(error) => self.ended(error.to_string()),
        }
        ReceivedBytes::Refused(self.end())
    }

    fn ended(&mut self, reason: String) {
        let other = self.other;
        self.ended.get_or_insert_with(|| format!("the connection with {other} has ended: {reason}"));
    }

    /// Reports the reason of the end to the module.
    fn end(&mut self) -> String {
        self.end_reported = true;
        self.ended.clone().unwrap_or_default()
    }

    /// Closes it at the end of this tick.
    pub fn close(&mut self) {
        self.is_requested = true;
    }

    /// Sends as much as the other end accepts.
    /// False if the connection is closed and all data are sent.
    pub fn commit(&mut self, index: u32, digest: Option<&mut Digest>) -> bool {
        if self.fresh > 0 {
            let start = self.outgoing.len() - self.fresh;
            if let Some(digest) = digest {
                let (head, tail) = self.outgoing.as_slices();
                digest.add(index, &head[start.min(head.len())..]);
                digest.add(index, &tail[start.saturating_sub(head.len())..]);
            }
            self.fresh = 0;
        }
        self.closing |= std::mem::take(&mut self.is_requested);
        while !self.outgoing.is_empty() && self.ended.is_none() {
            match self.stream.write(self.outgoing.as_slices().0) {
                Ok(length) => drop(self.outgoing.drain(..length)),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) if is_for_later(&error) => break,
                Err(error) => self.ended(error.to_string()),
            }
        }
        !self.closing || !(self.outgoing.is_empty() || self.ended.is_some())
    }

    pub fn abandon(&mut self) {
        self.outgoing.truncate(self.outgoing.len() - self.fresh);
        (self.fresh, self.is_requested) = (0, false);
    }

    /// Reason of the end, once the module knows of it; no data follow.
    pub fn over(&self) -> Option<&str> {
        self.ended.as_deref().filter(|_| self.end_reported)
    }
}

/// Connection being made in a thread, as name lookup and connecting wait.
pub(super) struct Attempt(Receiver<io::Result<TcpStream>>);

impl Attempt {
    pub fn new(address: &str) -> Result<Self, String> {
        let (result, receiver) = sync_channel(1);
        let text = address.to_owned();
        let thread = std::thread::Builder::new().name("connect".into()).spawn(move || {
            // It is closed when no thread waits for it any more.
            let _ = result.send(connect(&text));
        });
        thread.map_err(|error| format!("{address} can't be connected to: {error}"))?;
        Ok(Self(receiver))
    }

    /// Connection or error; `None` while it is being made.
    pub fn result(&self) -> Option<io::Result<TcpStream>> {
        match self.0.try_recv() {
            Ok(result) => Some(result),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => Some(Err(io::ErrorKind::Other.into())),
        }
    }
}

fn connect(address: &str) -> io::Result<TcpStream> {
    let missing = format!("`{address}` has no IP address; check the host's name, or write its IP address");
    let mut last = io::Error::new(io::ErrorKind::NotFound, missing);
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, TIMEOUT) {
            Ok(stream) => return Ok(stream),
            Err(error) => last = error,
        }
    }
    Err(last)
}
