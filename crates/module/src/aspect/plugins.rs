use slate_blackboard::interface::Descriptor;

use super::blackboard::answered;
use super::{RequestAnswer, Service, service};
use crate::table::{Bytes, DONE, Sink};

/// Loads, unloads and reloads the plugins of the agent.
///
/// A tick asks and never waits: a thread of the host does it, between two cycles, and a later tick finds out what came
/// of it. When that is does not depend on the agent's time, so it is not part of what a run in lockstep can repeat.
///
/// ```
/// use slate_module::aspect::{Aspect, PluginAnswer, Plugins};
/// use slate_module::prelude::*;
///
/// #[ports]
/// pub struct Io {
///     plugins: Aspect<Plugins>,
/// }
///
/// /// Loads the arm's drivers when they are needed first.
/// pub struct ArmKeeper;
///
/// #[module(stage = Think)]
/// impl Module for ArmKeeper {
///     type Io = Io;
///     type Params = ();
///     type State = Option<u64>; // the request
///
///     fn tick(request: &mut Option<u64>, io: &Io, _: &(), now: &Tick) -> Outcome {
///         match request.map(|number| io.plugins.answer(number)) {
///             None => *request = Some(io.plugins.load("arm")),
///             Some(PluginAnswer::Refused(reason)) => {
///                 now.warn(format_args!("no arm: {reason}"));
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
pub struct Plugins {
    /// Given back to each call.
    pub context: *mut (),
    /// Asks for a change ([`Plugins::LOAD`] and the others) of that plugin, after the tick; the number of the request.
    pub ask: unsafe extern "C" fn(*mut (), u32, Bytes) -> u64,
    /// What came of a request: [`DONE`], [`REFUSED`](crate::table::REFUSED), [`PENDING`](super::PENDING), with a text;
    /// [`ABSENT`](super::ABSENT) for no request.
    pub answer: unsafe extern "C" fn(*mut (), u64, *const Sink) -> i32,
    /// Lists the plugins, a line each: name, version, and whether it is loaded (`1` or `0`), with tabs between.
    pub list: unsafe extern "C" fn(*mut (), *const Sink),
}

// SAFETY: plain C data; the host gives each module a service of its own, which is used in the module's tick alone.
unsafe impl Service for Plugins {
    const DESCRIPTOR: &'static Descriptor = &service("plugins 1", "Loads, unloads and reloads plugins.");
}

/// What came of a request for a change of plugins.
pub type PluginAnswer = RequestAnswer;

/// A plugin of the agent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PluginEntry {
    /// Its name.
    pub name: String,
    /// Its version; empty when it is not loaded.
    pub version: String,
    /// Whether it is loaded; else it is only known from the configuration.
    pub loaded: bool,
}

impl Plugins {
    /// Loads a plugin.
    pub const LOAD: u32 = 1;
    /// Unloads it.
    pub const UNLOAD: u32 = 2;
    /// Exchanges its code.
    pub const RELOAD: u32 = 3;

    fn ask(&self, what: u32, name: &str) -> u64 {
        // SAFETY: the name lives during the call.
        unsafe { (self.ask)(self.context, what, Bytes::of(name)) }
    }

    /// Asks for a plugin of the configuration, or a list of plugins, to be loaded, with those that it needs. It is asked
    /// for after this tick, unless that fails. Returns the number of the request.
    pub fn load(&self, name: &str) -> u64 {
        self.ask(Self::LOAD, name)
    }

    /// As [`load`](Plugins::load), for a plugin to be unloaded. The module's own is refused.
    pub fn unload(&self, name: &str) -> u64 {
        self.ask(Self::UNLOAD, name)
    }

    /// As [`load`](Plugins::load), for a plugin's code to be exchanged with what its library is now.
    pub fn reload(&self, name: &str) -> u64 {
        self.ask(Self::RELOAD, name)
    }

    /// What came of a request; the last 64 are known.
    pub fn answer(&self, request: u64) -> PluginAnswer {
        // SAFETY: everything lives during the call.
        let (code, text) = answered(|sink| unsafe { (self.answer)(self.context, request, sink) });
        RequestAnswer::from_code(code, text)
    }

    /// The plugins that were loaded when this tick began, and those of the configuration that were not.
    pub fn list(&self) -> Vec<PluginEntry> {
        // SAFETY: everything lives during the call.
        let (_, text) = answered(|sink| unsafe {
            (self.list)(self.context, sink);
            DONE
        });
        let entry = |line: &str| {
            let mut parts = line.split('\t').map(str::to_owned);
            let mut next = || parts.next().unwrap_or_default();
            PluginEntry { name: next(), version: next(), loaded: next() == "1" }
        };
        text.lines().map(entry).collect()
    }
}
