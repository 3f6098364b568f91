//! Aspects: services that a module needs, declared as ports.
//! An aspect is available before the first tick, and its provider can't be unloaded while it is used.
//!
//! An aspect is a [`Service`]: a constant table of C calls. The host has some ([`BlackBoard`], [`Threads`], ...); a
//! module brings another one with a [`Provider`] port, and modules with an [`Aspect`] port for the same service run
//! only while it is provided.
//!
//! ```
//! use slate_module::aspect::{Aspect, Provider, Service, service};
//! use slate_module::prelude::*;
//!
//! /// Measures illuminance.
//! #[repr(C)]
//! pub struct LightMeter {
//!     context: *const f64,
//!     read: unsafe extern "C" fn(*const f64) -> f64,
//! }
//! // SAFETY: plain C data; reading a constant is possible from any thread.
//! unsafe impl Service for LightMeter {
//!     const DESCRIPTOR: &'static slate_module::blackboard::interface::Descriptor =
//!         &service::<Self>("light_meter 1", "Measures illuminance.");
//! }
//! impl LightMeter {
//!     /// Lux.
//!     pub fn read(&self) -> f64 {
//!         // SAFETY: the provider keeps the context as long as the service is provided.
//!         unsafe { (self.read)(self.context) }
//!     }
//! }
//!
//! #[ports]
//! pub struct MeterIo {
//!     light: Provider<LightMeter>,
//! }
//!
//! /// Brings the light meter.
//! pub struct Meter;
//!
//! #[module(stage = SensorAcquire)]
//! impl Module for Meter {
//!     type Io = MeterIo;
//!     type Params = ();
//!     type State = ();
//!
//!     fn tick(_: &mut (), io: &MeterIo, _: &(), _: &Tick) -> Outcome {
//!         if !io.light.is_provided() {
//!             unsafe extern "C" fn read(lux: *const f64) -> f64 {
//!                 // SAFETY: the owner below lives as long as the service is provided.
//!                 unsafe { *lux }
//!             }
//!             let lux = Box::new(120.0);
//!             io.light.provide(LightMeter { context: &raw const *lux, read }, lux);
//!         }
//!         Outcome::Ok
//!     }
//! }
//!
//! #[ports]
//! pub struct LampIo {
//!     light: Aspect<LightMeter>,
//! }
//!
//! /// Runs only while a light meter is provided.
//! pub struct Lamp;
//!
//! #[module(stage = Act)]
//! impl Module for Lamp {
//!     type Io = LampIo;
//!     type Params = ();
//!     type State = ();
//!
//!     fn tick(_: &mut (), io: &LampIo, _: &(), now: &Tick) -> Outcome {
//!         now.info(format_args!("{} lux", io.light.read()));
//!         Outcome::Ok
//!     }
//! }
//! # fn main() {}
//! ```

mod actuators;
mod answer;
mod blackboard;
mod call_table;
mod effect;
mod logger;
mod main_loop;
mod network;
mod plugins;
mod settings;
mod synchronization;
#[cfg(test)]
mod tests;
mod threads;
mod time_source;
mod transforms;

use std::marker::PhantomData;
use std::mem::ManuallyDrop;
use std::ops::Deref;

use slate_blackboard::interface::Descriptor;

pub use actuators::{ActuatorState, Actuators};
pub use answer::{PENDING, RequestAnswer};
use call_table::call_table;

pub use blackboard::{ABSENT, BlackBoard, BoardEvent, DESCRIBE, PropertyValue, Sample, call_with_sink};
pub use effect::{Effect, HostedService, ServiceDescription};
pub use logger::Logger;
pub use main_loop::{LoopPlace, LoopStage, MainLoop, Policy, PolicyTable, StageTable};
pub use network::{Connection, Datagrams, Listener, Network, NetworkAddress, SEND_LIMIT, SOCKET_LIMIT};
pub use plugins::{PluginAnswer, PluginEntry, Plugins};
pub use settings::Settings;
pub use synchronization::Synchronization;
pub use threads::{FULL, Stop, ThreadBody, ThreadState, Threads};
pub use time_source::TimeSource;
pub use transforms::{LATEST, RigidTransform, Transforms};

use crate::service_hash::service_hash;
use crate::{Direction, Flags, Port, PortCursor, PortDescription, PortSlot};

/// Service: a table of C calls with their context, of a module or of the host.
///
/// # Safety
/// The type is `repr(C)`, its layout and the meaning of its calls are fixed by the name in [`DESCRIPTOR`]
/// (change the version in it with them), and its calls may be made from any thread.
///
/// Safe code can't make a table with other calls: its fields are private, and a constructor that takes them is unsafe.
/// A table that is `Clone` or `Copy` must be valid also after the tick in which a port has lent it.
///
/// ```compile_fail,E0451
/// use slate_module::aspect::TimeSource;
///
/// unsafe extern "C" fn next(_: *mut (), _: u64) -> i32 {
///     0
/// }
/// TimeSource { context: std::ptr::null_mut(), next }.set_next(1);
/// ```
///
/// [`DESCRIPTOR`]: Service::DESCRIPTOR
pub unsafe trait Service: Sized + 'static {
    /// Name and version, made by [`service`].
    const DESCRIPTOR: &'static Descriptor;
}

