//! The thread in which values arrive, and that encodes and writes them.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Mutex};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use slate_blackboard::Stamp;
use slate_module::Level;
use slate_runtime::configuration::{Flight as FlightSettings, FlightTrigger};
use slate_runtime::recording::FlightEntry;
use slate_sorted::SortedMap;

use super::channels::Channel;
use super::flight::{Captured, Flight};
use super::host::Host;
use super::hub::{ChannelFilter, Drain, Hub, Sink};
use super::lock::lock;
use super::save::{Save, Saves};
use super::state::RecordStateOutput;
use super::target::{ActiveRecording, Progress};
use super::trigger::Triggers;

/// Polling period for values.
const POLL_PERIOD: Duration = Duration::from_millis(2);

/// Polling period while values are only kept in memory and no thread waits.
const LIGHT_POLL_PERIOD: Duration = Duration::from_millis(10);

/// Polling period while no value is wanted.
const IDLE_POLL_PERIOD: Duration = Duration::from_millis(500);

/// Period of the published state, and of the check for drops.
const STATE_PERIOD: Duration = Duration::from_millis(100);

/// Maximum time that a stalled disk delays the end of a run.
const STALL_TIMEOUT: Duration = Duration::from_secs(20);

/// A request to the thread.
pub(super) enum ThreadRequest {
    /// Continues a recording that has begun.
    Add(Box<ActiveRecording>),
    /// Returns a recording with everything written until now; `None` when it is gone.
    Remove(u64, SyncSender<Option<Box<ActiveRecording>>>),
    /// Returns the last seconds; `None` if none are kept.
    Capture(SyncSender<Option<Captured>>),
    /// Answers when everything handed over is in the hands of the system.
    Settle(SyncSender<()>),
}

/// The thread, as other threads see it.
#[derive(Default)]
pub(super) struct ThreadHandle {
    requests: Mutex<Vec<ThreadRequest>>,
    /// Lock held while values are taken out, or a recording is begun.
    pub taking: Mutex<()>,
    is_over: AtomicBool,
    /// Progress of the recordings, oldest first.
    pub recordings: Mutex<Vec<Arc<Progress>>>,
    pub flight: Mutex<Option<FlightEntry>>,
    /// Output of the published state, once anything was recorded.
    pub shown: Mutex<Option<RecordStateOutput>>,
}

/// The thread of a recorder.
pub(super) struct Thread {
    /// Taken at the end.
    thread: Option<JoinHandle<Vec<ActiveRecording>>>,
    pub shared: Arc<ThreadHandle>,
    hub: Arc<Hub>,
}

/// The initial state of the thread.
pub(super) struct ThreadSetup {
    pub hub: Arc<Hub>,
    pub host: Arc<Host>,
    pub shared: Arc<ThreadHandle>,
    pub targets: Vec<ActiveRecording>,
    pub flight: FlightSettings,
    /// The values of the last seconds.
    pub wants: ChannelFilter,
    pub saves: Arc<Saves>,
}

impl Thread {
    pub fn start(setup: ThreadSetup) -> std::io::Result<Self> {
        let ThreadSetup { hub, host, shared, targets, flight, wants, saves } = setup;
        let work = RecorderWork {
            hub: Arc::clone(&hub),
            host,
            shared: Arc::clone(&shared),
            drain: Drain::default(),
            sinks: Sinks {
                targets,
                triggers: Triggers::new(if flight.enabled { &flight.triggers } else { &[] }),
                flight: Flight::new(&flight, wants),
                fired: Vec::new(),
            },
            settings: flight,
            last_saved: SortedMap::new(),
            saves,
            skipped: 0,
            settling: Vec::new(),
        };
        let thread = Builder::new().name("record".into()).spawn(move || {
            slate_runtime::set_batch_scheduling();
            work.run_safely()
        })?;
        Ok(Self { thread: Some(thread), shared, hub })
    }

    pub fn handle(&self) -> Option<std::thread::Thread> {
        self.thread.as_ref().map(|thread| thread.thread().clone())
    }

    /// Waits until everything handed over is written, and returns the recordings.
    pub fn end(&mut self) -> Vec<ActiveRecording> {
        let Some(thread) = self.thread.take() else { return Vec::new() };
        self.hub.stop();
        self.shared.is_over.store(true, Ordering::Release);
        thread.thread().unpark();
        // The last owner of an agent may be this thread, which can't join itself.
        if thread.thread().id() == std::thread::current().id() {
            return Vec::new();
        }
        thread.join().unwrap_or_default()
    }
}

impl Drop for Thread {
    fn drop(&mut self) {
        // Without an end a file says nothing of the run's, and is whole all the same.
        drop(self.end());
    }
}

