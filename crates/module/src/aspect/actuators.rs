use slate_blackboard::interface::{Descriptor, Interface, View};

use super::blackboard::call_with_sink;
use super::{Effect, HostedService, Service, call_table, service};
use crate::table::{Bytes, DONE, Sink};
use crate::{Priority, Refusal};

call_table! {
    /// Actuators of the agent by name: gate states, stops and commands.
    /// It commands those whose configuration names this module, `modules = ["behavior"]`. In a robot `r2` the name
    /// `wheels` means `r2/wheels`, if that exists.
    ///
    /// For a module that always commands the same actuators a [`Command`](crate::Command) port is better. A command is
    /// offered to the gate when the tick has ended well, and must be renewed in each tick, else it ends with the first
    /// tick that doesn't; so it does when the module fails, hangs, waits, is switched off or unloaded. For the lease it
    /// is one more commander: see the gate's rules in slate-safety.
    ///
    /// ```
    /// use slate_module::aspect::{Actuators, Aspect};
    /// use slate_module::prelude::*;
    ///
    /// /// A speed of a motor.
    /// #[interface]
    /// pub struct Speed {
    ///     /// Radians per second.
    ///     #[unit("rad/s")] pub speed: f64,
    /// }
    ///
    /// #[ports]
    /// pub struct Io {
    ///     temperature: Required<Speed>,
    ///     actuators: Aspect<Actuators>,
    /// }
    ///
    /// /// Runs the fan while it is warm, and stops everything when it is hot.
    /// pub struct Warden;
    ///
    /// #[module(stage = Act)]
    /// impl Module for Warden {
    ///     type Io = Io;
    ///     type Params = ();
    ///     type State = ();
    ///
    ///     fn tick(_: &mut (), io: &Io, _: &(), now: &Tick) -> Outcome {
    ///         if io.temperature.speed > 80.0 {
    ///             io.actuators.stop_all("too hot");
    ///         } else if io.temperature.speed > 60.0 {
    ///             if let Err(reason) = io.actuators.offer("fan", Priority::Plan, &Speed { speed: 30.0 }) {
    ///                 now.warn(format_args!("{reason}"));
    ///                 return Outcome::Degraded;
    ///             }
    ///         }
    ///         Outcome::Ok
    ///     }
    /// }
    /// # fn main() {}
    /// ```
    pub struct Actuators {
        /// Lists the actuators, a line each.
        fn names(*const Sink) -> i32;
        /// Returns the state of an actuator's gate; the sink gets the lease's holder.
        fn state(Bytes, *mut ActuatorState, *const Sink) -> i32;
        /// Stops an actuator, or all for an empty name, with that reason.
        fn stop(Bytes, Bytes, *const Sink) -> i32;
        /// Offers a command of that schema and priority to an actuator.
        fn offer(Bytes, u64, u32, Bytes, *const Sink) -> i32;
    }
}

// SAFETY: plain C data; the host gives each module a service of its own, which is used in the module's tick alone.
unsafe impl Service for Actuators {
    const DESCRIPTOR: &'static Descriptor = &service::<Self>(
        "actuators 1",
        "Looks at actuators, stops them, and commands those that are chosen at run time.",
    );
}

impl HostedService for Actuators {
    const EFFECT: Effect = Effect::Acts;
}

/// State of an actuator's gate.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ActuatorState {
    /// Mode: [`ActuatorState::DISARMED`] or another one.
    pub mode: u32,
    /// Priority of the last command of the lease's holder, as in [`Priority`].
    /// 0 without a lease.
    pub priority: u32,
    /// 1 if this module has the lease.
    pub is_mine: u32,
    /// Reserved.
    pub reserved: u32,
}

impl ActuatorState {
    /// Mode in which no command passes until the gate is armed.
    pub const DISARMED: u32 = 0;
    /// Mode in which commands pass.
    pub const ARMED: u32 = 1;
    /// Mode in which no command passes until the stop is reset and the gate is armed.
    pub const STOPPED: u32 = 2;

    /// Returns true if commands pass.
    pub fn is_armed(&self) -> bool {
        self.mode == Self::ARMED
    }

    /// Returns true if it is stopped.
    pub fn is_stopped(&self) -> bool {
        self.mode == Self::STOPPED
    }

    /// Returns true if the lease is taken.
    pub fn is_leased(&self) -> bool {
        self.priority != 0
    }

    /// Returns true if this module has the lease.
    pub fn is_mine(&self) -> bool {
        self.is_mine != 0
    }
}

impl Actuators {
    /// Returns the names of all actuators, in alphabetical order.
    pub fn names(&self) -> Vec<String> {
        // SAFETY: everything lives during the call.
        let (_, text) = call_with_sink(|sink| unsafe { (self.names)(self.context, sink) });
        text.lines().map(str::to_owned).collect()
    }

    /// Returns the present state of an actuator's gate, and the lease's holder.
    /// The holder is the path of a command, such as `execute/wheels`, or of a module with this aspect; empty without
    /// one.
    ///
    /// # Errors
    /// When there is no such actuator.
    pub fn state(&self, actuator: &str) -> Result<(ActuatorState, String), Refusal> {
        let mut state = ActuatorState::default();
        // SAFETY: everything lives during the call.
        let (code, text) = call_with_sink(|sink| unsafe {
            (self.state)(self.context, Bytes::of(actuator), &raw mut state, sink)
        });
        if code == DONE { Ok((state, text)) } else { Err(Refusal(text)) }
    }

    /// Stops an actuator at once, and not only at the end of the tick.
    /// It gets its safe command until an operator resets and arms it, which no module can. It stays stopped also when
    /// this tick then fails.
    ///
    /// # Errors
    /// When there is no such actuator.
    pub fn stop(&self, actuator: &str, reason: &str) -> Result<(), Refusal> {
        // SAFETY: everything lives during the call.
        let (code, text) = call_with_sink(|sink| unsafe {
            (self.stop)(self.context, Bytes::of(actuator), Bytes::of(reason), sink)
        });
        if code == DONE { Ok(()) } else { Err(Refusal(text)) }
    }

    /// Stops all actuators at once, as [`stop`](Actuators::stop) does with one.
    pub fn stop_all(&self, reason: &str) {
        // SAFETY: everything lives during the call. No refusal is possible.
        call_with_sink(|sink| unsafe { (self.stop)(self.context, Bytes::NONE, Bytes::of(reason), sink) });
    }

    /// Offers a command to an actuator at the end of this tick; the last one counts.
    /// The gate decides if it passes; its [`state`](Actuators::state) shows that from the next tick on.
    ///
    /// # Errors
    /// When there is no such actuator, its configuration does not name this module, or it has another interface.
    pub fn offer<T: Interface + Copy>(
        &self,
        actuator: &str,
        priority: Priority,
        command: &T,
    ) -> Result<(), Refusal> {
        let mut command = *command;
        let bytes = View::of(&mut command).bytes();
        let bytes = Bytes { data: bytes.as_ptr(), length: bytes.len() };
        let (schema, priority) = (T::DESCRIPTOR.hash, priority as u32);
        // SAFETY: everything lives during the call.
        let (code, text) = call_with_sink(|sink| unsafe {
            (self.offer)(self.context, Bytes::of(actuator), schema, priority, bytes, sink)
        });
        if code == DONE { Ok(()) } else { Err(Refusal(text)) }
    }
}
