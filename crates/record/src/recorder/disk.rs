//! Writing of a file in a thread of its own.
//! A stalled disk therefore blocks no other thread.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::Builder;
use std::time::{Duration, Instant};

use super::lock::lock;

/// Maximum wait of a closing file for a stalled disk; less than tools wait.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(20);

/// The writing end. Bytes are handed over when they are flushed, and at the end.
pub(super) struct Disk {
    open: Vec<u8>,
    queue: Arc<DiskQueue>,
}

/// Queue of a disk.
#[derive(Debug, Default)]
pub(super) struct DiskQueue {
    /// Bytes that were written until now.
    bytes: AtomicU64,
    /// Bytes that were handed over until now.
    submitted: AtomicU64,
    /// Bytes that were handed over and are not on the disk yet.
    waiting: AtomicU64,
    state: Mutex<DiskState>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct DiskState {
    pieces: VecDeque<Vec<u8>>,
    /// Memory that can be used again.
    spare: Option<Vec<u8>>,
    /// Start of the disk's current operation.
    since: Option<Instant>,
    failure: Option<String>,
    is_closed: bool,
}

impl Disk {
    /// Starts the writing thread.
    /// It ends after the last piece, once this is dropped.
    pub fn start(writer: Box<dyn Write + Send>) -> io::Result<(Self, Arc<DiskQueue>)> {
        let queue = Arc::<DiskQueue>::default();
        let own = Arc::clone(&queue);
        Builder::new().name("record disk".into()).spawn(move || {
            slate_runtime::set_batch_scheduling();
            own.run_safely(writer);
        })?;
        Ok((Self { open: Vec::new(), queue: Arc::clone(&queue) }, queue))
    }

    fn hand_over(&mut self) -> io::Result<()> {
        let mut state = self.queue.state();
        if let Some(reason) = &state.failure {
            return Err(io::Error::other(reason.clone()));
        }
        if !self.open.is_empty() {
            let next = state.spare.take().unwrap_or_default();
            let piece = std::mem::replace(&mut self.open, next);
            self.queue.waiting.fetch_add(piece.len() as u64, Ordering::Release);
            self.queue.submitted.fetch_add(piece.len() as u64, Ordering::Release);
            state.pieces.push_back(piece);
            self.queue.changed.notify_all();
        }
        Ok(())
    }
}

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.open.extend_from_slice(bytes);
        self.queue.bytes.fetch_add(bytes.len() as u64, Ordering::Relaxed);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.hand_over()
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        // The queue keeps a failure for the closing of the file.
        let _ = self.hand_over();
        self.queue.state().is_closed = true;
        self.queue.changed.notify_all();
    }
}

impl DiskQueue {
    fn state(&self) -> MutexGuard<'_, DiskState> {
        lock(&self.state)
    }

    fn wait<'a>(&'a self, state: MutexGuard<'a, DiskState>, within: Duration) -> MutexGuard<'a, DiskState> {
        self.changed.wait_timeout(state, within).unwrap_or_else(PoisonError::into_inner).0
    }

    fn run_safely(&self, mut writer: Box<dyn Write + Send>) {
        let done = catch_unwind(AssertUnwindSafe(|| self.run(&mut writer)));
        if done.is_err() {
            self.fail("its writer has panicked".into());
            // It may panic again when it is closed.
            std::mem::forget(writer);
        }
    }

    #[allow(clippy::disallowed_methods, reason = "a disk stands still on the wall clock")]
    fn run(&self, writer: &mut dyn Write) {
        loop {
            let mut state = self.state();
            let piece = loop {
                match state.pieces.pop_front() {
                    Some(piece) => break piece,
                    None if state.is_closed => return,
                    None => state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner),
                }
            };
            state.since = Some(Instant::now());
            drop(state);
            if let Err(error) = writer.write_all(&piece).and_then(|()| writer.flush()) {
                return self.fail(error.to_string());
            }
            self.waiting.fetch_sub(piece.len() as u64, Ordering::Release);
            let mut state = self.state();
            state.since = None;
            state.spare = Some(piece).map(|mut piece| {
                piece.clear();
                piece
            });
            drop(state);
            self.changed.notify_all();
        }
    }

    fn fail(&self, reason: String) {
        let mut state = self.state();
        (state.failure, state.since) = (Some(reason), None);
        state.pieces.clear();
        self.waiting.store(0, Ordering::Release);
        drop(state);
        self.changed.notify_all();
    }

    /// Returns the number of bytes written until now, with those that wait.
    pub fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed)
    }

    /// Returns the number of bytes that wait.
    pub fn waiting(&self) -> u64 {
        self.waiting.load(Ordering::Acquire)
    }

    /// Returns the number of bytes handed over until now.
    pub fn submitted(&self) -> u64 {
        self.submitted.load(Ordering::Acquire)
    }

    /// Returns true if the operating system has the first `bytes` handed over.
    pub fn has(&self, bytes: u64) -> bool {
        self.submitted().saturating_sub(self.waiting()) >= bytes
    }

    /// Returns the reason why nothing can be written any more, if there is one.
    pub fn failure(&self) -> Option<String> {
        self.state().failure.clone()
    }

    /// Returns the time that the disk has spent on the current piece.
    pub fn stall_duration(&self) -> Duration {
        self.state().since.map_or(Duration::ZERO, |since| since.elapsed())
    }

    /// Waits until at most `most` bytes are queued.
    /// Gives up on a disk that takes none for `timeout`.
    ///
    /// # Errors
    /// Why it has not taken them.
    pub fn settle(&self, most: u64, timeout: Duration) -> Result<(), String> {
        let mut state = self.state();
        while self.waiting() > most {
            let still = state.since.map_or(Duration::ZERO, |since| since.elapsed());
            if still >= timeout {
                return Err(format!("the disk has accepted no data for {} s", still.as_secs()));
            }
            state = self.wait(state, timeout.saturating_sub(still));
        }
        state.failure.clone().map_or(Ok(()), Err)
    }

    /// Waits as [`settle`](DiskQueue::settle), with the default timeout.
    pub fn settle_in_time(&self, most: u64) -> Result<(), String> {
        self.settle(most, CLOSE_TIMEOUT)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that fails panics")]
mod tests {
    use std::sync::mpsc::{Receiver, channel};

    use super::*;

    /// Writer that takes a piece when permitted.
    struct Slow(Receiver<()>);

    impl Write for Slow {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.recv().map_err(io::Error::other)?;
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_stuck_disk_is_given_up_and_a_slow_one_is_waited_for() {
        let (go, may) = channel();
        let (mut disk, queue) = Disk::start(Box::new(Slow(may))).unwrap();
        for piece in 0..3 {
            disk.write_all(&[piece; 100]).unwrap();
            disk.flush().unwrap();
        }
        assert_eq!((queue.waiting(), queue.bytes()), (300, 300));
        let error = queue.settle(0, Duration::from_millis(50)).unwrap_err();
        assert!(error.contains("has accepted no data"), "{error}");
        assert!(queue.stall_duration() >= Duration::from_millis(50));
        go.send(()).unwrap();
        queue.settle(200, Duration::from_secs(10)).unwrap();
        (0..2).for_each(|_| go.send(()).unwrap());
        queue.settle(0, Duration::from_secs(10)).unwrap();
        assert_eq!(queue.stall_duration(), Duration::ZERO);
        // Unflushed data is written at the end, where errors are reported.
        disk.write_all(&[4; 100]).unwrap();
        drop((disk, go));
        assert!(queue.settle(0, Duration::from_secs(10)).is_err());
        assert!(queue.failure().is_some() && queue.waiting() == 0);
    }
}
