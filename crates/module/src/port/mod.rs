//! Ports of a module: typed views of the slots of a frame.

mod input;
mod outbox;
#[cfg(test)]
mod padding;

use std::marker::PhantomData;
use std::ops::Deref;

use slate_blackboard::Stamp;
use slate_blackboard::interface::{Descriptor, Interface};

use crate::{Direction, Entry, Flags, Frame, PortDescription, PortList, PortSlot};
pub use input::Required;
pub use outbox::Delivery;

/// Ports of a module, made by the `#[ports]` macro.
pub trait Ports: Sized {
    /// Outline of the ports, readable before the library is opened.
    const OUTLINE: PortList;

    /// Describes the ports in the order in which they are bound.
    fn describe() -> Vec<PortDescription>;

    /// Binds the ports of a tick.
    ///
    /// # Safety
    /// The frame of the cursor was filled for these ports and outlives the result.
    unsafe fn bind(cursor: &mut PortCursor) -> Self;

    /// Returns the first input whose value is older than declared.
    fn stale_input(&self) -> Option<StaleInput> {
        None
    }
}

/// Input whose value is older than declared.
#[derive(Clone, Copy, Debug)]
pub struct StaleInput {
    /// Name of the port.
    pub name: &'static str,
    /// Stamp of the value.
    pub stamp: Stamp,
    /// Declared age from which it is stale, ns.
    pub after: u64,
}

/// Ports of a module without any.
impl Ports for () {
    const OUTLINE: PortList = PortList::Ports(&[]);

    fn describe() -> Vec<PortDescription> {
        Vec::new()
    }

    #[inline]
    unsafe fn bind(_: &mut PortCursor) -> Self {}
}

/// Ports of two groups, one after the other.
/// So a framework can add its own to an author's.
impl<A: Ports, B: Ports> Ports for (A, B) {
    const OUTLINE: PortList = PortList::Both(&A::OUTLINE, &B::OUTLINE);

    fn describe() -> Vec<PortDescription> {
        let mut ports = A::describe();
        ports.extend(B::describe());
        ports
    }

    #[inline]
    unsafe fn bind(cursor: &mut PortCursor) -> Self {
        // SAFETY: passed on to the caller.
        unsafe { (A::bind(cursor), B::bind(cursor)) }
    }

    fn stale_input(&self) -> Option<StaleInput> {
        self.0.stale_input().or_else(|| self.1.stale_input())
    }
}

/// Port field of a `#[ports]` struct: one port or several.
pub trait Port: Sized {
    /// Direction and interface.
    const CARRIES: (Direction, &'static Descriptor);

    /// Describes the port under that name.
    fn describe(name: &str, doc: &str) -> PortDescription;

    /// Binds the port of a tick.
    ///
    /// # Safety
    /// As for [`Ports::bind`].
    unsafe fn bind(cursor: &mut PortCursor) -> Self;

    /// Returns the stamp of an input's value that is older than declared.
    fn stale_since(&self) -> Option<Stamp> {
        None
    }
}

/// Struct of `#[ports]` with exactly one port of type `P`.
/// A [`Required<T>`] counts as an [`Input<T>`].
pub trait HasPort<P> {
    /// Name of the port.
    const PORT: &'static str;
}

/// Walks over the slots of a frame while ports are bound.
#[derive(Debug)]
pub struct PortCursor {
    next: *const PortSlot,
    left: usize,
}

impl PortCursor {
    /// Returns a cursor at the first slot of a frame.
    ///
    /// # Safety
    /// The frame's slots outlive the cursor and the ports bound with it.
    #[inline]
    pub unsafe fn new(frame: &Frame) -> Self {
        Self { next: frame.ports, left: frame.port_count }
    }

    /// Takes the next slot, which must be a port of that schema and direction.
    #[inline]
    pub(crate) fn take(&mut self, schema: u64, direction: Direction) -> *const PortSlot {
        let Some(left) = self.left.checked_sub(1) else { no_slot() };
        let slot = self.next;
        // SAFETY: `new` requires the slots to be valid; at least this one is left.
        let (found, after) = unsafe { (&*slot, slot.add(1)) };
        if found.schema != schema || found.direction != direction as u32 {
            wrong_slot();
        }
        (self.next, self.left) = (after, left);
        slot
    }

