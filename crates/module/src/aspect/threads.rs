use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use slate_blackboard::interface::{Descriptor, Interface, View};

use super::blackboard::{ABSENT, call_with_sink};
use super::{Effect, HostedService, Service, call_table, service};
use crate::panics::{discard, panic_message};
use crate::table::{Bytes, DONE, PANICKED, Sink};
use crate::{Level, Refusal};

call_table! {
    /// Threads of the module, for blocking devices and long computations.
    /// A long computation is one that takes more than a cycle.
    ///
    /// The host makes each thread, gives it its name and the agent's time, and requests it to stop when its module is
    /// unloaded, exchanges its code, panics, or the agent ends. A thread that does not stop within the timeout `[loop]
    /// hang` keeps its module from being unloaded. Tick and thread pass values to each other through a bounded ring
    /// each way, without waiting for one another; a thread never sees ports, parameters or state.
    ///
    /// A thread is not part of the reproducible results of a run in lockstep; the log reports that when one starts
    /// there.
    ///
    /// ```
    /// use std::time::Duration;
    ///
    /// use slate_module::aspect::{Aspect, Stop, Threads};
    /// use slate_module::prelude::*;
    ///
    /// /// A distance.
    /// #[interface]
    /// pub struct Distance {
    ///     /// Meters.
    ///     #[unit("m")]
    ///     pub value: f64,
    /// }
    ///
    /// #[ports]
    /// pub struct Io {
    ///     threads: Aspect<Threads>,
    ///     distance: Output<Distance>,
    /// }
    ///
    /// /// Reads a range finder that answers when it likes.
    /// pub struct RangeFinder;
    ///
    /// #[module(stage = SensorAcquire)]
    /// impl Module for RangeFinder {
    ///     type Io = Io;
    ///     type Params = ();
    ///     type State = ();
    ///
    ///     fn tick(_: &mut (), io: &Io, _: &(), _: &Tick) -> Outcome {
    ///         if !io.threads.is_running("reader") {
    ///             let reader = |stop: &Stop| {
    ///                 while stop.wait(Duration::from_millis(10)) {
    ///                     let value = 1.5; // from the device
    ///                     // Without room the value is lost, and a newer one comes soon.
    ///                     let _ = stop.send(&Distance { value });
    ///                 }
    ///             };
    ///             if io.threads.spawn("reader", reader).is_err() {
    ///                 return Outcome::Failed;
    ///             }
    ///         }
    ///         while let Ok(Some(distance)) = io.threads.receive::<Distance>("reader") {
    ///             io.distance.set(distance);
    ///         }
    ///         Outcome::Ok
    ///     }
    /// }
    /// # fn main() {}
    /// ```
    pub struct Threads {
        /// Starts a thread of that name after the tick, with rings of a size in bytes.
        fn spawn(Bytes, usize, ThreadBody, *const Sink) -> i32;
        /// Returns a [`ThreadState`].
        fn state(Bytes) -> u32;
        /// Requests a thread to stop.
        fn stop(Bytes);
        /// Sends a value of that schema to a thread; [`FULL`] if there is no room.
        fn send(Bytes, u64, Bytes, *const Sink) -> i32;
        /// Receives a thread's next value, of that schema and size; [`ABSENT`] if none.
        fn receive(Bytes, u64, *mut u8, usize, *const Sink) -> i32;
    }
}

/// Lack of room at present.
pub const FULL: i32 = 4;

/// Size of a thread's rings by default, bytes.
const DEFAULT_RING_SIZE: usize = 64 * 1024;

// SAFETY: plain C data; the host gives each module a service of its own, which is used in the module's tick alone.
unsafe impl Service for Threads {
    const DESCRIPTOR: &'static Descriptor = &service::<Self>("threads 1", "Lets a module own threads.");
}

impl HostedService for Threads {
    const EFFECT: Effect = Effect::None;
}

/// Body of a thread, used once: either `run` is called, or `discard`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ThreadBody {
    /// Argument of the calls.
    pub data: *mut (),
    /// Runs the thread's body; 0, or -1 after a panic, which it has logged.
    pub run: unsafe extern "C" fn(*mut (), *const Stop) -> i32,
    /// Drops a body that never ran.
    pub discard: unsafe extern "C" fn(*mut ()),
}

impl ThreadBody {
    fn new<F: FnOnce(&Stop) + Send + 'static>(body: F) -> Self {
        unsafe extern "C" fn run<F: FnOnce(&Stop)>(data: *mut (), stop: *const Stop) -> i32 {
            // SAFETY: made from a box below and used once; the host keeps the stop during the call.
            let (body, stop) = unsafe { (Box::from_raw(data.cast::<F>()), &*stop) };
            let Err(payload) = catch_unwind(AssertUnwindSafe(move || body(stop))) else { return DONE };
            stop.error(format_args!("its thread {}", panic_message(payload.as_ref())));
            discard(payload);
            PANICKED
        }
        unsafe extern "C" fn end<F>(data: *mut ()) {
            // SAFETY: made from a box below, and dropped once.
            let body = unsafe { Box::from_raw(data.cast::<F>()) };
            if let Err(payload) = catch_unwind(AssertUnwindSafe(move || drop(body))) {
                discard(payload);
            }
        }
        Self { data: Box::into_raw(Box::new(body)).cast(), run: run::<F>, discard: end::<F> }
    }
}

