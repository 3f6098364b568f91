use slate_blackboard::interface::Descriptor;

use super::blackboard::call_with_sink;
use super::{Effect, HostedService, Service, call_table, service};
use crate::Refusal;
use crate::table::{Bytes, DONE, Sink};

call_table! {
    /// Synchronization points of the module and of threads outside the main loop.
    ///
    /// A tick emits and looks; it never waits. A thread of the module waits with
    /// [`Stop::wait_for`](super::Stop::wait_for).
    ///
    /// ```
    /// use slate_module::aspect::{Aspect, Synchronization};
    /// use slate_module::prelude::*;
    ///
    /// #[ports]
    /// pub struct Io {
    ///     synchronization: Aspect<Synchronization>,
    /// }
    ///
    /// /// Says that it has done its work once more.
    /// pub struct Beat;
    ///
    /// #[module(stage = Act)]
    /// impl Module for Beat {
    ///     type Io = Io;
    ///     type Params = ();
    ///     type State = ();
    ///
    ///     fn tick(_: &mut (), io: &Io, _: &(), _: &Tick) -> Outcome {
    ///         match io.synchronization.emit("/beat") {
    ///             Ok(()) => Outcome::Ok,
    ///             Err(_) => Outcome::Failed,
    ///         }
    ///     }
    /// }
    /// # fn main() {}
    /// ```
    pub struct Synchronization {
        /// Emits a point after the tick.
        fn emit(Bytes, *const Sink) -> i32;
        /// Returns the number of emits of a point.
        fn count(Bytes, *mut u64, *const Sink) -> i32;
    }
}

// SAFETY: plain C data; the host gives each module a service of its own, which is used in the module's tick alone.
unsafe impl Service for Synchronization {
    const DESCRIPTOR: &'static Descriptor =
        &service::<Self>("synchronization 1", "Emits and counts named synchronization points.");
}

impl HostedService for Synchronization {
    const EFFECT: Effect = Effect::None;
}

impl Synchronization {
    /// Emits a point such as `/camera/image`, and those above it, after this tick.
    /// A tick that fails emits nothing.
    ///
    /// # Errors
    /// When it is not a name of a point, or there are too many.
    pub fn emit(&self, point: &str) -> Result<(), Refusal> {
        // SAFETY: everything lives during the call.
        let (code, reason) =
            call_with_sink(|sink| unsafe { (self.emit)(self.context, Bytes::of(point), sink) });
        if code == DONE { Ok(()) } else { Err(Refusal(reason)) }
    }

    /// Returns the number of emits of a point or one below it until this tick.
    /// A point is such as `/stage/Act/end`; it counts from the first request on.
    ///
    /// # Errors
    /// When it is not a name of a point, or there are too many.
    pub fn count(&self, point: &str) -> Result<u64, Refusal> {
        let mut count = 0;
        // SAFETY: everything lives during the call.
        let (code, reason) = call_with_sink(|sink| unsafe {
            (self.count)(self.context, Bytes::of(point), &raw mut count, sink)
        });
        if code == DONE { Ok(count) } else { Err(Refusal(reason)) }
    }
}
