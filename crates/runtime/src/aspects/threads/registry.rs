//! Keeper of modules' threads; no code is unloaded while a thread runs it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use slate_module::Level;
use slate_module::aspect::ThreadState;
use slate_sorted::SortedMap;

use super::thread::{ModuleThread, ThreadParts};
use slate_engine::clock::Clock;
use slate_engine::log::Logger;
use slate_engine::thread_name;

/// Polling interval for the end of threads.
const POLL_PERIOD: Duration = Duration::from_micros(500);

/// Threads of all modules.
pub(crate) struct ThreadRegistry {
    groups: Mutex<SortedMap<Arc<str>, Arc<ThreadGroup>>>,
    /// Time limit for a thread to stop.
    hang: Duration,
    lockstep: bool,
    /// True once the log warns that threads can't be reproduced.
    warned: AtomicBool,
    logger: Arc<Logger>,
    clock: Arc<Clock>,
}

/// The threads of a module.
pub(super) struct ThreadGroup {
    module: Arc<str>,
    inner: Mutex<GroupThreads>,
}

#[derive(Default)]
struct GroupThreads {
    /// Number of guards that keep threads from beginning.
    closed: u32,
    owned: Vec<OwnedThread>,
}

struct OwnedThread {
    thread: Arc<ModuleThread>,
    handle: JoinHandle<()>,
    /// True if the log has named it as a thread that does not stop.
    named: bool,
}

/// Thread that has not stopped.
#[derive(Clone, Debug)]
pub(crate) struct AbandonedThread {
    pub module: Arc<str>,
    pub thread: Arc<str>,
    /// Time waited.
    pub limit: Duration,
}

/// Guard that keeps some modules from beginning threads.
pub(crate) struct Closed(Vec<Arc<ThreadGroup>>);

impl Drop for Closed {
    fn drop(&mut self) {
        self.0.iter().for_each(|group| group.inner().closed -= 1);
    }
}

impl ThreadRegistry {
    pub fn new(hang: Duration, lockstep: bool, logger: &Arc<Logger>, clock: &Arc<Clock>) -> Arc<Self> {
        Arc::new(Self {
            groups: Mutex::default(),
            hang,
            lockstep,
            warned: AtomicBool::new(false),
            logger: Arc::clone(logger),
            clock: Arc::clone(clock),
        })
    }

    fn groups(&self) -> MutexGuard<'_, SortedMap<Arc<str>, Arc<ThreadGroup>>> {
        self.groups.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes the thread group of a new module.
    pub(super) fn group(&self, module: &Arc<str>) -> Arc<ThreadGroup> {
        let group = Arc::new(ThreadGroup { module: Arc::clone(module), inner: Mutex::default() });
        self.groups().insert(Arc::clone(module), Arc::clone(&group));
        group
    }

    /// Stops the threads of modules before their code is unloaded.
    /// No thread of them begins until the result is dropped.
    ///
    /// # Errors
    /// A thread that does not stop in time; others may begin again then.
    pub fn close(&self, modules: &[String]) -> Result<Closed, AbandonedThread> {
        let groups = self.groups();
        let closed = modules.iter().filter_map(|module| groups.get(module.as_str()).cloned()).collect();
        drop(groups);
        let closed = close(closed);
        match lingering(&closed.0, self.hang).into_iter().next() {
            None => Ok(closed),
            Some(lingering) => Err(lingering),
        }
    }

    /// Stops all threads finally; the log names those that do not stop in time.
    pub fn end(&self) {
        let groups: Vec<_> = self.groups().values().cloned().collect();
        // For good, beside what the guard does.
        groups.iter().for_each(|group| group.inner().closed += 1);
        self.name(&lingering(&close(groups).0, self.hang));
    }