/// State of a thread.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum ThreadState {
    /// None of that name was ever begun.
    Absent = 0,
    /// Running, or begins after this tick; a stop may have been requested.
    Running = 1,
    /// Ended by itself, or by a requested stop.
    Ended = 2,
    /// Ended by a panic.
    Panicked = 3,
}

impl Threads {
    /// Starts a thread after this tick, unless the tick fails.
    /// While the module's plugin is being unloaded or reloaded, the start waits until it is known whether the module
    /// stays.
    ///
    /// To make a thread takes time and memory: begin it once, and let it [wait](Stop::wait).
    ///
    /// # Errors
    /// When one of that name runs, there are 16, or the name is not made of letters, digits, `_` and `-`.
    pub fn spawn(&self, name: &str, body: impl FnOnce(&Stop) + Send + 'static) -> Result<(), Refusal> {
        self.spawn_with_room(name, DEFAULT_RING_SIZE, body)
    }

    /// Acts as [`spawn`](Threads::spawn), with rings of `size` bytes for passed values.
    /// A value takes 12 bytes more than its own size. The default is 64 KiB.
    ///
    /// # Errors
    /// As for [`spawn`](Threads::spawn).
    pub fn spawn_with_room(
        &self,
        name: &str,
        bytes: usize,
        body: impl FnOnce(&Stop) + Send + 'static,
    ) -> Result<(), Refusal> {
        let body = ThreadBody::new(body);
        // SAFETY: everything lives during the call, and the host takes the body over also when it refuses.
        let (code, reason) =
            call_with_sink(|sink| unsafe { (self.spawn)(self.context, Bytes::of(name), bytes, body, sink) });
        if code == DONE { Ok(()) } else { Err(Refusal(reason)) }
    }

    /// Returns the state of a thread.
    pub fn state(&self, name: &str) -> ThreadState {
        // SAFETY: the name lives during the call.
        match unsafe { (self.state)(self.context, Bytes::of(name)) } {
            0 => ThreadState::Absent,
            1 => ThreadState::Running,
            3 => ThreadState::Panicked,
            _ => ThreadState::Ended,
        }
    }

    /// Returns true if a thread runs, or begins after this tick.
    pub fn is_running(&self, name: &str) -> bool {
        self.state(name) == ThreadState::Running
    }

    /// Requests a thread to stop, after this tick; nothing waits for it.
    pub fn stop(&self, name: &str) {
        // SAFETY: the name lives during the call.
        unsafe { (self.stop)(self.context, Bytes::of(name)) }
    }

    /// Sends a value to a thread after this tick, and wakes it from [`Stop::wait`].
    /// False if there is no room for it.
    ///
    /// # Errors
    /// When no thread of that name runs, or its ring could never hold the value.
    pub fn send<T: Interface + Copy>(&self, name: &str, value: &T) -> Result<bool, Refusal> {
        let mut value = *value;
        let bytes = bytes_of(&mut value);
        // SAFETY: everything lives during the call.
        sent(call_with_sink(|sink| unsafe {
            (self.send)(self.context, Bytes::of(name), T::DESCRIPTOR.hash, bytes, sink)
        }))
    }

    /// Receives the next value that a thread sent before this tick, oldest first.
    /// Also of a thread that has ended, until another one of its name is started.
    ///
    /// # Errors
    /// When no thread of that name was begun, or the value is of another interface; it is dropped then.
    pub fn receive<T: Interface + Copy>(&self, name: &str) -> Result<Option<T>, Refusal> {
        // SAFETY: everything lives during the call.
        received(|schema, data, sink| unsafe {
            (self.receive)(self.context, Bytes::of(name), schema, data, size_of::<T>(), sink)
        })
    }
}

call_table! {
    /// Host side of a thread: stop request, time, log, and exchange with the ticks.
    pub struct Stop {
        /// Returns 1 when the thread must stop.
        fn is_set() -> i32;
        /// Sleeps for a number of ns, or until an event; 0 when the thread must stop.
        fn wait(u64) -> i32;
        /// Returns the agent's time, ns.
        fn now() -> u64;
        /// Logs a text, at a [`Level`].
        fn log(u32, Bytes);
        /// Sends a value of that schema to the tick; [`FULL`] if there is no room.
        fn send(u64, Bytes, *const Sink) -> i32;
        /// Receives the tick's next value, of that schema and size; [`ABSENT`] if none.
        fn receive(u64, *mut u8, usize, *const Sink) -> i32;
        /// Emits a synchronization point.
        fn emit(Bytes, *const Sink) -> i32;
        /// Waits for further emits of a synchronization point; returns their number.
        /// Arguments are the point, the number already seen and the limit, ns; [`ABSENT`] after the limit.
        fn wait_for(Bytes, u64, u64, *mut u64, *const Sink) -> i32;
    }
}