    /// Lends the next ports to `work`.
    /// For modules whose ports are only known from their configuration.
    #[inline]
    pub fn with<P: Ports, R>(&mut self, work: impl FnOnce(&P) -> R) -> R {
        // SAFETY: the slots are checked one by one, and the ports, which can't be copied, end here.
        let ports = unsafe { P::bind(self) };
        work(&ports)
    }
}

#[cold]
#[allow(clippy::panic, reason = "a host that is not the one that requested the description")]
fn no_slot() -> ! {
    panic!("the host fills a frame with a slot for every port that was described")
}

#[cold]
#[allow(clippy::panic, reason = "as above")]
fn wrong_slot() -> ! {
    panic!("ports are bound in the order in which they were described")
}

/// Returns the common part of every port's description.
fn described<T: Interface + ?Sized>(name: &str, doc: &str, direction: Direction) -> PortDescription {
    described_as(name, doc, direction, T::DESCRIPTOR)
}

/// Describes a port of any interface: compiled once, and not for each.
fn described_as(
    name: &str,
    doc: &str,
    direction: Direction,
    descriptor: &'static Descriptor,
) -> PortDescription {
    PortDescription {
        name: name.into(),
        doc: doc.into(),
        direction,
        descriptor,
        required: false,
        role: String::new(),
        stale_after: None,
        safe: None,
        capacity: default_capacity(descriptor),
        window: 16,
    }
}

fn default_capacity(descriptor: &'static Descriptor) -> usize {
    if descriptor.tail().is_some() { 1024 } else { 0 }
}

macro_rules! handle {
    ($(#[$doc:meta])* $name:ident, $direction:ident $(, $method:item)?) => {
        $(#[$doc])*
        ///
        /// Valid during one tick; it can be neither copied nor exchanged for another.
        #[derive(Debug)]
        pub struct $name<T: Interface + ?Sized> {
            slot: *const PortSlot,
            interface: PhantomData<fn() -> Box<T>>,
        }

        impl<T: Interface + ?Sized> Port for $name<T> {
            const CARRIES: (Direction, &'static Descriptor) = (Direction::$direction, T::DESCRIPTOR);

            fn describe(name: &str, doc: &str) -> PortDescription {
                described::<T>(name, doc, Direction::$direction)
            }

            #[inline]
            unsafe fn bind(cursor: &mut PortCursor) -> Self {
                Self { slot: cursor.take(T::DESCRIPTOR.hash, Direction::$direction), interface: PhantomData }
            }

            $($method)?
        }

        impl<T: Interface + ?Sized> $name<T> {
            #[inline]
            fn slot(&self) -> &PortSlot {
                // SAFETY: `bind` requires the slot to outlive the handle.
                unsafe { &*self.slot }
            }
        }
    };
}

handle!(
    /// Input with the newest value of the linked property.
    /// It may not have a value yet.
    ///
    /// The value is the same during a whole tick. [`get`](Input::get), [`fresh`](Input::fresh) and
    /// [`updated`](Input::updated) return an option, so that a missing value can't be taken for zeros; a module that
    /// can do nothing without the value takes a [`Required`] instead.
    ///
    /// ```compile_fail,E0609
    /// use slate_module::prelude::*;
    ///
    /// #[interface]
    /// pub struct Number {
    ///     /// The number.
    ///     pub value: f64,
    /// }
    ///
    /// fn read(input: &Input<Number>) -> f64 {
    ///     input.value // `input.get()` returns an option
    /// }
    /// ```
    Input,
    Input,
    fn stale_since(&self) -> Option<Stamp> {
        let stamp = self.stamp();
        (self.is_stale() && stamp.sequence > 0).then_some(stamp)
    }
);
handle!(
    /// Queue input with every value of the linked property, in order.
    /// At most a window per tick.
    Queue,
    Queue
);
handle!(
    /// Writes a property; the only writer it has.
    Output,
    Output
);
handle!(
    /// Debug output: writes a property only while it has a reader.
    Debug,
    Debug
);
handle!(
    /// Output of commands to an actuator.
    /// They pass the gate: lease, limits, time to live, stop.
    Command,
    Command
);
handle!(
    /// Receives messages in the order in which they were sent.
    Inbox,
    Inbox
);
handle!(
    /// Sends messages to the inbox that it is linked to.
    Outbox,
    Outbox
);

/// Received value or message, with its stamp.
#[derive(Debug)]
pub struct Received<'a, T: Interface + ?Sized> {
    entry: &'a Entry,
    value: &'a T,
}

impl<T: Interface + ?Sized> Received<'_, T> {
    /// Returns the stamp of the write.
    pub fn stamp(&self) -> Stamp {
        self.entry.stamp
    }

    /// Returns the number of the message's sender.
    pub fn sender(&self) -> u32 {
        self.entry.sender
    }

    /// Refuses the message, with a reason that the interface defines (not 0).
    /// The sender receives the reason.
    pub fn refuse(&self, reason: u16) {
        self.entry.answer.set(reason.max(1).into());
    }
}

impl<T: Interface + ?Sized> Deref for Received<'_, T> {
    type Target = T;

    #[inline]
    fn deref(&self) -> &T {
        self.value
    }
}

fn entries<T: Interface + ?Sized>(slot: &PortSlot) -> impl ExactSizeIterator<Item = Received<'_, T>> {
    let entries: &[Entry] = if slot.entries.is_null() {
        &[]
    } else {
        // SAFETY: the host lends `count` entries during the tick.
        unsafe { std::slice::from_raw_parts(slot.entries, slot.count.get()) }
    };
    entries.iter().map(|entry| {
        // SAFETY: each entry holds a value of this interface, unchanged during the tick.
        let value = unsafe { T::from_raw(entry.data, entry.items.get()) };
        Received { entry, value }
    })
}

