use slate_blackboard::interface::Descriptor;

use super::{Effect, HostedService, Service, call_table, service};
use crate::Level;
use crate::table::Bytes;

call_table! {
    /// Settings of the log; writing to the log needs no aspect.
    ///
    /// ```
    /// use slate_module::Level;
    /// use slate_module::aspect::{Aspect, Logger};
    /// use slate_module::prelude::*;
    ///
    /// #[ports]
    /// pub struct Io {
    ///     logger: Aspect<Logger>,
    ///     /// Whether something went wrong.
    ///     alarm: Required<Alarm>,
    /// }
    ///
    /// /// Whether something went wrong.
    /// #[interface]
    /// pub struct Alarm {
    ///     /// Whether it did.
    ///     pub on: Bool,
    /// }
    ///
    /// /// Lets the planner tell more while something is wrong.
    /// pub struct Attention;
    ///
    /// #[module(stage = WorldState)]
    /// impl Module for Attention {
    ///     type Io = Io;
    ///     type Params = ();
    ///     type State = ();
    ///
    ///     fn tick(_: &mut (), io: &Io, _: &(), _: &Tick) -> Outcome {
    ///         if io.alarm.is_new() {
    ///             let level = if io.alarm.on.get() { Level::Debug } else { Level::Info };
    ///             io.logger.set_level(Some("planner"), level);
    ///         }
    ///         Outcome::Ok
    ///     }
    /// }
    /// # fn main() {}
    /// ```
    pub struct Logger {
        /// Returns the level of a module.
        fn level(Bytes) -> u32;
        /// Sets the level of a module, after the tick.
        /// An empty name sets all modules that have no level of their own.
        fn set_level(Bytes, u32);
        /// Returns the number of lines dropped.
        fn dropped() -> u64;
    }
}

// SAFETY: plain C data; the host gives each module a service of its own, which is used in the module's tick alone.
unsafe impl Service for Logger {
    const DESCRIPTOR: &'static Descriptor = &service::<Self>("logger 1", "Level filter of the log.");
}

impl HostedService for Logger {
    const EFFECT: Effect = Effect::None;
}

impl Logger {
    /// Returns the level of a module.
    pub fn level(&self, module: &str) -> Level {
        // SAFETY: the name lives during the call.
        Level::from_number(unsafe { (self.level)(self.context, Bytes::of(module)) })
    }

    /// Sets the log level of a module and of all below its name, after this tick.
    /// `r2` also sets `r2/planner`; without a name, it sets all modules that no level names. A tick that fails sets
    /// nothing.
    pub fn set_level(&self, module: Option<&str>, level: Level) {
        // SAFETY: the name lives during the call.
        unsafe { (self.set_level)(self.context, Bytes::of(module.unwrap_or_default()), level as u32) }
    }

    /// Returns the number of lines of all modules dropped as the targets were too slow.
    pub fn dropped(&self) -> u64 {
        // SAFETY: the host keeps its side as long as the module.
        unsafe { (self.dropped)(self.context) }
    }
}