impl Stop {
    /// Returns true if the thread must stop, as soon as it can.
    pub fn is_set(&self) -> bool {
        // SAFETY: the host keeps its side as long as the thread.
        unsafe { (self.is_set)(self.context) != 0 }
    }

    /// Sleeps for `limit` of wall-clock time, or until the tick has sent a value.
    /// False, at once, when the thread must stop.
    pub fn wait(&self, limit: Duration) -> bool {
        // SAFETY: the host keeps its side as long as the thread.
        unsafe { (self.wait)(self.context, nanoseconds(limit)) != 0 }
    }

    /// Returns the agent's time, ns.
    pub fn now(&self) -> u64 {
        // SAFETY: the host keeps its side as long as the thread.
        unsafe { (self.now)(self.context) }
    }

    /// Writes to the agent's log, as the module; beyond 512 bytes a message is cut.
    pub fn log(&self, level: Level, message: fmt::Arguments<'_>) {
        let text = message.to_string();
        // SAFETY: the text lives during the call.
        unsafe { (self.log)(self.context, level as u32, Bytes::of(&text)) }
    }

    /// Logs information for users.
    pub fn info(&self, message: fmt::Arguments<'_>) {
        self.log(Level::Info, message);
    }

    /// Logs a problem with which the robot continues.
    pub fn warn(&self, message: fmt::Arguments<'_>) {
        self.log(Level::Warn, message);
    }

    /// Logs a failure.
    pub fn error(&self, message: fmt::Arguments<'_>) {
        self.log(Level::Error, message);
    }

    /// Sends a value to the module's ticks; false if there is no room for it.
    ///
    /// # Errors
    /// When the ring could never hold it.
    pub fn send<T: Interface + Copy>(&self, value: &T) -> Result<bool, Refusal> {
        let mut value = *value;
        let bytes = bytes_of(&mut value);
        // SAFETY: everything lives during the call.
        sent(call_with_sink(|sink| unsafe { (self.send)(self.context, T::DESCRIPTOR.hash, bytes, sink) }))
    }

    /// Takes the next value that a tick has sent, the oldest first.
    ///
    /// # Errors
    /// When it is of another interface; it is dropped then.
    pub fn receive<T: Interface + Copy>(&self) -> Result<Option<T>, Refusal> {
        // SAFETY: everything lives during the call.
        received(|schema, data, sink| unsafe {
            (self.receive)(self.context, schema, data, size_of::<T>(), sink)
        })
    }

    /// Emits a synchronization point, such as `/camera/image`, and those above it.
    ///
    /// # Errors
    /// When it is not a name of a point, or there are too many.
    pub fn emit(&self, point: &str) -> Result<(), Refusal> {
        // SAFETY: everything lives during the call.
        let (code, reason) =
            call_with_sink(|sink| unsafe { (self.emit)(self.context, Bytes::of(point), sink) });
        if code == DONE { Ok(()) } else { Err(Refusal(reason)) }
    }

    /// Waits for more than `since` emits of a point; returns their number.
    /// The point is a synchronization point such as `/stage/Act/end`, and points below it count too; with the last
    /// returned count, nothing is missed. `None` after `limit` of wall-clock time, or when the thread must stop.
    ///
    /// # Errors
    /// When it is not a name of a point, or there are too many.
    pub fn wait_for(&self, point: &str, since: u64, limit: Duration) -> Result<Option<u64>, Refusal> {
        let mut count = 0;
        // SAFETY: everything lives during the call.
        let (code, reason) = call_with_sink(|sink| unsafe {
            let limit = nanoseconds(limit);
            (self.wait_for)(self.context, Bytes::of(point), since, limit, &raw mut count, sink)
        });
        match code {
            DONE => Ok(Some(count)),
            ABSENT => Ok(None),
            _ => Err(Refusal(reason)),
        }
    }
}

fn nanoseconds(duration: Duration) -> u64 {
    u64::try_from(duration.as_nanos()).unwrap_or(u64::MAX)
}

/// Returns the bytes of a value, which must outlive the result.
fn bytes_of<T: Interface + Copy>(value: &mut T) -> Bytes {
    let bytes = View::of(value).bytes();
    Bytes { data: bytes.as_ptr(), length: bytes.len() }
}

fn sent((code, reason): (i32, String)) -> Result<bool, Refusal> {
    match code {
        DONE => Ok(true),
        FULL => Ok(false),
        _ => Err(Refusal(reason)),
    }
}

fn received<T: Interface + Copy>(
    call: impl FnOnce(u64, *mut u8, *const Sink) -> i32,
) -> Result<Option<T>, Refusal> {
    let mut value = std::mem::MaybeUninit::<T>::uninit();
    let data = value.as_mut_ptr().cast();
    match call_with_sink(|sink| call(T::DESCRIPTOR.hash, data, sink)) {
        // SAFETY: the host has written a value of this interface.
        (DONE, _) => Ok(Some(unsafe { value.assume_init() })),
        (ABSENT, _) => Ok(None),
        (_, reason) => Err(Refusal(reason)),
    }
}
