use slate_blackboard::interface::Descriptor;

use super::{Service, service};
use crate::Level;
use crate::table::Bytes;

/// Decides what is logged; to write to the log needs no aspect.
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
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Logger {
    /// Given back to each call.
    pub context: *mut (),
    /// The level of a module.
    pub level: unsafe extern "C" fn(*mut (), Bytes) -> u32,
    /// Changes the level of a module, or of all that have none of their own for an empty name, after the tick.
    pub set_level: unsafe extern "C" fn(*mut (), Bytes, u32),
    /// How many lines were lost.
    pub dropped: unsafe extern "C" fn(*mut ()) -> u64,
}

// SAFETY: plain C data; the host gives each module a service of its own, which is used in the module's tick alone.
unsafe impl Service for Logger {
    const DESCRIPTOR: &'static Descriptor = &service("logger 1", "Decides what is logged.");
}

impl Logger {
    /// The level of a module.
    pub fn level(&self, module: &str) -> Level {
        // SAFETY: the name lives during the call.
        Level::from_number(unsafe { (self.level)(self.context, Bytes::of(module)) })
    }

    /// Changes the level of a module and of all whose names go on from that one, such as `r2` for `r2/planner`; or,
    /// without a name, of all modules that no level names. After this tick, unless it fails.
    pub fn set_level(&self, module: Option<&str>, level: Level) {
        // SAFETY: the name lives during the call.
        unsafe { (self.set_level)(self.context, Bytes::of(module.unwrap_or_default()), level as u32) }
    }

    /// How many lines of all modules were dropped because the targets were too slow.
    pub fn dropped(&self) -> u64 {
        // SAFETY: the host keeps its side as long as the module.
        unsafe { (self.dropped)(self.context) }
    }
}
