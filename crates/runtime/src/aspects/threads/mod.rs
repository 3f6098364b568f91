//! Aspect [`Threads`]: threads that a module owns and the host keeps.

mod registry;
mod ring;
mod thread;

use std::sync::Arc;

use slate_module::ModuleKind;
use slate_module::aspect::{ABSENT, FULL, ThreadBody, ThreadState, Threads};
use slate_module::table::{Bytes, DONE, Sink};
use slate_sorted::SortedMap;

use super::calls::{name, text};
use super::{HostService, ServiceContext, in_place};
use registry::ThreadGroup;
pub(crate) use registry::{AbandonedThread, Closed, ThreadRegistry};
use ring::{RingInlet, RingOutlet, ring};
use slate_engine::clock::Clock;
use slate_engine::digest::Digest;
use slate_engine::log::Logger;
use slate_engine::synchronization::Synchronization;
use thread::{ModuleThread, OwnedBody, ThreadParts, answer, room};

/// Most threads of a module at a time.
const LIMIT: usize = 16;
/// The largest ring, bytes.
const LARGEST: usize = 1 << 30;

struct ThreadService {
    table: Threads,
    module: Arc<str>,
    registry: Arc<ThreadRegistry>,
    group: Arc<ThreadGroup>,
    logger: Arc<Logger>,
    clock: Arc<Clock>,
    synchronization: Arc<Synchronization>,
    /// The module's code.
    kind: Option<ModuleKind>,
    /// Threads by name, also those that have ended.
    threads: SortedMap<String, TickThread>,
    /// Threads that this tick requests.
    requested: SortedMap<String, TickThread>,
}

/// Thread, from the tick's side.
struct TickThread {
    thread: Arc<ModuleThread>,
    /// Parts of the thread until it begins.
    life: Option<Box<ThreadParts>>,
    /// True if this tick stops it.
    stop: bool,
    inlet: RingInlet,
    outlet: RingOutlet,
}

// SAFETY: the table's context is the service itself, which only the thread that runs the module uses.
unsafe impl Send for ThreadService {}

pub(super) fn make(service_context: &ServiceContext, module: &Arc<str>) -> Box<dyn HostService> {
    in_place(|context| ThreadService {
        // SAFETY: the context is the service, in which the table stays; these are its calls.
        table: unsafe { Threads::new(context, spawn, state, stop, send, receive) },
        module: Arc::clone(module),
        registry: Arc::clone(&service_context.threads),
        group: service_context.threads.group(module),
        logger: Arc::clone(&service_context.logger),
        clock: Arc::clone(&service_context.clock),
        synchronization: Arc::clone(&service_context.synchronization),
        kind: None,
        threads: SortedMap::new(),
        requested: SortedMap::new(),
    })
}

impl HostService for ThreadService {
    fn table(&self) -> *const u8 {
        (&raw const self.table).cast()
    }

    fn begin(&mut self, kind: &ModuleKind) {
        self.end();
        self.kind = Some(kind.clone());
    }

    fn prepare(&mut self, _: u64) {
        self.threads.values_mut().for_each(|own| own.outlet.collect());
    }

    fn commit(&mut self, _: u64, _: Option<&mut Digest>) {
        self.threads.append(&mut self.requested);
        for own in self.threads.values_mut() {
            if let Some(life) = own.life.take() {
                own.life = self.registry.start(&self.group, life).err();
            }
            if own.inlet.send() {
                own.thread.request_stop();
            }
            if std::mem::take(&mut own.stop) {
                own.thread.stop();
            }
        }
    }

    fn abandon(&mut self) {
        self.requested.clear();
        for own in self.threads.values_mut() {
            own.inlet.forget();
            own.stop = false;
        }
    }

    fn end(&mut self) {
        // Unstarted threads are dropped with their code, and running ones belong to an ended instance.
        self.requested.clear();
        self.threads.clear();
        self.registry.stop(&self.group);
    }
}

impl Drop for ThreadService {
    fn drop(&mut self) {
        self.end();
        self.registry.forget(&self.group);
    }
}

