//! Aspect [`Plugins`]: a thread of the host changes the agent on request.
//! A module makes the requests.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use slate_module::aspect::Plugins;
use slate_module::table::{Bytes, Sink};

use super::calls::{say, text};
use super::requests::{AnswerSlot, RequestAnswer, RequestBook};
use super::{HostService, ServiceContext, in_place};
use slate_engine::digest::Digest;

/// Changes the plugins of an agent for its modules.
pub(crate) trait PluginChanges: Send + Sync {
    /// Carries out a module's request, one of [`Plugins`]' requests.
    /// Returns the result in words, or the reason of a refusal.
    fn change_plugins(&self, module: &str, what: u32, plugin: &str) -> RequestAnswer;
}

/// Request with its module and the destination of its answer.
struct PluginRequest {
    change: RequestedChange,
    module: Arc<str>,
    answer: AnswerSlot,
}

/// Content of a module's request.
struct RequestedChange {
    /// Request, one of [`Plugins`]' requests.
    what: u32,
    plugin: String,
}

/// Changes of an agent on behalf of its modules.
#[derive(Default)]
pub(crate) struct PluginControl {
    changes: OnceLock<Box<dyn PluginChanges>>,
    /// Sender to the thread, once a module may send requests.
    requests: Mutex<Option<Sender<PluginRequest>>>,
    /// Counter of the list's changes, for a quick check in each tick.
    version: AtomicU64,
    list: Mutex<Arc<str>>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl PluginControl {
    /// Sets the implementation of the changes.
    pub fn connect(&self, changes: Box<dyn PluginChanges>) {
        // It is called once.
        let _ = self.changes.set(changes);
    }

    /// Sets the list that modules see from their next tick on.
    pub fn show(&self, list: String) {
        *locked(&self.list) = list.into();
        self.version.fetch_add(1, Ordering::Release);
    }

    /// Returns the channel to the thread, which is started if needed.
    /// The thread ends when no module can send requests any more.
    fn requests(self: &Arc<Self>) -> Option<Sender<PluginRequest>> {
        let mut requests = locked(&self.requests);
        if requests.is_none() {
            let (sender, receiver) = channel::<PluginRequest>();
            let control = Arc::downgrade(self);
            let work = move || {
                for request in receiver {
                    let control = control.upgrade();
                    let changes = control.as_ref().and_then(|control| control.changes.get());
                    let answer = changes.map_or(Err("the agent ends".into()), |changes| {
                        changes.change_plugins(&request.module, request.change.what, &request.change.plugin)
                    });
                    drop(control);
                    request.answer.give(answer);
                }
            };
            std::thread::Builder::new().name("plugins".into()).spawn(work).ok()?;
            *requests = Some(sender);
        }
        requests.clone()
    }
}

struct PluginService {
    table: Plugins,
    module: Arc<str>,
    control: Arc<PluginControl>,
    requests: Option<Sender<PluginRequest>>,
    book: RequestBook<RequestedChange>,
    seen: u64,
    list: Arc<str>,
}

// SAFETY: the table's context is the service itself, which only the thread that runs the module uses.
unsafe impl Send for PluginService {}

pub(super) fn make(service_context: &ServiceContext, module: &Arc<str>) -> Box<dyn HostService> {
    in_place(|context| PluginService {
        // SAFETY: the context is the service, in which the table stays; these are its calls.
        table: unsafe { Plugins::new(context, request, answer, list) },
        module: Arc::clone(module),
        control: Arc::clone(&service_context.plugins),
        requests: service_context.plugins.requests(),
        book: RequestBook::new(),
        seen: 0,
        list: "".into(),
    })
}

impl HostService for PluginService {
    fn table(&self) -> *const u8 {
        (&raw const self.table).cast()
    }

    fn prepare(&mut self, _: u64) {
        self.book.receive();
        let version = self.control.version.load(Ordering::Acquire);
        // A change that is under way is seen by the next tick.
        if version != self.seen
            && let Ok(list) = self.control.list.try_lock()
        {
            self.list = Arc::clone(&list);
            self.seen = version;
        }
    }

    fn commit(&mut self, _: u64, _: Option<&mut Digest>) {
        let (module, requests) = (&self.module, &self.requests);
        self.book.commit(|change, answer| {
            let request = PluginRequest { change, module: Arc::clone(module), answer };
            let unsent = match requests {
                Some(requests) => requests.send(request).err().map(|error| error.0),
                None => Some(request),
            };
            if let Some(request) = unsent {
                request.answer.give(Err("the host has no thread for it".into()));
            }
        });
    }

    fn abandon(&mut self) {
        self.book.abandon();
    }
}

unsafe extern "C" fn request(context: *mut (), what: u32, plugin: Bytes) -> u64 {
    // SAFETY: the context is the service, which the module's tick uses alone; the name lives during the call.
    let (service, plugin) = unsafe { (&mut *context.cast::<PluginService>(), text(plugin)) };
    service.book.push(RequestedChange { what, plugin })
}

unsafe extern "C" fn answer(context: *mut (), number: u64, sink: *const Sink) -> i32 {
    // SAFETY: as for `request`, and the sink lives during the call.
    unsafe { (*context.cast::<PluginService>()).book.answer(number, sink) }
}

unsafe extern "C" fn list(context: *mut (), sink: *const Sink) {
    // SAFETY: as for `answer`.
    unsafe { say(sink, &(*context.cast::<PluginService>()).list) }
}
