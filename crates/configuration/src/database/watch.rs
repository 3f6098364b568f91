use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::*;

/// Polling interval of the files.
/// Two equal looks make an edit, so that no half-written file is read.
const PERIOD: Duration = Duration::from_millis(250);

/// Effects of edited files.
#[derive(Clone, Debug, Default)]
pub struct Edit {
    /// Changes that are in effect now.
    pub changes: Vec<Change>,
    /// Changes that wait for the next start, also of earlier edits.
    pub waiting: Vec<Change>,
    /// Edits of settings whose changes at run time still hold, also earlier ones.
    pub covered: Vec<Change>,
}

/// Watch of the files, until this is dropped.
#[must_use = "dropping it ends the watching"]
pub struct Watch {
    /// Sender whose drop ends the thread.
    stop: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Watch {
    /// Begins a thread that looks at the files of a database.
    pub(super) fn begin(
        database: Database,
        handler: impl FnMut(Result<Edit, Report>) + Send + 'static,
    ) -> Result<Self, Report> {
        let (stop, stopped) = mpsc::channel();
        let mut watcher = FileWatcher { database, seen: None, refused: None };
        let mut handler = handler;
        let run = move || {
            while stopped.recv_timeout(PERIOD) == Err(RecvTimeoutError::Timeout) {
                if let Some(result) = watcher.poll() {
                    // The next edit is to be taken over even if the handler panics.
                    let _ = catch_unwind(AssertUnwindSafe(|| handler(result)));
                }
            }
        };
        let thread = thread::Builder::new().name("configuration".into()).spawn(run).map_err(|error| {
            refusal(format!("can't watch the configuration: {error}"), "end what has too many threads")
        })?;
        Ok(Self { stop: Some(stop), thread: Some(thread) })
    }
}

impl Drop for Watch {
    /// Waits for the end of a call of `told`, except in that call itself.
    fn drop(&mut self) {
        self.stop = None;
        if let Some(thread) =
            self.thread.take().filter(|thread| thread.thread().id() != thread::current().id())
        {
            let _ = thread.join();
        }
    }
}

impl fmt::Debug for Watch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Watch").finish_non_exhaustive()
    }
}

struct FileWatcher {
    database: Database,
    /// Files at the last look, if they were new.
    seen: Option<Files>,
    refused: Option<Refused>,
}

/// Refused edit.
struct Refused {
    files: Files,
    /// Generation of the state that refused it; a later one may accept it.
    generation: u64,
    /// Report, which is shown once.
    report: String,
}

impl FileWatcher {
    fn poll(&mut self) -> Option<Result<Edit, Report>> {
        let state = self.database.state();
        let generation = state.generation;
        let now =
            state.files.fresh(self.refused.as_ref().map_or(&Files::default(), |refused| &refused.files));
        if state.files.hold_in(&now) {
            self.seen = None;
            // The error is mended.
            let state = self.database.state();
            let as_before =
                || Ok(Edit { changes: Vec::new(), waiting: state.waiting, covered: state.covered });
            return self.refused.take().map(|_| as_before());
        }
        match &self.refused {
            Some(refused) if refused.files == now && refused.generation == generation => return None,
            Some(refused) if refused.files == now => {}
            _ if self.seen.as_ref() == Some(&now) => {}
            _ => {
                self.seen = Some(now);
                return None;
            }
        }
        let (result, files) = self.database.proposal(state, &[], ProposalFiles::Edited(now));
        match result {
            // Overtaken by another change: the next poll tries again.
            Ok(proposal) => {
                let (waiting, covered) = (proposal.waiting().to_vec(), proposal.covered().to_vec());
                self.refused = None;
                proposal.apply().map(|changes| Ok(Edit { changes, waiting, covered }))
            }
            Err(report) => {
                let text = report.to_string();
                let is_reported = self.refused.as_ref().is_some_and(|refused| refused.report == text);
                self.refused = Some(Refused { files, generation, report: text });
                (!is_reported).then_some(Err(report))
            }
        }
    }
}