impl<T: Interface + ?Sized> Queue<T> {
    /// Returns the values since the last tick, oldest first.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Received<'_, T>> {
        entries(self.slot())
    }

    /// Returns the number of values that this reader lost because it lagged.
    pub fn missed(&self) -> u64 {
        self.slot().missed
    }
}

impl<T: Interface + ?Sized> Inbox<T> {
    /// Returns the messages since the last tick, oldest first.
    /// A message that is not refused counts as done.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Received<'_, T>> {
        entries(self.slot())
    }
}

/// Guard of an output written in place, against a nested write.
struct Busy<'a>(&'a PortSlot);

impl<'a> Busy<'a> {
    fn new(slot: &'a PortSlot) -> Self {
        refuse_busy(slot);
        slot.flags.set(slot.flags.get() | Flags::BUSY);
        Self(slot)
    }
}

#[inline]
fn refuse_busy(slot: &PortSlot) {
    assert!(
        slot.flags.get() & Flags::BUSY == 0,
        "an output can't be written while it is being written in place"
    );
}

impl Drop for Busy<'_> {
    fn drop(&mut self) {
        self.0.flags.set(self.0.flags.get() & !Flags::BUSY);
    }
}

#[inline]
fn put<T: Interface>(slot: &PortSlot, value: T) {
    refuse_busy(slot);
    // SAFETY: the host lends the working slot to this tick alone, and it fits the interface. Nothing of the author's runs
    // meanwhile: what was there is not dropped.
    unsafe { slot.data.cast::<T>().write(value) };
    slot.flags.set(slot.flags.get() | Flags::SET);
}

fn fill<T: Interface + ?Sized>(slot: &PortSlot, items: usize, write: impl FnOnce(&mut T)) -> bool {
    if items > slot.capacity {
        return false;
    }
    let _busy = Busy::new(slot);
    slot.items.set(items);
    // SAFETY: the working slot has room for `capacity` items and no other reference to it exists. Zeros, as what an earlier
    // tick left there depends on the readers.
    unsafe {
        slot.data.write_bytes(0, T::DESCRIPTOR.shape(items).bytes(items));
        write(T::from_raw_mut(slot.data, items));
    }
    slot.flags.set(slot.flags.get() | Flags::SET);
    true
}

fn copy<T: Interface + ?Sized>(slot: &PortSlot, from: &PortSlot) -> bool {
    let items = from.items.get();
    if from.stamp.sequence == 0 || items > slot.capacity {
        return false;
    }
    refuse_busy(slot);
    slot.items.set(items);
    let bytes = T::DESCRIPTOR.shape(items).bytes(items);
    // SAFETY: both slots have room for a value of this interface with so many items. The host keeps the input's unchanged
    // during the tick and lends the other one to this tick alone.
    unsafe { from.data.cast_const().copy_to_nonoverlapping(slot.data, bytes) };
    slot.flags.set(slot.flags.get() | Flags::SET);
    true
}

impl<T: Interface> Output<T> {
    /// Writes the property; readers see it after the tick. The last call counts.
    #[inline]
    pub fn set(&self, value: T) {
        put(self.slot(), value);
    }
}

impl<T: Interface + ?Sized> Output<T> {
    /// Writes a value with a tail of `items` items in place; it begins all zero.
    /// False if that exceeds the configured capacity; nothing is written then.
    pub fn write(&self, items: usize, write: impl FnOnce(&mut T)) -> bool {
        fill(self.slot(), items, write)
    }

    /// Copies the newest value of an input once, straight into the property.
    /// False without a value, or if its tail exceeds the configured capacity; nothing is written then.
    pub fn copy(&self, input: &Input<T>) -> bool {
        copy::<T>(self.slot(), input.slot())
    }

    /// Returns the number of tail items that fit.
    pub fn capacity(&self) -> usize {
        self.slot().capacity
    }
}

impl<T: Interface> Debug<T> {
    /// Computes and writes the value if it has a reader.
    pub fn set(&self, value: impl FnOnce() -> T) {
        if !self.slot().data.is_null() {
            put(self.slot(), value());
        }
    }
}

impl<T: Interface + ?Sized> Debug<T> {
    /// Writes a value with a tail in place if it has a reader; see [`Output::write`].
    pub fn write(&self, items: usize, write: impl FnOnce(&mut T)) -> bool {
        !self.slot().data.is_null() && fill(self.slot(), items, write)
    }
}

/// Command priority of an actuator; the highest wins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub enum Priority {
    /// Planned action.
    Plan = 1,
    /// Operator at the controls.
    Teleoperation = 2,
    /// Reflex.
    Reflex = 3,
}

impl<T: Interface> Command<T> {
    /// Commands the actuator until the command's time to live ends.
    pub fn send(&self, value: T, priority: Priority) {
        self.slot().priority.set(priority as u32);
        put(self.slot(), value);
    }
}