impl ThreadHandle {
    /// Sends an order; the caller wakes the thread. False when the thread has ended.
    pub fn request(&self, request: ThreadRequest) -> bool {
        let mut requests = lock(&self.requests);
        if self.is_over.load(Ordering::Acquire) {
            return false;
        }
        requests.push(request);
        true
    }

    /// Ends the queue: no further orders are accepted or answered.
    fn close(&self) {
        self.is_over.store(true, Ordering::Release);
        // Callers that wait for an answer get none.
        lock(&self.requests).clear();
    }
}

/// The receivers of values.
struct Sinks {
    targets: Vec<ActiveRecording>,
    flight: Option<Flight>,
    triggers: Triggers,
    /// Triggers that fired, each with its time and property.
    fired: Vec<(FlightTrigger, u64, String)>,
}

impl Sink for Sinks {
    fn value(&mut self, channel: Option<&Channel>, id: u32, items: usize, stamp: Stamp, bytes: &[u8]) {
        self.targets.iter_mut().for_each(|target| target.value(channel, id, items, stamp, bytes));
        let Some(flight) = &mut self.flight else { return };
        flight.value(channel, id, items, stamp, bytes);
        if let Some(channel) = channel
            && let Some(trigger) = self.triggers.check(channel, id, items, stamp, bytes)
        {
            self.fired.push((trigger, stamp.time, channel.path.clone()));
        }
    }
}

/// The state of the thread.
struct RecorderWork {
    hub: Arc<Hub>,
    host: Arc<Host>,
    shared: Arc<ThreadHandle>,
    drain: Drain,
    sinks: Sinks,
    settings: FlightSettings,
    /// Time of each trigger's last save.
    last_saved: SortedMap<FlightTrigger, u64>,
    saves: Arc<Saves>,
    skipped: u64,
    /// Callers that wait until the system has everything.
    settling: Vec<SyncSender<()>>,
}

impl RecorderWork {
    /// Runs the thread; a panic in it does not stop the robot.
    fn run_safely(mut self) -> Vec<ActiveRecording> {
        let (hub, host, shared) = (Arc::clone(&self.hub), Arc::clone(&self.host), Arc::clone(&self.shared));
        // Nothing is dropped on the way out, as a file that is closed in the middle of a panic may panic again.
        let done = catch_unwind(AssertUnwindSafe(|| self.run()));
        shared.close();
        done.unwrap_or_else(|_| {
            hub.stop();
            // They stay as after a kill.
            std::mem::forget(std::mem::take(&mut self.sinks.targets));
            let reason = "the thread that writes it has panicked";
            let recordings = lock(&shared.recordings);
            recordings.iter().for_each(|progress| progress.fail(reason));
            let text = "recording ends and the agent continues without it: the recorder has panicked";
            host.logger.log(host.now(), Level::Error, text);
            if let Some(shown) = &mut *lock(&shared.shown) {
                shown.write(false, &recordings, host.now());
            }
            Vec::new()
        })
    }

    #[allow(clippy::disallowed_methods, reason = "a piece is closed by the wall clock, also in a simulation")]
    fn run(&mut self) -> Vec<ActiveRecording> {
        let mut shown = Instant::now();
        let shared = Arc::clone(&self.shared);
        loop {
            // First, as what was handed over before the end, or before an order, is to be found after it.
            let is_over = shared.is_over.load(Ordering::Acquire);
            let taking = lock(&shared.taking);
            let requests = std::mem::take(&mut *lock(&shared.requests));
            let requests = self.add(requests);
            let is_urgent = self.hub.urgent.swap(false, Ordering::AcqRel);
            // Where nothing may be missing, values stay where they are until the disk has taken some.
            let is_held_up = self.sinks.targets.iter().any(ActiveRecording::must_wait);
            let found = !is_held_up && self.drain.take_values(&self.hub, &mut self.sinks);
            drop(taking);
            let now = Instant::now();
            if is_over {
                self.sinks.targets.iter_mut().for_each(|target| target.fail_after(STALL_TIMEOUT));
            }
            self.sinks.targets.iter_mut().for_each(|target| target.close_piece(now, is_urgent));
            self.drop_failed();
            self.save_fired();
            if now.duration_since(shown) >= STATE_PERIOD || is_over || !requests.is_empty() {
                shown = now;
                self.show();
            }
            // Values may still be in the rings.
            let (later, requests): (Vec<_>, Vec<_>) = requests
                .into_iter()
                .partition(|request| is_held_up && matches!(request, ThreadRequest::Settle(_)));
            if !later.is_empty() {
                lock(&shared.requests).extend(later);
            }
            requests.into_iter().for_each(|request| self.answer(request));
            if self.sinks.targets.iter().all(ActiveRecording::is_settled) {
                for waiting in self.settling.drain(..) {
                    // The caller may be gone.
                    let _ = waiting.send(());
                }
            }
            if is_over && !found && !is_held_up {
                return std::mem::take(&mut self.sinks.targets);
            }
            // Values that came meanwhile need no second look, unless a thread or file waits for them.
            let is_light = self.sinks.targets.is_empty() && !self.host.is_lockstep;
            if !found || (is_light && !is_over) {
                std::thread::park_timeout(match (is_light, self.sinks.flight.is_some()) {
                    (true, true) => LIGHT_POLL_PERIOD,
                    (true, false) => IDLE_POLL_PERIOD,
                    _ => POLL_PERIOD,
                });
            }
        }
    }

