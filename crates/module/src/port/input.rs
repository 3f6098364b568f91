//! Inputs: the newest value of a property.

use std::ops::Deref;

use slate_blackboard::Stamp;
use slate_blackboard::interface::{Descriptor, Interface};

use super::{Input, Port, PortCursor};
use crate::{Direction, Flags, PortDescription};

impl<T: Interface + ?Sized> Input<T> {
    /// Returns the newest value, however old; `None` before the first write.
    #[inline]
    pub fn get(&self) -> Option<&T> {
        self.has_value().then(|| self.value())
    }

    /// Returns the newest value unless it is stale.
    #[inline]
    pub fn fresh(&self) -> Option<&T> {
        (self.has_value() && !self.is_stale()).then(|| self.value())
    }

    /// Returns the newest value if it was written since this module's last tick.
    #[inline]
    pub fn updated(&self) -> Option<&T> {
        self.is_new().then(|| self.value())
    }

    /// Returns true if the value was written since this module's last tick.
    #[inline]
    pub fn is_new(&self) -> bool {
        self.slot().flags.get() & Flags::NEW != 0
    }

    /// Returns true if the value is too old or missing, or its writer is gone or late.
    /// Too old means older than declared.
    #[inline]
    pub fn is_stale(&self) -> bool {
        self.slot().flags.get() & Flags::STALE != 0
    }

    /// Returns true if a link writes the property now.
    /// The writer is a module that works, a gate, the agent, or another agent; false for an input without a link,
    /// also if it is set.
    pub fn has_writer(&self) -> bool {
        self.slot().flags.get() & Flags::ALIVE != 0
    }

    /// Returns time and number of the value; the sequence is 0 before the first write.
    pub fn stamp(&self) -> Stamp {
        self.slot().stamp
    }

    /// Returns the number of values that this module never saw.
    pub fn missed(&self) -> u64 {
        self.slot().missed
    }

    /// Returns the number of tail items; 0 for an interface without a tail.
    pub fn items(&self) -> usize {
        self.slot().items.get()
    }

    #[inline]
    fn has_value(&self) -> bool {
        self.slot().stamp.sequence > 0
    }

    /// Returns the newest value, in the slot; zeros before the first write.
    #[inline]
    fn value(&self) -> &T {
        let slot = self.slot();
        // SAFETY: the host sets `data` to a value of this interface and keeps it unchanged during the tick.
        unsafe { T::from_raw(slot.data, slot.items.get()) }
    }
}

/// Required [`Input`]: the module does not run before its first value.
///
/// Until then `/module/state` says that the module waits, and for which input. Afterwards the fields of the value are
/// read directly. The value may be stale; a declaration `#[stale(after = "200ms")]` and [`fresh`](Required::fresh) tell.
///
/// ```
/// use slate_module::prelude::*;
/// use slate_module::testing::Fixture;
///
/// /// A number.
/// #[interface]
/// #[derive(PartialEq)]
/// pub struct Number {
///     /// The number.
///     pub value: f64,
/// }
///
/// #[ports]
/// pub struct Io {
///     input: Required<Number>,
///     doubled: Output<Number>,
/// }
///
/// /// Doubles a number.
/// pub struct Doubler;
///
/// #[module(stage = Think)]
/// impl Module for Doubler {
///     type Io = Io;
///     type Params = ();
///     type State = ();
///
///     fn tick(_: &mut (), io: &Io, _: &(), _: &Tick) -> Outcome {
///         io.doubled.set(Number { value: 2.0 * io.input.value });
///         Outcome::Ok
///     }
/// }
///
/// let mut doubler = Fixture::<Doubler>::new();
/// assert_eq!(doubler.tick().waiting_for(), Some("input"));
/// doubler.set("input", Number { value: 1.5 });
/// assert_eq!(doubler.tick(), Outcome::Ok);
/// assert_eq!(doubler.output::<Number>("doubled"), Some(Number { value: 3.0 }));
/// ```
#[derive(Debug)]
pub struct Required<T: Interface + ?Sized>(Input<T>);

impl<T: Interface + ?Sized> Port for Required<T> {
    const CARRIES: (Direction, &'static Descriptor) = Input::<T>::CARRIES;

    fn describe(name: &str, doc: &str) -> PortDescription {
        PortDescription { required: true, ..Input::<T>::describe(name, doc) }
    }

    #[inline]
    unsafe fn bind(cursor: &mut PortCursor) -> Self {
        // SAFETY: passed on to the caller.
        Self(unsafe { Input::bind(cursor) })
    }

    fn stale_since(&self) -> Option<Stamp> {
        self.0.stale_since()
    }
}

impl<T: Interface + ?Sized> Required<T> {
    /// Returns the value unless it is stale.
    #[inline]
    pub fn fresh(&self) -> Option<&T> {
        (!self.is_stale()).then(|| self.0.value())
    }

    /// Returns the value if it was written since this module's last tick.
    #[inline]
    pub fn updated(&self) -> Option<&T> {
        self.0.updated()
    }

    /// Returns true if the value was written since this module's last tick.
    #[inline]
    pub fn is_new(&self) -> bool {
        self.0.is_new()
    }

    /// Returns true if the value is older than declared, or its writer is gone or late.
    #[inline]
    pub fn is_stale(&self) -> bool {
        self.0.is_stale()
    }

    /// Returns true if a link writes the property now.
    /// The writer is a module that works, a gate, the agent, or another agent; false for an input without a link,
    /// also if it is set.
    pub fn has_writer(&self) -> bool {
        self.0.has_writer()
    }

    /// Returns time and number of the value.
    pub fn stamp(&self) -> Stamp {
        self.0.stamp()
    }

    /// Returns the number of values that this module never saw.
    pub fn missed(&self) -> u64 {
        self.0.missed()
    }
}

/// Access to the value, which exists in every tick.
impl<T: Interface + ?Sized> Deref for Required<T> {
    type Target = T;

    #[inline]
    fn deref(&self) -> &T {
        self.0.value()
    }
}
