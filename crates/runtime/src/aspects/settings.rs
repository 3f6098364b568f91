//! Aspect [`Settings`]: changes of the configuration on a module's request.
//! The host makes them between two cycles.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use slate_module::aspect::Settings;
use slate_module::table::{Bytes, Sink};

use super::calls::text;
use super::requests::{AnswerSlot, RequestAnswer, RequestBook};
use super::{HostService, ServiceContext, in_place};
use slate_engine::digest::Digest;
use slate_engine::main_loop::RequestedChanges;

/// Changes the configuration of an agent for its modules.
pub(crate) trait SettingsChanges: Send + Sync {
    /// Makes the changes of the lines, or returns the answer that was recorded.
    /// The answer is in words.
    fn change_settings(&self, module: &str, lines: &str) -> RequestAnswer;
}

/// Request with its module and the destination of its answer.
struct SettingsRequest {
    lines: String,
    module: Arc<str>,
    answer: AnswerSlot,
}

/// Changes of the configuration on behalf of modules.
pub(crate) struct SettingsControl {
    changes: OnceLock<Box<dyn SettingsChanges>>,
    /// True in lockstep.
    /// The loop itself then makes the changes, so that they hold from the same cycle on in each run.
    lockstep: bool,
    is_requested: AtomicBool,
    requests: Mutex<Vec<SettingsRequest>>,
    /// Lock during changes, which keeps them in the order of their requests.
    turn: Mutex<()>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl SettingsControl {
    pub fn new(lockstep: bool) -> Arc<Self> {
        let (changes, requests, turn) = (OnceLock::new(), Mutex::default(), Mutex::default());
        Arc::new(Self { changes, lockstep, is_requested: AtomicBool::new(false), requests, turn })
    }

    /// Sets the implementation of the changes.
    pub fn connect(&self, changes: Box<dyn SettingsChanges>) {
        // It is called once.
        let _ = self.changes.set(changes);
    }

    fn request(self: &Arc<Self>, request: SettingsRequest) {
        locked(&self.requests).push(request);
        self.is_requested.store(true, Ordering::Release);
        if !self.lockstep {
            let control = Arc::clone(self);
            let thread = std::thread::Builder::new().name("settings".into());
            if thread.spawn(move || control.apply(&mut || ())).is_err() {
                // Without a thread nothing can be changed now.
                for request in locked(&self.requests).drain(..) {
                    request.answer.give(Err("the host has no thread for it".into()));
                }
            }
        }
    }
}

impl RequestedChanges for SettingsControl {
    fn is_pending(&self) -> bool {
        self.is_requested.load(Ordering::Acquire)
    }

    fn apply(&self, before: &mut dyn FnMut()) {
        let _turn = locked(&self.turn);
        self.is_requested.store(false, Ordering::Relaxed);
        // A change waits until no module runs, and one that runs may ask meanwhile: nothing is locked for that long.
        let requests = std::mem::take(&mut *locked(&self.requests));
        for request in requests {
            before();
            let answer = self.changes.get().map_or(Err("the agent ends".into()), |changes| {
                changes.change_settings(&request.module, &request.lines)
            });
            request.answer.give(answer);
        }
    }
}

struct SettingsService {
    table: Settings,
    module: Arc<str>,
    control: Arc<SettingsControl>,
    book: RequestBook<String>,
}

// SAFETY: the table's context is the service itself, which only the thread that runs the module uses.
unsafe impl Send for SettingsService {}

pub(super) fn make(service_context: &ServiceContext, module: &Arc<str>) -> Box<dyn HostService> {
    in_place(|context| SettingsService {
        // SAFETY: the context is the service, in which the table stays; these are its calls.
        table: unsafe { Settings::new(context, request, answer) },
        module: Arc::clone(module),
        control: Arc::clone(&service_context.settings),
        book: RequestBook::new(),
    })
}

impl HostService for SettingsService {
    fn table(&self) -> *const u8 {
        (&raw const self.table).cast()
    }

    fn prepare(&mut self, _: u64) {
        self.book.receive();
    }

    fn commit(&mut self, _: u64, _: Option<&mut Digest>) {
        let (module, control) = (&self.module, &self.control);
        self.book.commit(|lines, answer| {
            control.request(SettingsRequest { lines, module: Arc::clone(module), answer });
        });
    }

    fn abandon(&mut self) {
        self.book.abandon();
    }
}

unsafe extern "C" fn request(context: *mut (), lines: Bytes) -> u64 {
    // SAFETY: the context is the service, which the module's tick uses alone; the text lives during the call.
    let (service, lines) = unsafe { (&mut *context.cast::<SettingsService>(), text(lines)) };
    service.book.push(lines)
}

unsafe extern "C" fn answer(context: *mut (), number: u64, sink: *const Sink) -> i32 {
    // SAFETY: as for `request`, and the sink lives during the call.
    unsafe { (*context.cast::<SettingsService>()).book.answer(number, sink) }
}
