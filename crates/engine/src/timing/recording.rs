use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use super::recorder::{Recorded, Recorder};
use super::switch::Lease;
use crate::clock::{Clock, monotonic};

/// Period of draining the rings.
/// The ring of a module holds 4096 spans, which at a step in 5 us, faster than any robot's, are 20 ms: a thread that
/// the system lets wait for some of them still loses nothing.
const DRAIN_PERIOD: Duration = Duration::from_millis(5);

/// Minimum pause between two drains, also with a slow writer.
/// So a thread that requests the summary gets the lock.
const SHORTEST_PAUSE: Duration = Duration::from_millis(1);

/// Recording in progress, from [`AgentTrace::record`].
/// A thread of its own writes the spans of modules and main loop, which never wait for it. Dropped, it ends without an
/// end of the file.
///
/// [`AgentTrace::record`]: crate::main_loop::AgentTrace::record
#[derive(Debug)]
pub struct Recording<W: Write> {
    clock: Arc<Clock>,
    state: Arc<Mutex<RecordingState<W>>>,
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Debug)]
enum RecordingState<W: Write> {
    Records { recorder: Recorder<W>, _lease: Lease },
    Failed(io::Error),
    Taken,
}

impl<W: Write + Send + 'static> Recording<W> {
    /// Starts the thread that drains the recorder.
    pub fn begin(recorder: Recorder<W>, lease: Lease, clock: Arc<Clock>) -> io::Result<Self> {
        let state = Arc::new(Mutex::new(RecordingState::Records { recorder, _lease: lease }));
        let is_over = Arc::new(AtomicBool::new(false));
        let (shared, over) = (Arc::clone(&state), Arc::clone(&is_over));
        let thread = Builder::new().name("trace".into()).spawn(move || {
            while !over.load(Ordering::Acquire) {
                let began = monotonic();
                if !lock(&shared).drain() {
                    return;
                }
                let took = Duration::from_nanos(monotonic().saturating_sub(began));
                std::thread::park_timeout(DRAIN_PERIOD.saturating_sub(took).max(SHORTEST_PAUSE));
            }
        })?;
        Ok(Self { clock, state, is_over, thread: Some(thread) })
    }
}

impl<W: Write> Recording<W> {
    /// Returns the summary so far.
    ///
    /// # Errors
    /// When the writer has failed, which has ended the recording.
    pub fn recorded(&self) -> io::Result<Recorded> {
        match &*lock(&self.state) {
            RecordingState::Records { recorder, .. } => {
                Ok(Recorded { to: self.now(), ..recorder.recorded().clone() })
            }
            RecordingState::Failed(error) => Err(io::Error::new(error.kind(), error.to_string())),
            RecordingState::Taken => Err(io::ErrorKind::NotConnected.into()),
        }
    }

    /// Ends the recording; returns its summary, and the flushed writer.
    ///
    /// # Errors
    /// Those of the writer, also from before.
    pub fn end(mut self) -> io::Result<(Recorded, W)> {
        let to = self.now();
        self.join();
        match std::mem::replace(&mut *lock(&self.state), RecordingState::Taken) {
            RecordingState::Records { recorder, .. } => recorder.end(to),
            RecordingState::Failed(error) => Err(error),
            RecordingState::Taken => Err(io::ErrorKind::NotConnected.into()),
        }
    }
}

impl<W: Write> Recording<W> {
    fn now(&self) -> u64 {
        self.clock.at(monotonic())
    }

    fn join(&mut self) {
        self.is_over.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            // When the writer has panicked, the state tells.
            let _ = thread.join();
        }
    }
}

impl<W: Write> Drop for Recording<W> {
    fn drop(&mut self) {
        self.join();
    }
}

impl<W: Write> RecordingState<W> {
    /// Drains the recorder; false once the recording has ended.
    fn drain(&mut self) -> bool {
        let Self::Records { recorder, .. } = self else { return false };
        match recorder.drain() {
            Ok(()) => true,
            Err(error) => {
                // The writer is dropped, and recording for it ends.
                *self = Self::Failed(error);
                false
            }
        }
    }
}

fn lock<W: Write>(mutex: &Mutex<RecordingState<W>>) -> MutexGuard<'_, RecordingState<W>> {
    mutex.lock().unwrap_or_else(|poisoned| {
        let mut state = poisoned.into_inner();
        *state = RecordingState::Failed(io::Error::other("the writer has panicked"));
        mutex.clear_poison();
        state
    })
}