impl ThreadService {
    fn spawn(&mut self, name: &str, bytes: usize, body: OwnedBody) -> Result<(), String> {
        let is_part = |byte: u8| byte.is_ascii_alphanumeric() || b"_-".contains(&byte);
        if name.is_empty() || name.len() > 64 || !name.bytes().all(is_part) {
            return Err(format!(
                "`{name}` is not a name of a thread: expected up to 64 letters, digits, `_` and `-`"
            ));
        }
        if bytes > LARGEST {
            return Err(format!("rings of {bytes} bytes are too large: at most {LARGEST}"));
        }
        if self.state(name) == ThreadState::Running as u32 {
            return Err(format!("the thread `{name}` runs already, or has not ended yet"));
        }
        let threads = self.threads.values().chain(self.requested.values());
        let running = threads.filter(|own| own.thread.is_running()).count();
        if running >= LIMIT {
            return Err(format!("no room for the thread `{name}`: there are {LIMIT}, which is the limit"));
        }
        let Some(kind) = self.kind.clone() else { return Err("the module has not begun".into()) };
        let thread = ModuleThread::new(name);
        let (inlet, outlet_of_thread) = ring(bytes);
        let (inlet_of_thread, outlet) = ring(bytes);
        let life = ThreadParts {
            thread: Arc::clone(&thread),
            body,
            inlet: inlet_of_thread,
            outlet: outlet_of_thread,
            log: self.logger.module(&self.module, false, &self.clock),
            clock: Arc::clone(&self.clock),
            synchronization: Arc::clone(&self.synchronization),
            module: Arc::clone(&self.module),
            kind,
        };
        let own = TickThread { thread, life: Some(Box::new(life)), stop: false, inlet, outlet };
        self.requested.insert(name.into(), own);
        Ok(())
    }

    fn state(&self, name: &str) -> u32 {
        match self.requested.get(name).or_else(|| self.threads.get(name)) {
            Some(own) => own.thread.state(),
            // One of an earlier instance may not have ended yet.
            None if self.group.has(name) => ThreadState::Running as u32,
            None => ThreadState::Absent as u32,
        }
    }

    fn own(&mut self, name: &str) -> Result<&mut TickThread, String> {
        let own = self.requested.get_mut(name).or_else(|| self.threads.get_mut(name));
        own.ok_or_else(|| format!("no thread `{name}` was begun"))
    }
}

/// # Safety
/// The context is a service, which the module's tick uses alone, in one call at a time.
unsafe fn service<'a>(context: *mut ()) -> &'a mut ThreadService {
    // SAFETY: passed on to the caller.
    unsafe { &mut *context.cast::<ThreadService>() }
}

unsafe extern "C" fn spawn(
    context: *mut (),
    name: Bytes,
    bytes: usize,
    body: ThreadBody,
    sink: *const Sink,
) -> i32 {
    // SAFETY: the module gives the body away; its code stays as long as the service or the thread that has it.
    unsafe {
        let spawned = service(context).spawn(&text(name), bytes, OwnedBody::new(body));
        answer(spawned.map(|()| true), DONE, sink)
    }
}

unsafe extern "C" fn state(context: *mut (), thread: Bytes) -> u32 {
    // SAFETY: the context is the service, and the name lives during the call.
    unsafe { service(context).state(name(thread)) }
}

unsafe extern "C" fn stop(context: *mut (), thread: Bytes) {
    // SAFETY: as for `state`.
    if let Ok(own) = unsafe { service(context).own(name(thread)) } {
        own.stop = true;
    }
}

unsafe extern "C" fn send(
    context: *mut (),
    thread: Bytes,
    schema: u64,
    value: Bytes,
    sink: *const Sink,
) -> i32 {
    // SAFETY: as for `state`, and all else lives during the call.
    unsafe {
        let name = name(thread);
        let sent = service(context).own(name).and_then(|own| {
            if own.thread.is_running() {
                own.inlet.add(schema, value.as_slice())
            } else {
                Err(format!("the thread `{name}` has ended"))
            }
        });
        answer(sent, FULL, sink)
    }
}

unsafe extern "C" fn receive(
    context: *mut (),
    thread: Bytes,
    schema: u64,
    value: *mut u8,
    size: usize,
    sink: *const Sink,
) -> i32 {
    // SAFETY: as for `send`, and there is room for a value of that size.
    unsafe {
        let own = service(context).own(name(thread));
        answer(own.and_then(|own| own.outlet.take(schema, room(value, size))), ABSENT, sink)
    }
}
