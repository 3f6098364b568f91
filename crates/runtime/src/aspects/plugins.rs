//! The aspect [`Plugins`](aspect::Plugins): a module asks, and a thread of the host changes the agent.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use slate_module::aspect::{ABSENT, PENDING, Plugins};
use slate_module::table::{Bytes, DONE, REFUSED, Sink};

use super::calls::{say, text};
use super::{HostService, Means};
use crate::digest::Digest;

/// How many requests of a module are known.
const KNOWN: usize = 64;

/// What came of a request.
pub(crate) type Answer = Result<String, String>;

/// Changes the plugins of an agent for its modules.
pub(crate) trait PluginChanges: Send + Sync {
    /// Does what a module asks for, one of [`Plugins`]' requests; in words what came of it, or why it was refused.
    fn change_plugins(&self, module: &str, what: u32, plugin: &str) -> Answer;
}

struct Request {
    number: u64,
    what: u32,
    plugin: String,
    module: Arc<str>,
    answers: Sender<(u64, Answer)>,
}

/// What changes an agent for its modules.
#[derive(Default)]
pub(crate) struct PluginControl {
    changes: OnceLock<Box<dyn PluginChanges>>,
    /// To the thread, once there is a module that may ask.
    requests: Mutex<Option<Sender<Request>>>,
    /// Counts changes of the list, so that a tick sees with one look that there was none.
    version: AtomicU64,
    list: Mutex<Arc<str>>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl PluginControl {
    /// What the changes go through.
    pub fn connect(&self, changes: Box<dyn PluginChanges>) {
        // It is called once.
        let _ = self.changes.set(changes);
    }

    /// The list that modules see from their next tick on.
    pub fn show(&self, list: String) {
        *locked(&self.list) = list.into();
        self.version.fetch_add(1, Ordering::Release);
    }

    /// The way to the thread, which is started if need be, and ends when no module can ask any more.
    fn requests(self: &Arc<Self>) -> Option<Sender<Request>> {
        let mut requests = locked(&self.requests);
        if requests.is_none() {
            let (sender, receiver) = channel::<Request>();
            let control = Arc::downgrade(self);
            let work = move || {
                for request in receiver {
                    let control = control.upgrade();
                    let changes = control.as_ref().and_then(|control| control.changes.get());
                    let answer = changes.map_or(Err("the agent ends".into()), |changes| {
                        changes.change_plugins(&request.module, request.what, &request.plugin)
                    });
                    drop(control);
                    // Who asked may be gone.
                    let _ = request.answers.send((request.number, answer));
                }
            };
            std::thread::Builder::new().name("plugins".into()).spawn(work).ok()?;
            *requests = Some(sender);
        }
        requests.clone()
    }
}

struct Service {
    table: Plugins,
    module: Arc<str>,
    control: Arc<PluginControl>,
    requests: Option<Sender<Request>>,
    /// What this tick asked for.
    asked: Vec<Request>,
    /// Requests by number; nothing for those that are not done.
    known: BTreeMap<u64, Option<Answer>>,
    last: u64,
    sender: Sender<(u64, Answer)>,
    answers: Receiver<(u64, Answer)>,
    seen: u64,
    list: Arc<str>,
}

// SAFETY: the table's context is the service itself, which is used by whoever runs the module alone.
unsafe impl Send for Service {}

pub(super) fn make(means: &Means, module: &Arc<str>) -> Box<dyn HostService> {
    let (sender, answers) = channel();
    let mut service = Box::new(Service {
        table: Plugins { context: std::ptr::null_mut(), ask, answer, list },
        module: Arc::clone(module),
        control: Arc::clone(&means.plugins),
        requests: means.plugins.requests(),
        asked: Vec::new(),
        known: BTreeMap::new(),
        last: 0,
        sender,
        answers,
        seen: 0,
        list: "".into(),
    });
    service.table.context = (&raw mut *service).cast();
    service
}

impl HostService for Service {
    fn table(&self) -> *const u8 {
        (&raw const self.table).cast()
    }

    fn prepare(&mut self, _: u64) {
        while let Ok((number, answer)) = self.answers.try_recv() {
            self.known.entry(number).and_modify(|known| *known = Some(answer));
        }
        let version = self.control.version.load(Ordering::Acquire);
        // Who changes it now will be seen by the next tick.
        if version != self.seen
            && let Ok(list) = self.control.list.try_lock()
        {
            self.list = Arc::clone(&list);
            self.seen = version;
        }
    }

    fn commit(&mut self, _: u64, _: Option<&mut Digest>) {
        for request in self.asked.drain(..) {
            let number = request.number;
            let sent = self.requests.as_ref().is_some_and(|requests| requests.send(request).is_ok());
            let answer = (!sent).then(|| Err("the host has no thread for it".to_owned()));
            self.known.insert(number, answer);
            if self.known.len() > KNOWN {
                self.known.pop_first();
            }
        }
    }

    fn abandon(&mut self) {
        self.asked.clear();
    }
}

unsafe extern "C" fn ask(context: *mut (), what: u32, plugin: Bytes) -> u64 {
    // SAFETY: the context is the service, which the module's tick uses alone; the name lives during the call.
    let (service, plugin) = unsafe { (&mut *context.cast::<Service>(), text(plugin)) };
    service.last += 1;
    let (module, answers) = (Arc::clone(&service.module), service.sender.clone());
    service.asked.push(Request { number: service.last, what, plugin, module, answers });
    service.last
}

unsafe extern "C" fn answer(context: *mut (), number: u64, sink: *const Sink) -> i32 {
    // SAFETY: as for `ask`, and the sink lives during the call.
    unsafe {
        let service = &*context.cast::<Service>();
        match service.known.get(&number) {
            Some(Some(Ok(text))) => {
                say(sink, text);
                DONE
            }
            Some(Some(Err(reason))) => {
                say(sink, reason);
                REFUSED
            }
            Some(None) => PENDING,
            None if service.asked.iter().any(|request| request.number == number) => PENDING,
            None => ABSENT,
        }
    }
}

unsafe extern "C" fn list(context: *mut (), sink: *const Sink) {
    // SAFETY: as for `answer`.
    unsafe { say(sink, &(*context.cast::<Service>()).list) }
}