    /// Begins a thread; returns it while none may begin.
    pub(super) fn start(&self, group: &ThreadGroup, life: Box<ThreadParts>) -> Result<(), Box<ThreadParts>> {
        let mut inner = group.inner();
        if inner.closed > 0 {
            return Err(life);
        }
        if self.lockstep && !self.warned.swap(true, Ordering::Relaxed) {
            let text = format!(
                "{} begins the thread `{}`: what threads of modules do can't be repeated, so from here on neither can \
                 the run",
                group.module, life.thread.name
            );
            self.logger.log(self.clock.now(), Level::Warn, &text);
        }
        let thread = Arc::clone(&life.thread);
        let name = thread_name(&format!("{}/{}", group.module, thread.name));
        match std::thread::Builder::new().name(name).spawn(move || life.live()) {
            Ok(handle) => {
                inner.owned.retain(|owned| !owned.handle.is_finished());
                inner.owned.push(OwnedThread { thread, handle, named: false });
            }
            Err(error) => {
                thread.set(ThreadState::Ended);
                let text =
                    format!("the thread `{}` of {} can't be started: {error}", thread.name, group.module);
                self.logger.log(self.clock.now(), Level::Error, &text);
            }
        }
        Ok(())
    }

    /// Stops the threads of a module whose instance has ended.
    /// Threads that do not stop are logged.
    pub(super) fn stop(self: &Arc<Self>, group: &Arc<ThreadGroup>) {
        if !group.stop() {
            return;
        }
        let (registry, group) = (Arc::clone(self), Arc::clone(group));
        // Not here: it may be a tick that failed. Without another thread no name is given; all else is the same.
        let _ = std::thread::Builder::new()
            .name("threads".into())
            .spawn(move || registry.name(&lingering(&[group], registry.hang)));
    }

    /// Removes the threads of a module that has ended.
    pub(super) fn forget(&self, group: &Arc<ThreadGroup>) {
        self.groups().retain(|_, other| !Arc::ptr_eq(other, group));
    }

    fn name(&self, lingering: &[AbandonedThread]) {
        for AbandonedThread { module, thread, limit } in lingering {
            let text = format!(
                "the thread `{thread}` of {module} has not ended within {limit:?} after the stop request; it is \
                 abandoned, and its code stays in memory"
            );
            self.logger.log(self.clock.now(), Level::Error, &text);
        }
    }
}

impl ThreadGroup {
    fn inner(&self) -> MutexGuard<'_, GroupThreads> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns true if a thread of that name still runs.
    pub fn has(&self, name: &str) -> bool {
        self.inner().owned.iter().any(|owned| *owned.thread.name == *name && owned.thread.is_running())
    }

    /// Stops the threads; true if one that was not named yet still runs.
    fn stop(&self) -> bool {
        let inner = self.inner();
        inner.owned.iter().for_each(|owned| owned.thread.stop());
        inner.owned.iter().any(|owned| !owned.named && !owned.handle.is_finished())
    }

    /// Removes the threads that have ended; true if any is left.
    fn settle(&self) -> bool {
        let mut inner = self.inner();
        let (ended, left) =
            std::mem::take(&mut inner.owned).into_iter().partition(|owned| owned.handle.is_finished());
        inner.owned = left;
        let is_left = !inner.owned.is_empty();
        drop(inner);
        let ended: Vec<OwnedThread> = ended;
        // So that what the thread cleans up at its very end is done, too. A panic did not leave the module's code.
        ended.into_iter().for_each(|owned| drop(owned.handle.join()));
        is_left
    }
}

fn close(groups: Vec<Arc<ThreadGroup>>) -> Closed {
    for group in &groups {
        group.inner().closed += 1;
        group.stop();
    }
    Closed(groups)
}

/// Waits until the threads have ended; returns those that do not in time.
#[allow(clippy::disallowed_methods, reason = "whether a thread ends is a matter of the wall clock")]
fn lingering(groups: &[Arc<ThreadGroup>], limit: Duration) -> Vec<AbandonedThread> {
    let start = Instant::now();
    while groups.iter().filter(|group| group.settle()).count() > 0 {
        if start.elapsed() >= limit {
            break;
        }
        std::thread::sleep(POLL_PERIOD);
    }
    let mut lingering = Vec::new();
    for group in groups {
        for owned in &mut group.inner().owned {
            owned.named = true;
            let (module, thread) = (Arc::clone(&group.module), Arc::clone(&owned.thread.name));
            lingering.push(AbandonedThread { module, thread, limit });
        }
    }
    lingering
}
