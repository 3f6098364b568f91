//! The calls by which a host drives modules: a C interface, the same for code that is linked in, loaded, isolated, or
//! written in another language. `include/slate.h` is made from this file and [`Frame`].

use crate::Frame;

/// The version of this interface; a host refuses what was built for another one.
///
/// 3: a setup may have parameters, and a description hardware of robots.
pub const ABI: u32 = 3;

/// Bytes that stay as they are during a call; those of a table, as long as its library is open.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Bytes {
    /// The first one; anything when there are none.
    pub data: *const u8,
    /// How many.
    pub length: usize,
}

impl Bytes {
    /// None.
    pub const NONE: Self = Self { data: std::ptr::null(), length: 0 };

    /// The bytes of a text.
    pub const fn of(text: &str) -> Self {
        Self { data: text.as_ptr(), length: text.len() }
    }

    /// As a slice.
    ///
    /// # Safety
    /// They are readable and unchanged during `'a`.
    pub unsafe fn as_slice<'a>(self) -> &'a [u8] {
        if self.data.is_null() || self.length == 0 {
            return &[];
        }
        // SAFETY: passed on to the caller.
        unsafe { std::slice::from_raw_parts(self.data, self.length) }
    }
}

/// Takes bytes from a module: a description, a state, or the reason of a refusal. What is written adds up.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Sink {
    /// Given back to each call.
    pub context: *mut (),
    /// Takes bytes, which may be gone after the call.
    pub write: unsafe extern "C" fn(context: *mut (), data: *const u8, length: usize),
}

/// What a module is told when it is set up.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct SetupTable {
    /// The module's name in the agent, such as `r2/planner`.
    pub name: Bytes,
    /// The run's seed.
    pub seed: u64,
    /// The period of the main loop, nanoseconds.
    pub period: u64,
    /// The configuration table that the module asked for, as CBOR; none when it is not there.
    pub section: Bytes,
    /// A value of the parameter interface, when a kind that describes hardware is described once more; none else.
    pub params: Bytes,
}

/// A call went as it should.
pub const DONE: i32 = 0;
/// A call was refused; the sink has the reason.
pub const REFUSED: i32 = 1;
/// What `tick` returns after a panic.
pub const PANICKED: i32 = -1;

/// The calls of a kind of module, over memory and threads of the host. None of them unwinds.
///
/// The host makes one call at a time to an instance, from any thread.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct ModuleTable {
    /// The name by which configuration finds it, in snake case.
    pub name: Bytes,
    /// What it does.
    pub doc: Bytes,
    /// The configuration table that sets it up; none for most.
    pub section: Bytes,
    /// Writes ports, parameters and trigger under a setup, as CBOR or JSON, or the reason of a refusal.
    pub describe: unsafe extern "C" fn(setup: *const SetupTable, sink: *const Sink) -> i32,
    /// Makes an instance; the bytes are a value of the parameter interface.
    pub create: unsafe extern "C" fn(
        setup: *const SetupTable,
        params: Bytes,
        instance: *mut *mut (),
        sink: *const Sink,
    ) -> i32,
    /// One step: 0 as intended, 1 degraded, 2 failed, -1 after a panic.
    pub tick: unsafe extern "C" fn(instance: *mut (), frame: *const Frame) -> i32,
    /// Writes the state.
    pub save: unsafe extern "C" fn(instance: *const (), sink: *const Sink) -> i32,
    /// Takes over a saved state; it is refused, and the present state kept, when it doesn't fit.
    pub restore: unsafe extern "C" fn(instance: *mut (), state: Bytes, sink: *const Sink) -> i32,
    /// Refuses when the module can't be unloaded now, with the reason.
    pub may_unload: unsafe extern "C" fn(instance: *const (), sink: *const Sink) -> i32,
    /// Ends an instance; a refusal only says what went wrong.
    pub destroy: unsafe extern "C" fn(instance: *mut (), sink: *const Sink) -> i32,
}

/// Call that a library may export as `slate_robot_<crate>`: writes a robot's configuration in TOML, or its errors.
pub type RobotCall = unsafe extern "C" fn(sink: *const Sink) -> i32;

// SAFETY: a table is constant; its texts are read only.
unsafe impl Send for ModuleTable {}
// SAFETY: as above.
unsafe impl Sync for ModuleTable {}

/// What a library exports as `slate_plugin_<crate>`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct PluginTable {
    /// [`ABI`] when it was built.
    pub abi: u32,
    /// Bytes of a [`ModuleTable`] when it was built.
    pub module_size: u32,
    /// The kinds of modules.
    pub modules: *const ModuleTable,
    /// How many.
    pub module_count: usize,
}

// SAFETY: a table is constant.
unsafe impl Send for PluginTable {}
// SAFETY: as above.
unsafe impl Sync for PluginTable {}

impl PluginTable {
    /// The table of a library that brings those modules.
    pub const fn new(modules: &'static [ModuleTable]) -> Self {
        Self {
            abi: ABI,
            module_size: size_of::<ModuleTable>() as u32,
            modules: modules.as_ptr(),
            module_count: modules.len(),
        }
    }
}
