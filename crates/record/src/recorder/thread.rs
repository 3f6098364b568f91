//! The thread that encodes and writes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use slate_module::Level;
use slate_runtime::Agent;
use slate_runtime::log::Logger;

use super::file::File;
use super::lines::{Drain, Hub};
use super::state::Shown;
use super::{RecordError, Recorded};

/// How often is looked for values.
const PERIOD: Duration = Duration::from_millis(2);

/// How often is shown how it goes, and looked for drops.
const SHOWN: Duration = Duration::from_millis(100);

/// A recording that is under way.
pub(super) struct Thread {
    /// Taken at the end.
    thread: Option<JoinHandle<File>>,
    is_over: Arc<AtomicBool>,
    hub: Arc<Hub>,
    path: PathBuf,
}

impl Thread {
    pub fn start(
        hub: &Arc<Hub>,
        file: File,
        agent: &Agent,
        path: &Path,
        within: u64,
    ) -> std::io::Result<Self> {
        let is_over = Arc::new(AtomicBool::new(false));
        let work = Work {
            hub: Arc::clone(hub),
            file,
            drain: Drain::default(),
            within: Duration::from_nanos(within),
            shown: Shown::new(agent.board()),
            path: path.to_owned(),
            now: Box::new(agent.clock()),
            logger: Arc::clone(agent.logger()),
        };
        let over = Arc::clone(&is_over);
        let thread = Builder::new().name("record".into()).spawn(move || work.run(&over))?;
        Ok(Self { thread: Some(thread), is_over, hub: Arc::clone(hub), path: path.to_owned() })
    }

    pub fn handle(&self) -> Option<std::thread::Thread> {
        self.thread.as_ref().map(|thread| thread.thread().clone())
    }

    /// Waits until all that was handed over is written.
    fn join(&mut self) -> Option<File> {
        let thread = self.thread.take()?;
        self.hub.stop();
        self.is_over.store(true, Ordering::Release);
        thread.thread().unpark();
        thread.join().ok()
    }

    /// Closes the file.
    pub fn end(mut self, agent: &mut Agent) -> Result<Recorded, RecordError> {
        let path = self.path.clone();
        let failed = |reason| RecordError::Write { path: path.clone(), reason };
        let file = self.join();
        let mut file = file.ok_or_else(|| failed("the thread that writes it has panicked".into()))?;
        if let Some(reason) = file.failure.take() {
            return Err(failed(reason));
        }
        let time = agent.now();
        let dropped = file.tell_drops(&self.hub.channels(), time);
        let digest = agent.digest().map_or_else(|| "none".into(), |digest| format!("{digest:016x}"));
        let end = [
            ("digest", digest),
            ("cycles", agent.composer().cycles().to_string()),
            ("time_ns", time.to_string()),
            ("values", file.values.to_string()),
            ("dropped", dropped.to_string()),
        ];
        let end: BTreeMap<_, _> = end.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        file.end(end).map_err(failed)?;
        Ok(Recorded { file: self.path.clone(), values: file.values, dropped, bytes: file.bytes() })
    }
}

impl Drop for Thread {
    fn drop(&mut self) {
        // Without an end the file says nothing of the run's, and is whole all the same.
        drop(self.join());
    }
}

/// What the thread works with.
struct Work {
    hub: Arc<Hub>,
    file: File,
    drain: Drain,
    within: Duration,
    shown: Option<Shown>,
    path: PathBuf,
    now: Box<dyn Fn() -> u64 + Send>,
    logger: Arc<Logger>,
}

impl Work {
    #[allow(clippy::disallowed_methods, reason = "a piece is closed by the wall clock, also in a simulation")]
    fn run(mut self, is_over: &AtomicBool) -> File {
        // When the present piece was begun.
        let mut opened = None;
        let mut shown = Instant::now();
        loop {
            // First, as what was handed over before the end is to be found after it.
            let is_over = is_over.load(Ordering::Acquire);
            let is_urgent = self.hub.urgent.swap(false, Ordering::AcqRel);
            let found = self.drain.turn(&self.hub, &mut self.file);
            let now = Instant::now();
            if self.file.is_open() {
                let since = *opened.get_or_insert(now);
                if is_urgent || self.file.is_urgent() || now.duration_since(since) >= self.within {
                    let closed = self.file.close_piece();
                    self.file.note(closed);
                }
            }
            if !self.file.is_open() {
                opened = None;
            }
            if now.duration_since(shown) >= SHOWN || is_over {
                shown = now;
                self.show();
            }
            if let Some(reason) = &self.file.failure {
                self.fail(&reason.clone());
                return self.file;
            }
            if is_over && !found {
                return self.file;
            }
            if !found {
                std::thread::park_timeout(PERIOD);
            }
        }
    }

    /// Shows how it goes.
    fn show(&mut self) {
        let time = (self.now)();
        let channels = self.hub.channels().clone();
        let dropped = self.file.tell_drops(&channels, time);
        if let Some(shown) = &mut self.shown {
            shown.write(self.file.failure.is_none(), self.file.values, dropped, self.file.bytes(), time);
        }
    }

    /// Nothing can be written any more: the robot goes on without.
    fn fail(&mut self, reason: &str) {
        self.hub.stop();
        let path = slate_runtime::printable(&self.path);
        let text = format!("the recording {path} ends here, and the agent goes on without: {reason}");
        self.logger.log((self.now)(), Level::Error, &text);
        self.show();
    }
}
