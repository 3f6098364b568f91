//! Calls of a module whose instance is in another process.
//! The host drives it as any other.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use slate_module::table::{Bytes, DONE, PANICKED, REFUSED, SetupTable, Sink};
use slate_module::{Frame, Level, Maker, ModuleKind, ModuleTable, PortDescription, Refusal, Setup, encode};

use super::account::Account;
use super::child::ARENAS;
use super::mirror::{Mapped, Mirror};
use super::process::{Process, STARTING};
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
    pub timeout: Duration,
    /// Timeout of any other call.
    pub hang: Duration,
    /// Arena that the module writes.
    pub own: Arc<Arena>,
    /// Arenas that the module reads; values elsewhere are copied.
    pub readable: Vec<Arc<Arena>>,
    /// Ports.
    pub ports: Vec<PortDescription>,
    /// Size of its parameters, bytes.
    pub params_size: usize,
    /// Account of its processes.
    pub account: Account,
}

impl Isolation {
    /// Returns a kind whose instances are in processes of their own.
    pub fn kind(self: &Arc<Self>, kind: &ModuleKind) -> ModuleKind {
        let maker = Apart { isolation: Arc::clone(self), kind: kind.clone() };
        // SAFETY: the calls are for what `Apart` makes.
        unsafe {
            ModuleKind::made_by(Arc::new(maker), TABLE, (kind.name(), kind.doc(), kind.section()), None)
        }
    }
}

/// Makes instances of a kind in other processes.
struct Apart {
    isolation: Arc<Isolation>,
    kind: ModuleKind,
}

impl Maker for Apart {
    fn describe(&self, setup: &Setup<'_>) -> Result<Vec<u8>, Refusal> {
        self.kind.describe_portable(setup)
    }

    fn create(&self, setup: &Setup<'_>, params: &[u8]) -> Result<*mut (), Refusal> {
        Ok(Box::into_raw(Box::new(Proxy::start(&self.isolation, &self.kind, setup, params)?)).cast())
    }
}

/// Returns the location of a kind's code.
pub(super) fn code_of(kind: &ModuleKind) -> Code {
    library::file_of(kind).map_or(Code::Linked, |file| Code::Library(file.into()))
}

/// Instance in another process.
pub struct Proxy {
    process: Process,
    mirror: Mirror,
    isolation: Arc<Isolation>,
    /// True once the end of the process was recorded.
    noted: bool,
}

impl Proxy {
    fn start(
        isolation: &Arc<Isolation>,
        kind: &ModuleKind,
        setup: &Setup<'_>,
        params: &[u8],
    ) -> Result<Self, Refusal> {
        let arenas: Vec<_> =
            [&isolation.own].into_iter().chain(isolation.readable.iter()).take(ARENAS).collect();
        let begin = Begin {
            name: isolation.name.to_string(),
            code: code_of(kind),
            memory: isolation.memory,
            arenas: (0..arenas.len()).map(|at| at == 0).collect(),
            arena_length: length(),
        };
        let files: Vec<_> = arenas.iter().map(|arena| arena.file()).collect();
        let (process, addresses) = Process::start(isolation.program.as_deref(), &begin, &files)?;
        let mapped = arenas.into_iter().zip(addresses);
        let mapped = mapped.map(|(arena, address)| Mapped { arena: Arc::clone(arena), address }).collect();
        let mirror = Mirror::new(mapped, &isolation.ports, isolation.params_size)
            .map_err(|_| Refusal("its shared memory is spent".into()))?;
        let mut proxy = Self { process, mirror, isolation: Arc::clone(isolation), noted: false };
        isolation.account.began(proxy.process.id(), proxy.process.stream());
        let request = InstanceRequest::new(kind.name(), setup, params, proxy.mirror.frame_address());
        let made = proxy.process.ask(Topic::Create, &encode(&request)?, STARTING).map(drop);
        match made {
            Ok(()) => Ok(proxy),
            Err(refusal) if proxy.process.end().is_some() => {
                proxy.note();
                Err(format!("its process {refusal} while it was set up").into())
            }
            Err(refusal) => Err(refusal),
        }
    }

    /// Returns true while the process runs.
    pub fn is_alive(&mut self) -> bool {
        let alive = self.process.is_alive();
        if !alive {
            self.note();
        }
        alive
    }

    /// Notes how the process ended.
    fn note(&mut self) {
        if !std::mem::replace(&mut self.noted, true) {
            self.isolation.account.ended(self.process.id(), self.process.end());
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
        let Some(code) = self.process.call(Topic::Tick, &[], self.isolation.timeout, &mut log) else {
            self.note();
            return PANICKED;
        };
        // SAFETY: filled from this frame.
        unsafe { self.mirror.take_over(frame) };
        if code == PANICKED {
            // The process lives on, but the host takes another one.
            self.noted = true;
            self.isolation.account.ended(self.process.id(), Some("panicked"));
        }
        code
    }

    /// Makes a call outside of a tick, and writes its result.
    ///
    /// # Safety
    /// The sink is as the host made it.
    unsafe fn ask(&mut self, topic: Topic, body: &[u8], sink: *const Sink) -> i32 {
        let (code, bytes) = match self.process.ask(topic, body, self.isolation.hang) {
            Ok(bytes) => (DONE, bytes),
            Err(refusal) => (REFUSED, &*refusal.0.into_bytes()),
        };
        // SAFETY: the bytes live during the call; the rest is passed on to the caller.
        unsafe { ((*sink).write)((*sink).context, bytes.as_ptr(), bytes.len()) };
        if self.process.end().is_some() {
            self.note();
        }
        code
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        let fault = self.process.end().filter(|_| !self.noted);
        self.isolation.account.ended(self.process.id(), fault);
        self.process.finish();
    }
}

/// Calls of a proxy; [`Apart`] describes and creates instances.
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
    // SAFETY: the host passes a proxy that `Apart` made, to one thread at a time, and a frame that is ready.
    unsafe { (*instance.cast::<Proxy>()).tick(&*frame) }
}

unsafe extern "C" fn save(instance: *const (), sink: *const Sink) -> i32 {
    // SAFETY: as for `tick`; nobody else uses it during the call.
    unsafe { (*instance.cast_mut().cast::<Proxy>()).ask(Topic::Save, &[], sink) }
}

unsafe extern "C" fn restore(instance: *mut (), state: Bytes, sink: *const Sink) -> i32 {
    // SAFETY: as for `tick`; the state lives during the call.
    unsafe { (*instance.cast::<Proxy>()).ask(Topic::Restore, state.as_slice(), sink) }
}

unsafe extern "C" fn may_unload(instance: *const (), sink: *const Sink) -> i32 {
    // SAFETY: as for `save`.
    unsafe { (*instance.cast_mut().cast::<Proxy>()).ask(Topic::MayUnload, &[], sink) }
}

unsafe extern "C" fn destroy(instance: *mut (), sink: *const Sink) -> i32 {
    // SAFETY: the host passes what `Apart` made, once.
    let mut proxy = unsafe { Box::from_raw(instance.cast::<Proxy>()) };
    if proxy.process.end().is_some() {
        return DONE;
    }
    // A module may have something to do at its end.
    // SAFETY: as for `describe`.
    unsafe { proxy.ask(Topic::Destroy, &[], sink) }
}
