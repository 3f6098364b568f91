//! Thread of a module, and its access to the host.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::{Duration, Instant};

use slate_blackboard::wake::Wake;
use slate_module::aspect::{ABSENT, FULL, Stop, ThreadBody, ThreadState};
use slate_module::table::{Bytes, DONE, PANICKED, REFUSED, Sink};
use slate_module::{Level, ModuleKind};
use slate_sorted::SortedMap;

use super::super::calls::{say, text};
use super::ring::{RingInlet, RingOutlet};
use slate_engine::clock::Clock;
use slate_engine::log::ModuleLog;
use slate_engine::synchronization::{Count, Emitter, Synchronization};

/// Notifications of a thread.
const STOP: u64 = 1;
const NEWS: u64 = 2;

/// Polling interval for a stop while a thread waits for a synchronization point.
const POLL_PERIOD: Duration = Duration::from_millis(10);

/// Thread as its module and its owner see it.
pub(super) struct ModuleThread {
    pub name: Arc<str>,
    state: AtomicU32,
    stop: AtomicBool,
    wake: Wake,
}

impl ModuleThread {
    pub fn new(name: &str) -> Arc<Self> {
        Arc::new(Self {
            name: name.into(),
            state: AtomicU32::new(ThreadState::Running as u32),
            stop: AtomicBool::new(false),
            wake: Wake::new(),
        })
    }

    /// Returns the state, a [`ThreadState`].
    pub fn state(&self) -> u32 {
        self.state.load(Ordering::Acquire)
    }

    pub fn is_running(&self) -> bool {
        self.state() == ThreadState::Running as u32
    }

    pub fn set(&self, state: ThreadState) {
        self.state.store(state as u32, Ordering::Release);
    }

    /// Requests the thread to stop.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Release);
        self.wake.notify(STOP);
    }

    /// Notifies the thread that the tick has sent values.
    pub fn request_stop(&self) {
        self.wake.notify(NEWS);
    }

    fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Acquire)
    }
}

/// Body of a thread; its own code drops it if it has never begun.
pub(super) struct OwnedBody(Option<ThreadBody>);

// SAFETY: a body is `Send`, as the module's side demands.
unsafe impl Send for OwnedBody {}

impl OwnedBody {
    /// # Safety
    /// The body is not used elsewhere, and its code stays as long as this.
    pub unsafe fn new(body: ThreadBody) -> Self {
        Self(Some(body))
    }

    fn run(mut self, stop: &Stop) -> i32 {
        // SAFETY: the body is used once, and its code is there, as `new` requires.
        self.0.take().map_or(DONE, |body| unsafe { (body.run)(body.data, stop) })
    }
}

impl Drop for OwnedBody {
    fn drop(&mut self) {
        if let Some(body) = self.0.take() {
            // SAFETY: as above.
            unsafe { (body.discard)(body.data) }
        }
    }
}

/// Parts of a thread.
/// The fields are dropped in this order, so the code goes last.
pub(super) struct ThreadParts {
    pub thread: Arc<ModuleThread>,
    pub body: OwnedBody,
    pub inlet: RingInlet,
    pub outlet: RingOutlet,
    pub log: Option<Box<ModuleLog>>,
    pub clock: Arc<Clock>,
    pub synchronization: Arc<Synchronization>,
    pub module: Arc<str>,
    /// Module kind, which keeps the library open.
    pub kind: ModuleKind,
}

/// State of the calls of a [`Stop`].
struct StopContext {
    thread: Arc<ModuleThread>,
    inlet: RingInlet,
    outlet: RingOutlet,
    log: Option<Box<ModuleLog>>,
    clock: Arc<Clock>,
    synchronization: Arc<Synchronization>,
    module: Arc<str>,
    emitters: SortedMap<String, Emitter>,
}

impl ThreadParts {
    /// Runs the thread's body, in the thread.
    pub fn live(self: Box<Self>) {
        let Self { thread, body, inlet, outlet, log, clock, synchronization, module, kind } = *self;
        let mut side = StopContext {
            thread: Arc::clone(&thread),
            inlet,
            outlet,
            log,
            clock,
            synchronization,
            module,
            emitters: SortedMap::new(),
        };
        let context = (&raw mut side).cast();
        // SAFETY: the context is this thread's side, which outlives the table; these are its calls.
        let stop = unsafe { Stop::new(context, is_set, wait, now, write, send, receive, emit, wait_for) };
        let code = body.run(&stop);
        drop(side);
        // The library may go now.
        drop(kind);
        thread.set(if code == PANICKED { ThreadState::Panicked } else { ThreadState::Ended });
    }
}

/// # Safety
/// The context is the side of the thread that calls, which uses it in one call at a time.
unsafe fn side<'a>(context: *mut ()) -> &'a mut StopContext {
    // SAFETY: passed on to the caller.
    unsafe { &mut *context.cast::<StopContext>() }
}

