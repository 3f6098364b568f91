//! Shadow: new code beside the old, with the same steps on the same inputs.
//! It runs in a thread of its own, and its outputs are compared and dropped. So the module is never affected.

mod follower;
mod snapshot;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread::JoinHandle;
use std::time::Duration;

use crossbeam_queue::ArrayQueue;
use slate_blackboard::channel::Writer;
use slate_blackboard::interface::Text;
use slate_blackboard::wake::Wake;
use slate_module::{Description, Frame, PortSlot, Random, interface};

use super::Retired;
use crate::log::ModuleLog;
use follower::Follower;
use snapshot::{Snapshot, port_shapes};

/// Comparison of new code with the old, as the property `/module/shadow`.
#[interface]
pub struct ShadowState {
    /// Steps made.
    pub ticks: u64,
    /// Steps in which it wrote something else.
    pub differences: u64,
    /// Number of steps missed because the new code was too slow.
    /// From then on its state may differ.
    pub skipped: u64,
    /// Steps in which it panicked.
    pub panics: u64,
    /// First step of the module with a difference; 0 for none.
    pub first_difference: u64,
    /// Port with that difference.
    pub port: Text<60>,
}

/// Steps that the new code may lag behind.
const STEP_LAG_LIMIT: usize = 16;

/// Shadow, at the side of the tick.
pub struct Shadow {
    shared: Arc<ShadowExchange>,
    current: Option<Box<Snapshot>>,
    thread: JoinHandle<()>,
}

struct ShadowExchange {
    free: ArrayQueue<Box<Snapshot>>,
    filled: ArrayQueue<Box<Snapshot>>,
    wake: Wake,
    stop: AtomicBool,
    skipped: AtomicU64,
    panics: AtomicU64,
    /// New code; the thread holds it during each call, and the tick never waits for it.
    new: Mutex<Option<ShadowCode>>,
}

/// New code.
struct ShadowCode {
    code: Retired,
    /// Initial state, until it was restored.
    state: Option<Vec<u8>>,
}

impl ShadowExchange {
    fn locked(&self) -> MutexGuard<'_, Option<ShadowCode>> {
        self.new.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Locks the new code; `None` while it is in a call.
    fn try_locked(&self) -> Option<MutexGuard<'_, Option<ShadowCode>>> {
        match self.new.try_lock() {
            Ok(new) => Some(new),
            Err(TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => None,
        }
    }
}

impl Shadow {
    /// Starts the thread of the new code.
    ///
    /// # Errors
    /// When it can't be started.
    pub fn start(
        name: &str,
        description: &Description,
        new: Retired,
        writer: Writer,
        log: Box<ModuleLog>,
    ) -> std::io::Result<Self> {
        let params = description.params.size;
        let ports = port_shapes(description);
        let shared = Arc::new(ShadowExchange {
            free: ArrayQueue::new(STEP_LAG_LIMIT),
            filled: ArrayQueue::new(STEP_LAG_LIMIT),
            wake: Wake::new(),
            stop: AtomicBool::new(false),
            skipped: AtomicU64::new(0),
            panics: AtomicU64::new(0),
            new: Mutex::new(Some(ShadowCode { code: new, state: None })),
        });
        for _ in 0..STEP_LAG_LIMIT {
            // The capacity suffices.
            let _ = shared.free.push(Box::new(Snapshot::new(&ports, params)));
        }
        let follower = Follower { ports, params, writer, log, shared: Arc::clone(&shared) };
        let thread =
            std::thread::Builder::new().name(format!("{name}/shadow")).spawn(move || follower.follow())?;
        Ok(Self { shared, current: None, thread })
    }

    /// Sets the initial state of the new code, which it restores in its own thread.
    pub fn begin_with(&self, state: Vec<u8>) {
        // It has no steps yet, so the lock is free soon.
        if let Some(new) = &mut *self.shared.locked() {
            new.state = Some(state);
        }
        self.shared.wake.notify(1);
    }

    /// Records the inputs of a step of the old code.
    pub fn before(&mut self, frame: &Frame, slots: &[PortSlot], random: Random) {
        if self.current.is_some() {
            // The last step came too late and wrote nothing.
            self.shared.skipped.fetch_add(1, Ordering::Relaxed);
        }
        let Some(mut snapshot) = self.current.take().or_else(|| self.shared.free.pop()) else {
            self.shared.skipped.fetch_add(1, Ordering::Relaxed);
            return;
        };
        snapshot.copy_inputs(frame, slots, random);
        self.current = Some(snapshot);
    }

    /// Records the outputs of the old code's step, and starts the new code's.
    pub fn after(&mut self, slots: &[PortSlot]) {
        if let Some(mut snapshot) = self.current.take() {
            snapshot.copy_outputs(slots);
            // The capacity is the number of ports.
            let _ = self.shared.filled.push(snapshot);
            self.shared.wake.notify(1);
        }
    }

    /// Returns the number of panics of the new code.
    pub fn panics(&self) -> u64 {
        self.shared.panics.load(Ordering::Relaxed)
    }

    /// Returns true if the new code has made all steps of the old, and is in no call.
    pub fn has_caught_up(&self) -> bool {
        let out = STEP_LAG_LIMIT - usize::from(self.current.is_some());
        self.shared.free.len() == out
            && self.shared.try_locked().is_some_and(|new| new.as_ref().is_some_and(|new| new.state.is_none()))
    }

    /// Takes the new code out.
    /// It must have [caught up](Shadow::has_caught_up): then no thread holds it for long.
    pub fn take_new(&self) -> Option<Retired> {
        self.shared.locked().take().map(|new| new.code)
    }

    /// Ends the new code's steps, with a wait of at most `limit`.
    /// A thread that hangs keeps its resources.
    pub fn end(self, limit: Duration) {
        self.stop();
        let mut waited = Duration::ZERO;
        while !self.thread.is_finished() && waited < limit {
            std::thread::sleep(END_POLL_PERIOD);
            waited += END_POLL_PERIOD;
        }
    }

    fn stop(&self) {
        self.shared.stop.store(true, Ordering::Release);
        self.shared.wake.notify(1);
    }
}

/// Interval at which the end of the thread is polled.
const END_POLL_PERIOD: Duration = Duration::from_millis(1);

impl Drop for Shadow {
    fn drop(&mut self) {
        self.stop();
    }
}
