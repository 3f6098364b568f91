use slate_blackboard::interface::Descriptor;

use super::blackboard::call_with_sink;
use super::{Effect, HostedService, RequestAnswer, Service, call_table, service};
use crate::table::{Bytes, Sink};

call_table! {
    /// Changes of the agent's configuration at run time.
    /// Of links, parameters, `enabled`, values of inputs, levels of the log.
    ///
    /// A tick makes a request and never waits: the host applies the changes between two cycles, checked as a whole like
    /// every change of a configuration, and a later tick reads the answer. In lockstep they are applied at the end of
    /// the same cycle, so that a run is reproducible.
    ///
    /// ```
    /// use slate_module::aspect::{RequestAnswer, Aspect, Settings};
    /// use slate_module::prelude::*;
    ///
    /// #[ports]
    /// pub struct Io {
    ///     settings: Aspect<Settings>,
    /// }
    ///
    /// /// Lets the planner drive with care.
    /// pub struct Caution;
    ///
    /// #[module(stage = Act)]
    /// impl Module for Caution {
    ///     type Io = Io;
    ///     type Params = ();
    ///     type State = Option<u64>; // the request
    ///
    ///     fn tick(request: &mut Option<u64>, io: &Io, _: &(), now: &Tick) -> Outcome {
    ///         match request.map(|number| io.settings.answer(number)) {
    ///             None => *request = Some(io.settings.change(["modules.planner.params.speed=0.1"])),
    ///             Some(RequestAnswer::Refused(reason)) => {
    ///                 now.warn(format_args!("{reason}"));
    ///                 return Outcome::Degraded;
    ///             }
    ///             Some(_) => {}
    ///         }
    ///         Outcome::Ok
    ///     }
    /// }
    /// # fn main() {}
    /// ```
    pub struct Settings {
        /// Asks for changes, a line each, after the tick; the number of the request.
        fn request(Bytes) -> u64;
        /// Returns the answer to a request, with a text.
        /// It is [`DONE`](crate::table::DONE), [`REFUSED`](crate::table::REFUSED), [`PENDING`](super::PENDING), or
        /// [`ABSENT`](super::ABSENT) for an unknown request.
        fn answer(u64, *const Sink) -> i32;
    }
}

// SAFETY: plain C data; the host gives each module a service of its own, which is used in the module's tick alone.
unsafe impl Service for Settings {
    const DESCRIPTOR: &'static Descriptor =
        &service::<Self>("settings 1", "Changes the configuration while it runs.");
}

impl HostedService for Settings {
    const EFFECT: Effect = Effect::Acts;
}

impl Settings {
    /// Requests changes, all of which are made or none; returns the request's number.
    /// Each is a line: `path=value` as `slate config set` takes it, or a `path` alone, which reverts the changes at it
    /// and below it since the start. Reverts come first. The request is made after this tick, unless that fails.
    pub fn change<'a>(&self, changes: impl IntoIterator<Item = &'a str>) -> u64 {
        let mut lines = String::new();
        for change in changes {
            lines.push_str(change);
            lines.push('\n');
        }
        // SAFETY: the text lives during the call.
        unsafe { (self.request)(self.context, Bytes::of(&lines)) }
    }

    /// Returns the answer to a request; the last 64 are known.
    /// Changes are reported as by `slate config set`.
    pub fn answer(&self, request: u64) -> RequestAnswer {
        // SAFETY: everything lives during the call.
        let (code, text) = call_with_sink(|sink| unsafe { (self.answer)(self.context, request, sink) });
        RequestAnswer::from_code(code, text)
    }
}
