use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::time::Duration;

use slate_module::Level;

use super::{LogTarget, Record};

/// Subscribers over TCP: each gets every line from then on, as JSON, one object a line.
///
/// A subscriber that reads too slowly, or not at all, loses lines and is told how many; it holds nobody up. Whoever
/// can reach the address can read the log, so it should be one of this computer or of a network of friends.
#[derive(Debug)]
pub struct RemoteTarget {
    listener: TcpListener,
    address: SocketAddr,
    subscribers: Vec<Subscriber>,
}

#[derive(Debug)]
struct Subscriber {
    stream: TcpStream,
    /// What the system did not take yet.
    waiting: VecDeque<u8>,
    /// Lines that this subscriber lost and was not told of yet.
    lost: u64,
    /// When the last of them was logged, nanoseconds of the agent's time.
    lost_at: u64,
}

/// More subscribers are turned away.
const SUBSCRIBERS: usize = 32;

/// How much waits for a slow subscriber, bytes; a line comes on top.
const WAITING: usize = 256 * 1024;

/// How long the end waits for a subscriber that is behind.
const LAST_LINES: Duration = Duration::from_millis(50);

impl RemoteTarget {
    /// Listens at an address; port 0 is any that is free.
    ///
    /// # Errors
    /// When the address is not one of this computer, or is taken.
    pub fn bind(address: SocketAddr) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        Ok(Self { address: listener.local_addr()?, listener, subscribers: Vec::new() })
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Takes in who has come since: connections wait in the system until there is a line for them.
    fn accept(&mut self) {
        while let Ok((stream, _)) = self.listener.accept() {
            // One that is turned away sees the end of the stream.
            if self.subscribers.len() < SUBSCRIBERS && stream.set_nonblocking(true).is_ok() {
                self.subscribers.push(Subscriber { stream, waiting: VecDeque::new(), lost: 0, lost_at: 0 });
            }
        }
    }
}

impl LogTarget for RemoteTarget {
    fn write(&mut self, record: &Record) {
        self.accept();
        if self.subscribers.is_empty() {
            return;
        }
        let line = json(record);
        self.subscribers.retain_mut(|subscriber| subscriber.take(&line, record.time).is_ok());
    }

    fn idle(&mut self) -> bool {
        self.subscribers.retain_mut(|subscriber| subscriber.flush().is_ok());
        self.subscribers.iter_mut().for_each(Subscriber::tell);
        self.subscribers.iter().any(|subscriber| !subscriber.waiting.is_empty())
    }
}

fn json(record: &Record) -> String {
    // Text, numbers and maps with text as keys always have a JSON form.
    let mut line = serde_json::to_string(record).unwrap_or_default();
    line.push('\n');
    line
}

impl Subscriber {
    /// Takes a line, or counts it.
    ///
    /// # Errors
    /// When the subscriber is gone.
    fn take(&mut self, line: &str, time: u64) -> io::Result<()> {
        // What it says means nothing, but unread it would make the system throw away the last lines at the end.
        let _ = self.stream.read(&mut [0; 1024]);
        self.flush()?;
        if self.waiting.len() > WAITING {
            self.lost += 1;
            self.lost_at = time;
            return Ok(());
        }
        self.tell();
        self.waiting.extend(line.as_bytes());
        self.flush()
    }

    /// Tells how many lines were lost, if there is room again.
    fn tell(&mut self) {
        if self.lost > 0 && self.waiting.len() <= WAITING {
            let text = "lines were lost, as this subscriber reads too slowly";
            let record = Record::new(self.lost_at, Level::Warn, &Arc::from("agent"), text);
            let record = Record { dropped: std::mem::take(&mut self.lost), ..record };
            self.waiting.extend(json(&record).as_bytes());
        }
    }

    /// Gives the system what it takes without waiting.
    fn flush(&mut self) -> io::Result<()> {
        while !self.waiting.is_empty() {
            match self.stream.write(self.waiting.as_slices().0) {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(count) => drop(self.waiting.drain(..count)),
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}

impl Drop for Subscriber {
    fn drop(&mut self) {
        if self.waiting.is_empty() {
            return;
        }
        // One that is gone or still too slow has lost its last lines.
        let _ = self.stream.set_nonblocking(false);
        let _ = self.stream.set_write_timeout(Some(LAST_LINES));
        let _ = self.stream.write(self.waiting.make_contiguous());
    }
}
