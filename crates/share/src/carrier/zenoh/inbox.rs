use std::collections::VecDeque;
use std::io;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Bytes that wait for the thread that receives: what a few sessions have under way at once.
const BYTES: usize = 4 << 20;

/// Packets that wait.
const PACKETS: usize = 4096;

/// The packets of a link that came and were not taken. Zenoh's threads put them in and never wait: what does not fit is
/// dropped, and the sessions send it again.
#[derive(Debug, Default)]
pub(super) struct ZenohInbox {
    waiting: Mutex<WaitingPackets>,
    changed: Condvar,
}

/// One after the other in memory that is used again.
#[derive(Debug, Default)]
struct WaitingPackets {
    lengths: VecDeque<usize>,
    bytes: VecDeque<u8>,
    closed: Option<&'static str>,
}

impl ZenohInbox {
    fn waiting(&self) -> MutexGuard<'_, WaitingPackets> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts a packet in that consists of these slices.
    pub fn put<'a>(&self, length: usize, slices: impl Iterator<Item = &'a [u8]>) {
        let mut waiting = self.waiting();
        if waiting.lengths.len() == PACKETS || waiting.bytes.len() + length > BYTES {
            return;
        }
        waiting.lengths.push_back(length);
        slices.for_each(|slice| waiting.bytes.extend(slice));
        drop(waiting);
        self.changed.notify_one();
    }

    /// Nothing more comes, for that reason; the first one stays.
    pub fn close(&self, reason: &'static str) {
        self.waiting().closed.get_or_insert(reason);
        self.changed.notify_all();
    }

    /// Why nothing more comes.
    pub fn closed(&self) -> io::Result<()> {
        self.waiting().closed.map_or(Ok(()), |reason| Err(closed(reason)))
    }

    /// Takes the next packet, as far as it fits; what came before the end is taken first.
    pub fn take(&self, packet: &mut [u8], limit: Duration) -> io::Result<Option<usize>> {
        let waits = |waiting: &mut WaitingPackets| waiting.lengths.is_empty() && waiting.closed.is_none();
        let (mut waiting, _) = self
            .changed
            .wait_timeout_while(self.waiting(), limit, waits)
            .unwrap_or_else(PoisonError::into_inner);
        let Some(length) = waiting.lengths.pop_front() else {
            return waiting.closed.map_or(Ok(None), |reason| Err(closed(reason)));
        };
        let mut taken = 0;
        let (head, tail) = waiting.bytes.as_slices();
        let head = &head[..head.len().min(length)];
        for slice in [head, &tail[..length - head.len()]] {
            let fits = slice.len().min(packet.len() - taken);
            packet[taken..taken + fits].copy_from_slice(&slice[..fits]);
            taken += fits;
        }
        waiting.bytes.drain(..length);
        Ok(Some(taken))
    }
}

fn closed(reason: &str) -> io::Error {
    io::Error::new(io::ErrorKind::ConnectionAborted, reason)
}
