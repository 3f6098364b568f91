use slate_blackboard::interface::Descriptor;

use super::blackboard::answered;
use super::{RequestAnswer, Service, service};
use crate::table::{Bytes, Sink};

/// Changes the configuration of the agent while it runs: links, parameters, `enabled`, values of inputs, levels of the log.
///
/// A tick asks and never waits: the host makes the change between two cycles, checked as a whole like every change of a
/// configuration, and a later tick finds out what came of it. In lockstep it is made at the end of the same cycle, so that a
/// run repeats it.
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
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Given back to each call.
    pub context: *mut (),
    /// Asks for changes, a line each, after the tick; the number of the request.
    pub ask: unsafe extern "C" fn(*mut (), Bytes) -> u64,
    /// What came of a request: [`DONE`](crate::table::DONE), [`REFUSED`](crate::table::REFUSED),
    /// [`PENDING`](super::PENDING), with a text; [`ABSENT`](super::ABSENT) for no request.
    pub answer: unsafe extern "C" fn(*mut (), u64, *const Sink) -> i32,
}

// SAFETY: plain C data; the host gives each module a service of its own, which is used in the module's tick alone.
unsafe impl Service for Settings {
    const DESCRIPTOR: &'static Descriptor =
        &service("settings 1", "Changes the configuration while it runs.");
}

impl Settings {
    /// Asks for changes, of which all are made or none. Each is a line: `path=value` as `slate config set` takes it, or a
    /// `path` alone, which takes back what was changed at it and below it since the start. What is taken back comes first.
    /// Returns the number of the request, which is made after this tick, unless that fails.
    pub fn change<'a>(&self, changes: impl IntoIterator<Item = &'a str>) -> u64 {
        let mut lines = String::new();
        for change in changes {
            lines.push_str(change);
            lines.push('\n');
        }
        // SAFETY: the text lives during the call.
        unsafe { (self.ask)(self.context, Bytes::of(&lines)) }
    }

    /// What came of a request; the last 64 are known. What was done is told as by `slate config set`.
    pub fn answer(&self, request: u64) -> RequestAnswer {
        // SAFETY: everything lives during the call.
        let (code, text) = answered(|sink| unsafe { (self.answer)(self.context, request, sink) });
        RequestAnswer::from_code(code, text)
    }
}
