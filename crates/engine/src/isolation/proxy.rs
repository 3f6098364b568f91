//! Calls of a module whose instance is in another process.
//! The host drives it as any other.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use slate_module::table::{Bytes, DONE, PANICKED, REFUSED, SetupTable, Sink};
use slate_module::{
    Frame, InstanceFactory, Level, ModuleKind, ModuleTable, PortDescription, Refusal, Setup, encode,
};

use super::child::ARENA_LIMIT;
use super::mirror::{MappedArena, Mirror};
use super::process::Process;
use super::process_record::ProcessRecord;
use super::python::{is_python, python_source};
use super::wire::{Begin, Code, InstanceRequest, Topic};
use super::{Arena, length};
use crate::library;

/// Settings and resources of an isolated module.
#[derive(Debug)]
pub struct Isolation {
    /// Name of the module.
    pub name: Arc<str>,
    /// Program that is started; this program if `None`.
    pub program: Option<PathBuf>,
    /// Limit of its memory, bytes; 0 for none.
    pub memory: u64,
    /// Timeout of a step.
    pub tick_timeout: Duration,
    /// Timeout of any other call.
    pub call_timeout: Duration,
    /// Arena that the module writes.
    pub own: Arc<Arena>,
    /// Arenas that the module reads; values elsewhere are copied.
    pub readable: Vec<Arc<Arena>>,
    /// Ports.
    pub ports: Vec<PortDescription>,
    /// Size of its parameters, bytes.
    pub params_size: usize,
    /// Account of its processes.
    pub process_record: ProcessRecord,
}

impl Isolation {
    /// Returns a kind whose instances are in processes of their own.
    pub fn kind(self: &Arc<Self>, kind: &ModuleKind) -> ModuleKind {
        let factory = IsolatedKind { isolation: Arc::clone(self), kind: kind.clone() };
        // SAFETY: the calls are for what `IsolatedKind` makes.
        unsafe {
            ModuleKind::with_factory(
                Arc::new(factory),
                TABLE,
                (kind.name(), kind.doc(), kind.section()),
                None,
            )
        }
    }
}

/// Makes instances of a kind in other processes.
struct IsolatedKind {
    isolation: Arc<Isolation>,
    kind: ModuleKind,
}

impl InstanceFactory for IsolatedKind {
    fn describe(&self, setup: &Setup<'_>) -> Result<Vec<u8>, Refusal> {
        self.kind.describe_portable(setup)
    }

    fn create(&self, setup: &Setup<'_>, params: &[u8]) -> Result<*mut (), Refusal> {
        Ok(Box::into_raw(Box::new(Proxy::start(&self.isolation, &self.kind, setup, params)?)).cast())
    }
}

/// Returns the location of a kind's code.
pub(super) fn code_of(kind: &ModuleKind) -> Code {
    match library::library_of(kind) {
        Some(library) if is_python(library.source()) => Code::Python(python_source(library)),
        Some(library) => Code::Library(library.copy().into()),
        None => Code::Linked,
    }
}

/// Instance in another process.
pub struct Proxy {
    process: Process,
    mirror: Mirror,
    isolation: Arc<Isolation>,
    /// True once the end of the process was recorded.
    is_end_recorded: bool,
}

impl Proxy {
    fn start(
        isolation: &Arc<Isolation>,
        kind: &ModuleKind,
        setup: &Setup<'_>,
        params: &[u8],
    ) -> Result<Self, Refusal> {
        let arenas: Vec<_> =
            [&isolation.own].into_iter().chain(isolation.readable.iter()).take(ARENA_LIMIT).collect();
        let begin = Begin {
            name: isolation.name.to_string(),
            code: code_of(kind),
            memory: isolation.memory,
            arenas: (0..arenas.len()).map(|at| at == 0).collect(),
            arena_length: length(),
        };
        let files: Vec<_> = arenas.iter().map(|arena| arena.file()).collect();
        let mut process = Process::launch(isolation.program.as_deref(), &begin.code)?;
        // An interpreter may import for long, which the end of the agent must not wait for.
        isolation.process_record.record_launch(Some(process.stream()));
        let begun = process.begin(&begin, &files);
        isolation.process_record.record_launch(None);
        let addresses = begun?;
        let mapped = arenas.into_iter().zip(addresses);
        let mapped =
            mapped.map(|(arena, address)| MappedArena { arena: Arc::clone(arena), address }).collect();
        let mirror = Mirror::new(mapped, &isolation.ports, isolation.params_size)
            .map_err(|_| Refusal("its shared memory is spent".into()))?;
        let mut proxy = Self { process, mirror, isolation: Arc::clone(isolation), is_end_recorded: false };
        isolation.process_record.record_start(proxy.process.id(), proxy.process.stream());
        let request = InstanceRequest::new(kind.name(), setup, params, proxy.mirror.frame_address());
        let timeout = proxy.process.start_timeout();
        let made = proxy.process.request(Topic::Create, &encode(&request)?, timeout).map(drop);
        match made {
            Ok(()) => Ok(proxy),
            Err(refusal) if proxy.process.end().is_some() => {
                proxy.record_end();
                Err(format!("its process {refusal} while it was set up").into())
            }
            Err(refusal) => Err(refusal),
        }
    }