unsafe extern "C" fn is_set(context: *mut ()) -> i32 {
    // SAFETY: the host made the context.
    unsafe { side(context) }.thread.is_stopped().into()
}

#[allow(clippy::disallowed_methods, reason = "a thread sleeps on the wall clock")]
unsafe extern "C" fn wait(context: *mut (), nanoseconds: u64) -> i32 {
    // SAFETY: as for `is_set`.
    let thread = &unsafe { side(context) }.thread;
    let (start, limit) = (Instant::now(), Duration::from_nanos(nanoseconds));
    loop {
        if thread.is_stopped() {
            return 0;
        }
        let left = limit.saturating_sub(start.elapsed());
        if left.is_zero() || thread.wake.wait_timeout(left) & NEWS != 0 {
            return i32::from(!thread.is_stopped());
        }
    }
}

unsafe extern "C" fn now(context: *mut ()) -> u64 {
    // SAFETY: as for `is_set`.
    unsafe { side(context) }.clock.now()
}

unsafe extern "C" fn write(context: *mut (), level: u32, line: Bytes) {
    // SAFETY: as for `is_set`, and the text lives during the call.
    let (side, line) = unsafe { (side(context), text(line)) };
    if let Some(log) = &side.log {
        log.write(Level::from_number(level), &line);
    }
}

unsafe extern "C" fn send(context: *mut (), schema: u64, value: Bytes, sink: *const Sink) -> i32 {
    // SAFETY: as for `is_set`, and the value and the sink live during the call.
    let (inlet, value) = unsafe { (&mut side(context).inlet, value.as_slice()) };
    let added = inlet.add(schema, value);
    inlet.send();
    // SAFETY: as above.
    unsafe { answer(added, FULL, sink) }
}

unsafe extern "C" fn receive(
    context: *mut (),
    schema: u64,
    value: *mut u8,
    size: usize,
    sink: *const Sink,
) -> i32 {
    // SAFETY: as for `is_set`, and there is room for a value of that size.
    let (outlet, value) = unsafe { (&mut side(context).outlet, room(value, size)) };
    outlet.collect();
    // SAFETY: the sink lives during the call.
    unsafe { answer(outlet.take(schema, value), ABSENT, sink) }
}

/// Returns memory that a module lends for a value.
///
/// # Safety
/// It has that size, and no other code uses it during the call.
pub(super) unsafe fn room<'a>(value: *mut u8, size: usize) -> &'a mut [u8] {
    // SAFETY: passed on to the caller; the bytes are written before anybody else sees them.
    unsafe {
        value.write_bytes(0, size);
        std::slice::from_raw_parts_mut(value, size)
    }
}

/// Returns the code of a result, and writes the reason of a refusal.
///
/// # Safety
/// The sink is as the module made it.
pub(super) unsafe fn answer(result: Result<bool, String>, otherwise: i32, sink: *const Sink) -> i32 {
    match result {
        Ok(true) => DONE,
        Ok(false) => otherwise,
        Err(reason) => {
            // SAFETY: passed on to the caller.
            unsafe { say(sink, &reason) };
            REFUSED
        }
    }
}

unsafe extern "C" fn emit(context: *mut (), point: Bytes, sink: *const Sink) -> i32 {
    // SAFETY: as for `is_set`, and the name lives during the call.
    let (side, point) = unsafe { (side(context), text(point)) };
    if !side.emitters.contains_key(&point) {
        match side.synchronization.emitter(&point, &side.module) {
            Ok(emitter) => {
                side.emitters.insert(point.clone(), emitter);
            }
            // SAFETY: the sink lives during the call.
            Err(error) => return unsafe { answer(Err(error.to_string()), DONE, sink) },
        }
    }
    if let Some(emitter) = side.emitters.get(&point) {
        emitter.emit();
    }
    DONE
}

#[allow(clippy::disallowed_methods, reason = "a thread sleeps on the wall clock")]
unsafe extern "C" fn wait_for(
    context: *mut (),
    point: Bytes,
    since: u64,
    nanoseconds: u64,
    count: *mut u64,
    sink: *const Sink,
) -> i32 {
    // SAFETY: as for `is_set`, and the name lives during the call.
    let (side, point) = unsafe { (side(context), text(point)) };
    let point = match side.synchronization.point(&point) {
        Ok(point) => point,
        // SAFETY: the sink lives during the call.
        Err(error) => return unsafe { answer(Err(error.to_string()), DONE, sink) },
    };
    let (start, limit) = (Instant::now(), Duration::from_nanos(nanoseconds));
    while !side.thread.is_stopped() {
        let left = limit.saturating_sub(start.elapsed());
        if let Ok(now) = point.wait(Count::new(since), left.min(POLL_PERIOD)) {
            // SAFETY: the place of the count lives during the call.
            unsafe { count.write(now.get()) };
            return DONE;
        }
        if left.is_zero() {
            break;
        }
    }
    ABSENT
}
