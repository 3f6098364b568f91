use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::time::Duration;

use slate_module::Level;

use super::{LogTarget, Record};

/// Log target for subscribers over TCP.
/// Each receives every line from its connection on, as JSON, one object a line.
///
/// A subscriber that reads too slowly, or not at all, loses lines and receives their number; it delays no other subscriber.
/// Every program that reaches the address can read the log, so it should be one of this machine or of a trusted network.
#[derive(Debug)]
pub struct RemoteTarget {
    listener: TcpListener,
    address: SocketAddr,
    subscribers: Vec<Subscriber>,
}

#[derive(Debug)]
struct Subscriber {
    stream: TcpStream,
    /// Bytes that the system has not accepted yet.
    waiting: VecDeque<u8>,
    /// Number of lines lost for this subscriber and not reported yet.
    lost: u64,
    /// Time of the last lost line, ns of the agent's time.
    lost_at: u64,
}

/// More subscribers are turned away.
const SUBSCRIBER_LIMIT: usize = 32;

/// Buffer for a slow subscriber, bytes; it may exceed this by one line.
const BUFFER_LIMIT: usize = 256 * 1024;

/// Maximum wait at the end for a subscriber that is behind.
const FINAL_WRITE_TIMEOUT: Duration = Duration::from_millis(50);

impl RemoteTarget {
    /// Listens at an address; port 0 is any that is free.
    ///
    /// # Errors
    /// When the address is not one of this machine, or is taken.
    pub fn bind(address: SocketAddr) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        Ok(Self { address: listener.local_addr()?, listener, subscribers: Vec::new() })
    }

    /// Returns the address on which it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Accepts new connections.
    /// They wait in the system until there is a line for them.
    fn accept(&mut self) {
        while let Ok((stream, _)) = self.listener.accept() {
            // One that is turned away sees the end of the stream.
            if self.subscribers.len() < SUBSCRIBER_LIMIT && stream.set_nonblocking(true).is_ok() {
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
        self.subscribers.iter_mut().for_each(Subscriber::report_lost);
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
        // Its data is ignored, but unread data would make the system discard the last lines at the end.
        let _ = self.stream.read(&mut [0; 1024]);
        self.flush()?;
        if self.waiting.len() > BUFFER_LIMIT {
            self.lost += 1;
            self.lost_at = time;
            return Ok(());
        }
        self.report_lost();
        self.waiting.extend(line.as_bytes());
        self.flush()
    }

    /// Tells how many lines were lost, if there is room again.
    fn report_lost(&mut self) {
        if self.lost > 0 && self.waiting.len() <= BUFFER_LIMIT {
            let text = "lines were lost, as this subscriber reads too slowly";
            let record = Record::new(self.lost_at, Level::Warn, &Arc::from("agent"), text);
            let record = Record { dropped: std::mem::take(&mut self.lost), ..record };
            self.waiting.extend(json(&record).as_bytes());
        }
    }

    /// Writes as much as the system accepts without waiting.
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
        let _ = self.stream.set_write_timeout(Some(FINAL_WRITE_TIMEOUT));
        let _ = self.stream.write(self.waiting.make_contiguous());
    }
}
