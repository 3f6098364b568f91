//! The aspect [`Settings`](aspect::Settings): a module asks, and the host changes the configuration between two cycles.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use slate_module::aspect::{ABSENT, PENDING, Settings};
use slate_module::table::{Bytes, DONE, REFUSED, Sink};

use super::calls::{say, text};
use super::{HostService, Means};
use crate::digest::Digest;
use crate::main_loop::AskedChanges;

/// How many requests of a module are known.
const KNOWN: usize = 64;

/// What came of a request.
type Answer = Result<String, String>;

/// Changes the configuration of an agent for its modules.
pub(crate) trait SettingsChanges: Send + Sync {
    /// Makes the changes of those lines, or gives the answer that was recorded; in words what came of it.
    fn change_settings(&self, module: &str, lines: &str) -> Answer;
}

struct Request {
    number: u64,
    lines: String,
    module: Arc<str>,
    answers: Sender<(u64, Answer)>,
}

/// What changes the configuration for modules.
pub(crate) struct SettingsControl {
    changes: OnceLock<Box<dyn SettingsChanges>>,
    /// In lockstep the loop itself makes the changes, so that they hold from the same cycle on in each run.
    lockstep: bool,
    asked: AtomicBool,
    requests: Mutex<Vec<Request>>,
    /// Whoever makes changes has it, so that they are made in the order in which they were asked for.
    turn: Mutex<()>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl SettingsControl {
    pub fn new(lockstep: bool) -> Arc<Self> {
        let (changes, requests, turn) = (OnceLock::new(), Mutex::default(), Mutex::default());
        Arc::new(Self { changes, lockstep, asked: AtomicBool::new(false), requests, turn })
    }

    /// What the changes go through.
    pub fn connect(&self, changes: Box<dyn SettingsChanges>) {
        // It is called once.
        let _ = self.changes.set(changes);
    }

    fn ask(self: &Arc<Self>, request: Request) {
        locked(&self.requests).push(request);
        self.asked.store(true, Ordering::Release);
        if !self.lockstep {
            let control = Arc::clone(self);
            let thread = std::thread::Builder::new().name("settings".into());
            if thread.spawn(move || control.carry_out()).is_err() {
                // Without a thread nothing can be changed now.
                for request in locked(&self.requests).drain(..) {
                    let _ =
                        request.answers.send((request.number, Err("the host has no thread for it".into())));
                }
            }
        }
    }
}

impl AskedChanges for SettingsControl {
    fn is_asked(&self) -> bool {
        self.asked.load(Ordering::Acquire)
    }

    fn carry_out(&self) {
        let _turn = locked(&self.turn);
        self.asked.store(false, Ordering::Relaxed);
        // A change waits until no module runs, and one that runs may ask meanwhile: nothing is locked for that long.
        let requests = std::mem::take(&mut *locked(&self.requests));
        for request in requests {
            let answer = self.changes.get().map_or(Err("the agent ends".into()), |changes| {
                changes.change_settings(&request.module, &request.lines)
            });
            // Who asked may be gone.
            let _ = request.answers.send((request.number, answer));
        }
    }
}

struct Service {
    table: Settings,
    module: Arc<str>,
    control: Arc<SettingsControl>,
    /// What this tick asked for.
    asked: Vec<(u64, String)>,
    /// Requests by number; nothing for those that are not done.
    known: BTreeMap<u64, Option<Answer>>,
    last: u64,
    sender: Sender<(u64, Answer)>,
    answers: Receiver<(u64, Answer)>,
}

// SAFETY: the table's context is the service itself, which is used by whoever runs the module alone.
unsafe impl Send for Service {}

pub(super) fn make(means: &Means, module: &Arc<str>) -> Box<dyn HostService> {
    let (sender, answers) = channel();
    let mut service = Box::new(Service {
        table: Settings { context: std::ptr::null_mut(), ask, answer },
        module: Arc::clone(module),
        control: Arc::clone(&means.settings),
        asked: Vec::new(),
        known: BTreeMap::new(),
        last: 0,
        sender,
        answers,
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
    }

    fn commit(&mut self, _: u64, _: Option<&mut Digest>) {
        for (number, lines) in self.asked.drain(..) {
            self.known.insert(number, None);
            if self.known.len() > KNOWN {
                self.known.pop_first();
            }
            let (module, answers) = (Arc::clone(&self.module), self.sender.clone());
            self.control.ask(Request { number, lines, module, answers });
        }
    }

    fn abandon(&mut self) {
        self.asked.clear();
    }
}

unsafe extern "C" fn ask(context: *mut (), lines: Bytes) -> u64 {
    // SAFETY: the context is the service, which the module's tick uses alone; the text lives during the call.
    let (service, lines) = unsafe { (&mut *context.cast::<Service>(), text(lines)) };
    service.last += 1;
    service.asked.push((service.last, lines));
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
            None if service.asked.iter().any(|(asked, _)| *asked == number) => PENDING,
            None => ABSENT,
        }
    }
}