/// Returns the descriptor of a service with its name, version and purpose.
/// `name` includes the version, such as `camera 1`. The hash is over the name and the size and alignment of the table.
pub const fn service<S: Service>(name: &'static str, doc: &'static str) -> Descriptor {
    let (size, align) = (size_of::<S>(), align_of::<S>());
    Descriptor { name, doc, ros: "", fields: &[], size, align, hash: service_hash(name, size, align) }
}

fn described<S: Service>(name: &str, doc: &str, direction: Direction) -> PortDescription {
    PortDescription {
        name: name.into(),
        doc: if doc.is_empty() { S::DESCRIPTOR.doc } else { doc }.into(),
        direction,
        descriptor: S::DESCRIPTOR,
        required: false,
        role: String::new(),
        stale_after: None,
        safe: None,
        capacity: 0,
        window: 1,
    }
}

/// Service that the module needs; it runs only while that is provided.
#[derive(Debug)]
pub struct Aspect<S: Service> {
    slot: *const PortSlot,
    service: PhantomData<fn() -> S>,
}

impl<S: Service> Port for Aspect<S> {
    const CARRIES: (Direction, &'static Descriptor) = (Direction::Aspect, S::DESCRIPTOR);

    fn describe(name: &str, doc: &str) -> PortDescription {
        described::<S>(name, doc, Direction::Aspect)
    }

    unsafe fn bind(cursor: &mut PortCursor) -> Self {
        Self { slot: cursor.take(S::DESCRIPTOR.hash, Direction::Aspect), service: PhantomData }
    }
}

impl<S: Service> Deref for Aspect<S> {
    type Target = S;

    fn deref(&self) -> &S {
        // SAFETY: the host points to a table of this service, which stays during the tick.
        unsafe { &*(*self.slot).data.cast::<S>() }
    }
}

/// Service that the module provides to others.
#[derive(Debug)]
pub struct Provider<S: Service> {
    slot: *const PortSlot,
    service: PhantomData<fn() -> S>,
}

impl<S: Service> Port for Provider<S> {
    const CARRIES: (Direction, &'static Descriptor) = (Direction::Provider, S::DESCRIPTOR);

    fn describe(name: &str, doc: &str) -> PortDescription {
        described::<S>(name, doc, Direction::Provider)
    }

    unsafe fn bind(cursor: &mut PortCursor) -> Self {
        Self { slot: cursor.take(S::DESCRIPTOR.hash, Direction::Provider), service: PhantomData }
    }
}

/// Calls of the host for a provider; a [`PortSlot`] points to it.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ProviderTable {
    /// Context, passed to each call.
    pub context: *mut (),
    /// Takes a table of a size in bytes, its owner and the owner's drop call.
    /// The drop call is made when the service has no user any more.
    pub provide: unsafe extern "C" fn(*mut (), *const u8, usize, *mut (), unsafe extern "C" fn(*mut ())),
    /// Ends the service.
    pub withdraw: unsafe extern "C" fn(*mut ()),
}

impl<S: Service> Provider<S> {
    fn slot(&self) -> &PortSlot {
        // SAFETY: `bind` requires the slot to outlive the port.
        unsafe { &*self.slot }
    }

    fn table(&self) -> &ProviderTable {
        // SAFETY: the host points to a table that it keeps as long as the module.
        unsafe { &*self.slot().data.cast::<ProviderTable>() }
    }

    /// Returns true if the service is provided.
    /// It is not before the first call of [`provide`](Provider::provide), nor after a panic or an exchange of the
    /// module's code.
    pub fn is_provided(&self) -> bool {
        self.slot().flags.get() & Flags::SET != 0
    }

    /// Provides the service from the end of this tick on.
    /// `owner` keeps the data of the table's context, and is dropped when the service has no user any more.
    pub fn provide<O: Send + 'static>(&self, service: S, owner: O) {
        unsafe extern "C" fn end<O>(owner: *mut ()) {
            // SAFETY: made from a box below, and dropped once.
            let owner = unsafe { Box::from_raw(owner.cast::<O>()) };
            // A panic in it must not leave this library.
            let _ = std::panic::catch_unwind(std::panic::AssertUnwindSafe(move || drop(owner)));
        }
        let (table, owner) = (self.table(), Box::into_raw(Box::new(owner)).cast());
        // It goes on in the host's copy.
        let service = ManuallyDrop::new(service);
        // SAFETY: the host copies the table and calls `end` once.
        unsafe {
            (table.provide)(table.context, (&raw const service).cast(), size_of::<S>(), owner, end::<O>)
        }
        self.slot().flags.set(self.slot().flags.get() | Flags::SET);
    }

    /// Ends the service; modules that need it wait then.
    pub fn withdraw(&self) {
        let table = self.table();
        // SAFETY: the host's table lives as long as the module.
        unsafe { (table.withdraw)(table.context) }
        self.slot().flags.set(self.slot().flags.get() & !Flags::SET);
    }
}
