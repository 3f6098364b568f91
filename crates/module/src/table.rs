//! Calls by which a host drives modules: a C interface.
//! It is the same for code that is linked in, loaded, isolated, or written in another language. `include/slate.h` is
//! made from this file and [`Frame`].

use crate::Frame;

/// Version of this interface; a host refuses libraries of another one.
///
/// 3: a setup may have parameters, and a description hardware of robots.
pub const ABI: u32 = 3;

/// Bytes that stay unchanged during a call.
/// Those of a table stay so as long as its library is open.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Bytes {
    /// Address of the first byte; any value for an empty range.
    pub data: *const u8,
    /// Length, bytes.
    pub length: usize,
}

impl Bytes {
    /// Empty range.
    pub const NONE: Self = Self { data: std::ptr::null(), length: 0 };

    /// Returns the bytes of a text.
    pub const fn of(text: &str) -> Self {
        Self { data: text.as_ptr(), length: text.len() }
    }

    /// Returns the bytes as a slice.
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

/// Sink of bytes from a module; writes are appended.
/// It takes a description, a state, or the reason of a refusal.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Sink {
    /// Context, passed to each call.
    pub context: *mut (),
    /// Takes bytes, which may be gone after the call.
    pub write: unsafe extern "C" fn(context: *mut (), data: *const u8, length: usize),
}

/// Setup of a module.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct SetupTable {
    /// Name of the module in the agent, such as `r2/planner`.
    pub name: Bytes,
    /// Seed of the run.
    pub seed: u64,
    /// Period of the main loop, ns.
    pub period: u64,
    /// Configuration table that the module asked for, as CBOR; empty if missing.
    pub section: Bytes,
    /// Value of the parameter interface, for a description with parameters; else empty.
    /// Only a kind that describes hardware is described so.
    pub params: Bytes,
}

/// Success of a call.
pub const DONE: i32 = 0;
/// Refusal of a call; the sink has the reason.
pub const REFUSED: i32 = 1;
/// Result of `tick` after a panic.
pub const PANICKED: i32 = -1;

/// Calls of a kind of module, over memory and threads of the host. None unwinds.
///
/// The host makes one call at a time to an instance, from any thread.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct ModuleTable {
    /// Name by which configuration finds it, in snake case.
    pub name: Bytes,
    /// Description of the module.
    pub doc: Bytes,
    /// Configuration table that sets it up; empty for most kinds.
    pub section: Bytes,
    /// Writes ports, parameters and trigger, or the reason of a refusal.
    /// They are those under a setup, as CBOR or JSON.
    pub describe: unsafe extern "C" fn(setup: *const SetupTable, sink: *const Sink) -> i32,
    /// Makes an instance; the bytes are a value of the parameter interface.
    pub create: unsafe extern "C" fn(
        setup: *const SetupTable,
        params: Bytes,
        instance: *mut *mut (),
        sink: *const Sink,
    ) -> i32,
    /// Makes one step: 0 as intended, 1 degraded, 2 failed, -1 after a panic.
    pub tick: unsafe extern "C" fn(instance: *mut (), frame: *const Frame) -> i32,
    /// Writes the state.
    pub save: unsafe extern "C" fn(instance: *const (), sink: *const Sink) -> i32,
    /// Restores a saved state; refuses one that doesn't fit, and keeps the present one.
    pub restore: unsafe extern "C" fn(instance: *mut (), state: Bytes, sink: *const Sink) -> i32,
    /// Refuses when the module can't be unloaded now, with the reason.
    pub may_unload: unsafe extern "C" fn(instance: *const (), sink: *const Sink) -> i32,
    /// Ends an instance; a refusal only describes an error.
    pub destroy: unsafe extern "C" fn(instance: *mut (), sink: *const Sink) -> i32,
}

/// Call that a library may export as `slate_robot_<crate>`.
/// It writes a robot's configuration in TOML, or its errors.
pub type RobotCall = unsafe extern "C" fn(sink: *const Sink) -> i32;

// SAFETY: a table is constant; its texts are read only.
unsafe impl Send for ModuleTable {}
// SAFETY: as above.
unsafe impl Sync for ModuleTable {}

/// Table that a library exports as `slate_plugin_<crate>`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct PluginTable {
    /// [`ABI`] at the time of its build.
    pub abi: u32,
    /// Size of a [`ModuleTable`] at the time of its build, bytes.
    pub module_size: u32,
    /// Kinds of modules.
    pub modules: *const ModuleTable,
    /// Number of kinds.
    pub module_count: usize,
}

// SAFETY: a table is constant.
unsafe impl Send for PluginTable {}
// SAFETY: as above.
unsafe impl Sync for PluginTable {}

impl PluginTable {
    /// Returns the table of a library with those modules.
    pub const fn new(modules: &'static [ModuleTable]) -> Self {
        Self {
            abi: ABI,
            module_size: size_of::<ModuleTable>() as u32,
            modules: modules.as_ptr(),
            module_count: modules.len(),
        }
    }
}
