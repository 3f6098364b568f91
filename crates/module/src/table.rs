use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

use crate::instance::Authored;
use crate::{Description, Frame, Instance, Module, PortCursor, Refusal, Setup, Tick};

/// The calls by which the host drives an instance of a module, over memory and threads of the host.
///
/// No call unwinds: a panic is caught inside, as a host can't catch what another library throws.
#[derive(Clone, Copy)]
pub struct Table {
    /// The configuration table that sets it up; empty for none.
    pub section: fn() -> &'static str,
    /// Ports, parameters and trigger under a setup.
    pub describe: fn(&Setup<'_>) -> Result<Description, Refusal>,
    /// Makes an instance.
    pub create: fn(&Setup<'_>, &[u8]) -> Result<*mut (), Refusal>,
    /// One step: 0, 1, 2 as [`Outcome`](crate::Outcome), or -1 after a panic.
    pub tick: unsafe extern "C" fn(*mut (), *const Frame) -> i32,
    /// The state as CBOR.
    pub save: unsafe fn(*const ()) -> Result<Vec<u8>, Refusal>,
    /// Takes over a saved state.
    pub restore: unsafe fn(*mut (), &[u8]) -> Result<(), Refusal>,
    /// Ends an instance.
    pub destroy: unsafe extern "C" fn(*mut ()),
}

/// A kind of module, ready to be instantiated.
#[derive(Clone, Copy)]
pub struct Plugin {
    /// The name by which configuration finds it.
    pub name: &'static str,
    /// What it does.
    pub doc: &'static str,
    table: Table,
}

impl std::fmt::Debug for Plugin {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Plugin").field("name", &self.name).finish_non_exhaustive()
    }
}

impl Plugin {
    /// Its calls.
    pub fn table(&self) -> Table {
        self.table
    }

    /// A module that is linked into the program.
    pub fn linked<M: Module>() -> Self {
        let spec = M::spec();
        Self { name: spec.name, doc: spec.doc, table: Table::of::<Authored<M>>() }
    }

    /// An instance type that is linked into the program.
    pub fn instance<I: Instance>(name: &'static str, doc: &'static str) -> Self {
        Self { name, doc, table: Table::of::<I>() }
    }
}

impl Table {
    /// The calls of an instance type.
    pub const fn of<I: Instance>() -> Self {
        Self {
            section: || I::SECTION,
            describe: |setup| contained(|| I::describe(setup)),
            create: |setup, params| {
                contained(|| Ok(Box::into_raw(Box::new(I::create(setup, params)?)).cast()))
            },
            tick: tick::<I>,
            save: save::<I>,
            restore: restore::<I>,
            destroy: destroy::<I>,
        }
    }
}

unsafe extern "C" fn tick<I: Instance>(instance: *mut (), frame: *const Frame) -> i32 {
    // SAFETY: the host passes what `create` returned, to one thread at a time, and a frame that lives during the call
    // and was filled for this instance.
    let step = || unsafe {
        let frame = &*frame;
        let params = std::slice::from_raw_parts(frame.params, frame.params_size);
        (*instance.cast::<I>()).tick(&mut PortCursor::new(frame), params, &Tick::new(frame))
    };
    match catch_unwind(AssertUnwindSafe(step)) {
        Ok(outcome) => outcome as i32,
        Err(payload) => {
            // The message was printed or logged by the panic hook; dropping the payload may itself panic.
            let _ = catch_unwind(AssertUnwindSafe(move || drop(payload)));
            -1
        }
    }
}

unsafe fn save<I: Instance>(instance: *const ()) -> Result<Vec<u8>, Refusal> {
    // SAFETY: as for `tick`.
    contained(|| unsafe { (*instance.cast::<I>()).save() })
}

unsafe fn restore<I: Instance>(instance: *mut (), state: &[u8]) -> Result<(), Refusal> {
    // SAFETY: as for `tick`.
    contained(|| unsafe { (*instance.cast::<I>()).restore(state) })
}

unsafe extern "C" fn destroy<I: Instance>(instance: *mut ()) {
    // SAFETY: the host passes what `create` returned, once.
    let drop_instance = || drop(unsafe { Box::from_raw(instance.cast::<I>()) });
    if let Err(payload) = catch_unwind(AssertUnwindSafe(drop_instance)) {
        let _ = catch_unwind(AssertUnwindSafe(move || drop(payload)));
    }
}

fn contained<T>(call: impl FnOnce() -> Result<T, Refusal>) -> Result<T, Refusal> {
    catch_unwind(AssertUnwindSafe(call))
        .unwrap_or_else(|payload| Err(Refusal(panic_message(payload.as_ref()))))
}

fn panic_message(payload: &(dyn Any + Send)) -> String {
    let text = payload
        .downcast_ref::<&str>()
        .copied()
        .or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    format!("panicked: {}", text.unwrap_or("without a message"))
}