    /// Returns true while the process runs.
    pub fn is_alive(&mut self) -> bool {
        let alive = self.process.is_alive();
        if !alive {
            self.record_end();
        }
        alive
    }

    /// Notes how the process ended.
    fn record_end(&mut self) {
        if !std::mem::replace(&mut self.is_end_recorded, true) {
            self.isolation.process_record.record_exit(self.process.id(), self.process.end());
        }
    }

    /// # Safety
    /// The frame is ready for a tick of this module.
    unsafe fn tick(&mut self, frame: &Frame) -> i32 {
        // SAFETY: passed on to the caller; the host lives as long as the frame.
        let (filled, host) = unsafe { (self.mirror.fill(frame), &*frame.host) };
        let mut log = |level: i32, text: &[u8]| {
            // SAFETY: the host's own call, with bytes that live during it.
            unsafe { (host.log)(host.context, level as u32, text.as_ptr(), text.len()) }
        };
        if filled.is_err() {
            log(
                Level::Error as i32,
                b"its shared memory is spent: its values are larger than there is room for",
            );
            return PANICKED;
        }
        let Some(code) = self.process.call(Topic::Tick, &[], self.isolation.tick_timeout, &mut log) else {
            self.record_end();
            return PANICKED;
        };
        // SAFETY: filled from this frame.
        unsafe { self.mirror.copy_results(frame) };
        if code == PANICKED {
            // The process lives on, but the host takes another one.
            self.is_end_recorded = true;
            self.isolation.process_record.record_exit(self.process.id(), Some("panicked"));
        }
        code
    }

    /// Makes a call outside of a tick, and writes its result.
    ///
    /// # Safety
    /// The sink is as the host made it.
    unsafe fn request(&mut self, topic: Topic, body: &[u8], sink: *const Sink) -> i32 {
        let (code, bytes) = match self.process.request(topic, body, self.isolation.call_timeout) {
            Ok(bytes) => (DONE, bytes),
            Err(refusal) => (REFUSED, &*refusal.0.into_bytes()),
        };
        // SAFETY: the bytes live during the call; the rest is passed on to the caller.
        unsafe { ((*sink).write)((*sink).context, bytes.as_ptr(), bytes.len()) };
        if self.process.end().is_some() {
            self.record_end();
        }
        code
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        let fault = self.process.end().filter(|_| !self.is_end_recorded);
        self.isolation.process_record.record_exit(self.process.id(), fault);
        self.process.finish();
    }
}

/// Calls of a proxy; [`IsolatedKind`] describes and creates instances.
pub(super) const TABLE: ModuleTable = ModuleTable {
    name: Bytes::NONE,
    doc: Bytes::NONE,
    section: Bytes::NONE,
    describe,
    create,
    tick,
    save,
    restore,
    may_unload,
    destroy,
};

unsafe extern "C" fn describe(_: *const SetupTable, _: *const Sink) -> i32 {
    REFUSED
}

unsafe extern "C" fn create(_: *const SetupTable, _: Bytes, _: *mut *mut (), _: *const Sink) -> i32 {
    REFUSED
}

unsafe extern "C" fn tick(instance: *mut (), frame: *const Frame) -> i32 {
    // SAFETY: the host passes a proxy that `IsolatedKind` made, to one thread at a time, and a frame that is ready.
    unsafe { (*instance.cast::<Proxy>()).tick(&*frame) }
}

unsafe extern "C" fn save(instance: *const (), sink: *const Sink) -> i32 {
    // SAFETY: as for `tick`; it has no other user during the call.
    unsafe { (*instance.cast_mut().cast::<Proxy>()).request(Topic::Save, &[], sink) }
}

unsafe extern "C" fn restore(instance: *mut (), state: Bytes, sink: *const Sink) -> i32 {
    // SAFETY: as for `tick`; the state lives during the call.
    unsafe { (*instance.cast::<Proxy>()).request(Topic::Restore, state.as_slice(), sink) }
}

unsafe extern "C" fn may_unload(instance: *const (), sink: *const Sink) -> i32 {
    // SAFETY: as for `save`.
    unsafe { (*instance.cast_mut().cast::<Proxy>()).request(Topic::MayUnload, &[], sink) }
}

unsafe extern "C" fn destroy(instance: *mut (), sink: *const Sink) -> i32 {
    // SAFETY: the host passes what `IsolatedKind` made, once.
    let mut proxy = unsafe { Box::from_raw(instance.cast::<Proxy>()) };
    if proxy.process.end().is_some() {
        return DONE;
    }
    // A module may have something to do at its end.
    // SAFETY: as for `describe`.
    unsafe { proxy.request(Topic::Destroy, &[], sink) }
}
