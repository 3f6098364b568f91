//! Module's side of its table: from C calls to an [`Instance`].
//! A panic ends here, as a host can't catch one of another library.

use std::any::Any;

use crate::instance::ModuleInstance;
use crate::panics::{self, discard, placed_message};
use crate::table::{Bytes, DONE, PANICKED, REFUSED, SetupTable, Sink};
use crate::{
    Frame, Instance, Level, Module, ModuleTable, PortCursor, Refusal, Setup, Tick, decode, portable,
};

impl ModuleTable {
    /// Returns the calls of a module.
    pub const fn of<M: Module>() -> Self {
        Self::of_instance::<ModuleInstance<M>>(M::NAME, M::DOC)
    }

    /// Returns the calls of an instance type.
    pub const fn of_instance<I: Instance>(name: &'static str, doc: &'static str) -> Self {
        Self {
            name: Bytes::of(name),
            doc: Bytes::of(doc),
            section: Bytes::of(I::SECTION),
            describe: describe::<I>,
            create: create::<I>,
            tick: tick::<I>,
            save: save::<I>,
            restore: restore::<I>,
            may_unload: may_unload::<I>,
            destroy: destroy::<I>,
        }
    }
}

impl Sink {
    /// Writes bytes to the sink: a description, a state, or the reason of a refusal.
    ///
    /// # Safety
    /// The sink is unchanged, as its caller made it.
    pub unsafe fn take(&self, bytes: &[u8]) {
        // SAFETY: the bytes live during the call; the rest is passed on to the caller.
        unsafe { (self.write)(self.context, bytes.as_ptr(), bytes.len()) }
    }
}

/// Runs a call and writes its result.
/// Compiled once, and not for each call of each module.
///
/// # Safety
/// The sink is as the host made it.
unsafe fn answer(sink: *const Sink, call: &mut dyn FnMut() -> Result<Vec<u8>, Refusal>) -> i32 {
    let result = panics::catch(call).unwrap_or_else(|payload| {
        let reason = placed_message(payload.as_ref());
        discard(payload);
        Err(Refusal(reason))
    });
    // SAFETY: passed on to the caller.
    let sink = unsafe { &*sink };
    match result {
        Ok(bytes) => {
            // SAFETY: as above.
            unsafe { sink.take(&bytes) };
            DONE
        }
        Err(refusal) => {
            // SAFETY: as above.
            unsafe { sink.take(refusal.0.as_bytes()) };
            REFUSED
        }
    }
}

/// Writes the configuration of a robot, or its errors.
/// [`plugin!`](crate::plugin) makes the call.
///
/// # Safety
/// The sink is as the host made it.
#[doc(hidden)]
pub unsafe fn write_robot<E: std::fmt::Display>(
    sink: *const Sink,
    robot: impl Fn() -> Result<String, E>,
) -> i32 {
    // SAFETY: passed on to the caller.
    unsafe {
        answer(sink, &mut || robot().map(String::into_bytes).map_err(|error| Refusal(error.to_string())))
    }
}

/// # Safety
/// The table and its texts live during `work`.
unsafe fn with_setup(
    table: *const SetupTable,
    work: &mut dyn FnMut(&Setup<'_>) -> Result<Vec<u8>, Refusal>,
) -> Result<Vec<u8>, Refusal> {
    // SAFETY: passed on to the caller.
    let (table, name, section) = unsafe { (&*table, (*table).name.as_slice(), (*table).section.as_slice()) };
    let name = std::str::from_utf8(name).map_err(|error| Refusal(format!("the module's name: {error}")))?;
    let section = if section.is_empty() { None } else { Some(decode(section)?) };
    // SAFETY: passed on to the caller.
    let params = (!table.params.data.is_null()).then(|| unsafe { table.params.as_slice() });
    work(&Setup { name, seed: table.seed, period: table.period, section: section.as_ref(), params })
}

unsafe extern "C" fn describe<I: Instance>(setup: *const SetupTable, sink: *const Sink) -> i32 {
    // SAFETY: the host passes a setup and a sink that live during the call.
    unsafe {
        answer(sink, &mut || {
            panics::record_locations();
            with_setup(setup, &mut |setup| portable::encode_description(&I::describe(setup)?))
        })
    }
}

unsafe extern "C" fn create<I: Instance>(
    setup: *const SetupTable,
    params: Bytes,
    instance: *mut *mut (),
    sink: *const Sink,
) -> i32 {
    // SAFETY: the host passes what lives during the call, and a place for the instance.
    unsafe {
        answer(sink, &mut || {
            panics::record_locations();
            with_setup(setup, &mut |setup| {
                instance.write(Box::into_raw(Box::new(I::create(setup, params.as_slice())?)).cast());
                Ok(Vec::new())
            })
        })
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
    match panics::catch(step) {
        Ok(outcome) => outcome as i32,
        // SAFETY: as above.
        Err(payload) => unsafe { log_panic(payload, &*frame) },
    }
}

/// Logs the panic that ended a module's tick.
///
/// # Safety
/// The frame is as the host made it.
#[cold]
unsafe fn log_panic(payload: Box<dyn Any + Send>, frame: &Frame) -> i32 {
    let reason = placed_message(payload.as_ref());
    discard(payload);
    // SAFETY: passed on to the caller.
    let now = unsafe { Tick::new(frame) };
    now.log(Level::Error, format_args!("{reason}"));
    PANICKED
}

unsafe extern "C" fn save<I: Instance>(instance: *const (), sink: *const Sink) -> i32 {
    // SAFETY: as for `tick`.
    unsafe { answer(sink, &mut || (*instance.cast::<I>()).save()) }
}

unsafe extern "C" fn restore<I: Instance>(instance: *mut (), state: Bytes, sink: *const Sink) -> i32 {
    // SAFETY: as for `tick`, and the state lives during the call.
    unsafe { answer(sink, &mut || (*instance.cast::<I>()).restore(state.as_slice()).map(|()| Vec::new())) }
}

unsafe extern "C" fn may_unload<I: Instance>(instance: *const (), sink: *const Sink) -> i32 {
    // SAFETY: as for `tick`.
    unsafe { answer(sink, &mut || (*instance.cast::<I>()).may_unload().map(|()| Vec::new())) }
}

unsafe extern "C" fn destroy<I: Instance>(instance: *mut (), sink: *const Sink) -> i32 {
    // SAFETY: the host passes what `create` returned, once, and the sink is as for `describe`.
    unsafe {
        answer(sink, &mut || {
            drop(Box::from_raw(instance.cast::<I>()));
            Ok(Vec::new())
        })
    }
}