    /// Adds begun recordings; returns the other orders.
    /// Called before the values that belong to them are taken out.
    fn add(&mut self, requests: Vec<ThreadRequest>) -> Vec<ThreadRequest> {
        let mut others = Vec::new();
        for request in requests {
            match request {
                ThreadRequest::Add(target) => self.sinks.targets.push(*target),
                other => others.push(other),
            }
        }
        others
    }

    /// Answers an order, once everything present at its time is written.
    /// The caller may be gone.
    fn answer(&mut self, request: ThreadRequest) {
        match request {
            ThreadRequest::Add(_) => {}
            ThreadRequest::Remove(number, answer) => {
                let index = self.sinks.targets.iter().position(|target| target.number == number);
                let _ = answer.send(index.map(|index| Box::new(self.sinks.targets.remove(index))));
            }
            ThreadRequest::Capture(answer) => {
                let channels = self.hub.channels().clone();
                let _ = answer.send(self.sinks.flight.as_mut().map(|flight| flight.capture(&channels)));
            }
            ThreadRequest::Settle(answer) => {
                self.sinks.targets.iter_mut().for_each(ActiveRecording::request_settle);
                self.settling.push(answer);
            }
        }
    }

    /// Drops recordings that can't be written any more; the robot continues without.
    fn drop_failed(&mut self) {
        while let Some(index) = self.sinks.targets.iter().position(|target| target.failure().is_some()) {
            let mut target = self.sinks.targets.remove(index);
            self.hub.remove_recording(target.number);
            let time = self.host.now();
            target.publish(&self.hub.channels().clone(), time);
            let reason = target.failure().unwrap_or_default();
            target.progress.fail(&reason);
            let path = slate_runtime::printable(&target.progress.path);
            let text =
                format!("the recording {path} ends here, and the agent continues without it: {reason}");
            self.host.logger.log(time, Level::Error, &text);
            self.show();
        }
    }

    /// Publishes the state of the recordings.
    fn show(&mut self) {
        let time = self.host.now();
        let channels = self.hub.channels().clone();
        for target in &mut self.sinks.targets {
            target.publish(&channels, time);
            if let Some(stall) = target.new_stall() {
                let path = slate_runtime::printable(&target.progress.path);
                let stall = stall.as_secs();
                let meanwhile =
                    if self.host.is_lockstep { "the run waits" } else { "values are missing in it" };
                let text = format!(
                    "the disk of the recording {path} has accepted no data for {stall} s, and {meanwhile} until it does"
                );
                self.host.logger.log(time, Level::Warn, &text);
            }
        }
        if let Some(flight) = &self.sinks.flight {
            let (from, to, bytes) = flight.extent();
            *lock(&self.shared.flight) = Some(FlightEntry {
                keep: self.settings.keep,
                from,
                to,
                bytes,
                memory: self.settings.memory,
                saved: self.saves.files(),
                skipped: self.skipped,
            });
        }
        if let Some(shown) = &mut *lock(&self.shared.shown) {
            shown.write(!self.sinks.targets.is_empty(), &lock(&self.shared.recordings), time);
        }
    }

    /// Saves the last seconds when a trigger fires, at a limited rate.
    fn save_fired(&mut self) {
        for (trigger, time, path) in std::mem::take(&mut self.sinks.fired) {
            let last = self.last_saved.get(&trigger);
            // Time may have gone back.
            let is_soon = |last: &u64| time >= *last && time - *last < self.settings.every;
            let Some(flight) = self.sinks.flight.as_mut() else { return };
            if last.is_some_and(is_soon) {
                self.skipped += 1;
                continue;
            }
            self.last_saved.insert(trigger, time);
            let channels = self.hub.channels().clone();
            let captured = flight.capture(&channels);
            self.saves.begin(Save { trigger, time, path, captured }, self.settings.files);
        }
    }
}
