use slate_blackboard::interface::Descriptor;

use super::blackboard::call_with_sink;
use super::{Effect, HostedService, RequestAnswer, Service, call_table, service};
use crate::table::{Bytes, DONE, Sink};

call_table! {
    /// Loads, unloads and reloads the plugins of the agent.
    ///
    /// A tick makes a request and never waits: a thread of the host executes it between two cycles, and a later tick
    /// reads the answer. The moment does not depend on the agent's time, so it is not reproducible in lockstep.
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
    pub struct Plugins {
        /// Requests a change of a plugin after the tick; returns the request's number.
        /// The change is [`Plugins::LOAD`] or another one.
        fn request(u32, Bytes) -> u64;
        /// Returns the answer to a request, with a text.
        /// It is [`DONE`], [`REFUSED`](crate::table::REFUSED), [`PENDING`](super::PENDING), or
        /// [`ABSENT`](super::ABSENT) for an unknown request.
        fn answer(u64, *const Sink) -> i32;
        /// Lists the plugins, a line each: name, version, `1` if loaded else `0`.
        /// Tabs separate them.
        fn list(*const Sink);
    }
}

// SAFETY: plain C data; the host gives each module a service of its own, which is used in the module's tick alone.
unsafe impl Service for Plugins {
    const DESCRIPTOR: &'static Descriptor =
        &service::<Self>("plugins 1", "Loads, unloads and reloads plugins.");
}

impl HostedService for Plugins {
    const EFFECT: Effect = Effect::Acts;
}

/// Answer to a request for a change of plugins.
pub type PluginAnswer = RequestAnswer;

/// Plugin of the agent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PluginEntry {
    /// Name.
    pub name: String,
    /// Version; empty if it is not loaded.
    pub version: String,
    /// True if it is loaded; else it is only known from the configuration.
    pub loaded: bool,
}

impl Plugins {
    /// Loads a plugin.
    pub const LOAD: u32 = 1;
    /// Unloads it.
    pub const UNLOAD: u32 = 2;
    /// Exchanges its code.
    pub const RELOAD: u32 = 3;

    fn request(&self, what: u32, name: &str) -> u64 {
        // SAFETY: the name lives during the call.
        unsafe { (self.request)(self.context, what, Bytes::of(name)) }
    }

    /// Requests to load a plugin of the configuration, with those that it needs.
    /// It may also be a list of plugins. The request is made after this tick, unless that fails. Returns the number of
    /// the request.
    pub fn load(&self, name: &str) -> u64 {
        self.request(Self::LOAD, name)
    }

    /// Acts as [`load`](Plugins::load), to unload a plugin; its own is refused.
    pub fn unload(&self, name: &str) -> u64 {
        self.request(Self::UNLOAD, name)
    }

    /// Acts as [`load`](Plugins::load), to reload a plugin's code from its library.
    pub fn reload(&self, name: &str) -> u64 {
        self.request(Self::RELOAD, name)
    }

    /// Returns the answer to a request; the last 64 are known.
    pub fn answer(&self, request: u64) -> PluginAnswer {
        // SAFETY: everything lives during the call.
        let (code, text) = call_with_sink(|sink| unsafe { (self.answer)(self.context, request, sink) });
        RequestAnswer::from_code(code, text)
    }

    /// Returns the plugins loaded at the beginning of this tick, and all others known.
    /// The others are those of the configuration.
    pub fn list(&self) -> Vec<PluginEntry> {
        // SAFETY: everything lives during the call.
        let (_, text) = call_with_sink(|sink| unsafe {
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
