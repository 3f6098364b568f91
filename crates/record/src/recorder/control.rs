//! Recordings that tools begin and end while the agent runs.

use std::fs::OpenOptions;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Duration;

use slate_module::Level;
use slate_runtime::configuration::{Record, RecordSelection};
use slate_runtime::recording::RecordedAgent;
use slate_runtime::recording::{
    History, HistoryRequest, RecordingControl, RecordingEntry, RecordingRefusal, RecordingStatus,
    SavedFlight, TakeValue,
};
use slate_sorted::SortedMap;

use super::file::{File, Limits};
use super::flight::Captured;
use super::host::{AgentContent, Host};
use super::lock::lock;
use super::save::save_to;
use super::target::{ActiveRecording, Progress};
use super::thread::{ThreadHandle, ThreadRequest};
use super::{MAIN_RECORDING, RecordError, Recorded, Recorder, TOOL_RECORDINGS, flight_filter, selection};

/// Timeout of answers of the writing thread; shorter than that of tools.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(30);

/// Maximum wait of a tool until its change is in the file.
const SETTLE_TIMEOUT: Duration = Duration::from_secs(1);

/// Maximum number of simultaneous recordings.
const MAX_RECORDINGS: usize = 8;

fn refusal(message: impl Into<String>, help: &str) -> RecordingRefusal {
    RecordingRefusal { message: message.into(), help: help.into() }
}

fn ended_refusal() -> RecordingRefusal {
    refusal(
        "the recorder of this agent has ended",
        "`slate log` shows why; start the agent again to record it",
    )
}

/// Returns the log line of a recording that has ended.
pub(super) fn summary_line(recorded: &Recorded) -> String {
    let Recorded { file, values, dropped, .. } = recorded;
    format!("the recording {} has {values} values; {dropped} are missing", slate_runtime::printable(file))
}

impl Recorder {
    /// Returns the handle of the thread, and the recorded agent.
    fn thread_and_host(&self) -> Result<(Arc<ThreadHandle>, Arc<Host>), RecordingRefusal> {
        let state = self.state();
        match (&state.thread, &state.host) {
            (Some(thread), Some(host)) => Ok((Arc::clone(&thread.shared), Arc::clone(host))),
            _ => Err(ended_refusal()),
        }
    }

    fn request(&self, shared: &ThreadHandle, order: ThreadRequest) -> Result<(), RecordingRefusal> {
        if !shared.request(order) {
            return Err(ended_refusal());
        }
        self.hub.wake();
        Ok(())
    }

    fn answer<T>(answer: &Receiver<T>) -> Result<T, RecordingRefusal> {
        let late = "the recorder has not answered in time, as its disk is slow";
        answer
            .recv_timeout(ANSWER_TIMEOUT)
            .map_err(|_| refusal(late, "see `slate record status`, and try again"))
    }

    /// Waits until reported changes are in the hands of the operating system.
    /// It does not wait for a stalled disk.
    pub(super) fn settle_changes(&self) {
        let mut settled = lock(&self.changes.settled);
        let count = self.changes.count.load(Ordering::Acquire);
        if std::mem::replace(&mut *settled, count) == count {
            return;
        }
        let Ok((shared, _)) = self.thread_and_host() else { return };
        if lock(&shared.recordings).is_empty() {
            return;
        }
        let (sender, receiver) = sync_channel(1);
        if self.request(&shared, ThreadRequest::Settle(sender)).is_ok() {
            let _ = receiver.recv_timeout(SETTLE_TIMEOUT);
        }
    }

    /// Returns the last seconds that are now in memory.
    fn capture(&self, shared: &ThreadHandle) -> Result<Captured, RecordingRefusal> {
        let (sender, receiver) = sync_channel(1);
        self.request(shared, ThreadRequest::Capture(sender))?;
        Self::answer(&receiver)?.ok_or_else(|| {
            let help = "start it without record.flight.enabled=false";
            refusal("this agent keeps nothing of its last seconds", help)
        })
    }
}

impl RecordingControl for Recorder {
    fn start(
        &self,
        agent: &dyn RecordedAgent,
        file: &Path,
        what: &RecordSelection,
    ) -> Result<(), RecordingRefusal> {
        let (shared, host) = self.thread_and_host()?;
        if lock(&shared.recordings).len() >= MAX_RECORDINGS {
            return Err(refusal(
                format!("the agent already has {MAX_RECORDINGS} recordings"),
                "end one: slate record stop FILE",
            ));
        }
        let board = agent.board();
        let is_selected = |path: &str| selection::selects(what, path) && !path.starts_with("record/");
        if !board.properties().iter().any(|property| is_selected(property.path())) {
            let help = "`slate list` shows the properties; '/**' is all of them";
            return Err(refusal("no property of the agent is among those to record", help));
        }
        let unwritten = |reason: String| {
            let help = "name a new file, in a folder that exists, on a disk with room: --out FILE";
            refusal(format!("{} can't be made: {reason}", slate_runtime::printable(file)), help)
        };
        let disk = OpenOptions::new().write(true).create_new(true).open(file);
        let disk = disk.map_err(|error| unwritten(error.to_string()))?;
        let recording_header =
            host.recording_header(&AgentContent::of(agent), agent.board(), selection::is_whole(what), false);
        let (number, limits, within) = {
            let mut state = self.state();
            state.count += 1;
            let Record { chunk, buffer, within, .. } = state.settings;
            (TOOL_RECORDINGS + state.count, Limits { chunk, buffer }, within)
        };
        let opened = File::create(Box::new(disk), recording_header, limits).map_err(|reason| {
            // Nothing is in it, and the name must be free for another try.
            let _ = std::fs::remove_file(file);
            unwritten(reason)
        })?;
        let progress = Progress::new(number, file, agent.now());
        let mut target =
            ActiveRecording::new(opened, what.clone(), within, host.is_lockstep, Arc::clone(&progress));
        self.publish_state(board);
        let own = what.clone();
        // Values written from now on stay in the rings until their recording is there.
        let taking = lock(&shared.taking);
        self.hub.add_recording(number, Box::new(move |channel| selection::selects(&own, &channel.path)));
        // A property that was made anew has the channel that came last.
        let channels = self.hub.channels().clone();
        let ids: SortedMap<&str, u32> =
            channels.iter().zip(0..).map(|(channel, id)| (channel.path.as_str(), id)).collect();
        let properties = board.properties().into_iter();
        let properties = properties.filter_map(|property| Some((*ids.get(property.path())?, property)));
        let properties: Vec<_> = properties.filter(|(_, property)| is_selected(property.path())).collect();
        target.begin(&channels, &properties, agent.now());
        lock(&shared.recordings).push(progress);
        let requested = self.request(&shared, ThreadRequest::Add(Box::new(target)));
        drop(taking);
        requested.inspect_err(|_| {
            // No thread writes it.
            self.hub.remove_recording(number);
            lock(&shared.recordings).retain(|other| other.number != number);
            let _ = std::fs::remove_file(file);
        })?;
        let file = slate_runtime::printable(file);
        host.logger.log(agent.now(), Level::Info, &format!("a tool records into {file}"));
        Ok(())
    }

    fn stop(
        &self,
        agent: &dyn RecordedAgent,
        file: Option<&Path>,
    ) -> Result<RecordingEntry, RecordingRefusal> {
        let (shared, host) = self.thread_and_host()?;
        let recordings = lock(&shared.recordings).clone();
        let names = || {
            let names = recordings.iter().map(|progress| slate_runtime::printable(&progress.entry().file));
            names.collect::<Vec<_>>().join(", ")
        };
        let named = |progress: &&Arc<Progress>| {
            // The run's own recording ends with the run unless a tool names it.
            file.map_or(progress.number != MAIN_RECORDING, |file| progress.entry().file == file)
        };
        let mut meant = recordings.iter().filter(named);
        let progress = match (meant.next(), meant.next()) {
            (Some(only), None) => only,
            (None, _) if recordings.is_empty() => {
                return Err(refusal("nothing is recorded", "begin with `slate record start`"));
            }
            (None, _) if file.is_none() => {
                let help = format!("it ends with the run; to end it now: slate record stop {}", names());
                return Err(refusal("only the run's own recording continues, which no tool began", &help));
            }
            (None, _) => {
                return Err(refusal("no recording goes into that file", &format!("available: {}", names())));
            }
            (Some(_), Some(_)) => {
                return Err(refusal("the agent has several recordings", &format!("name one of {}", names())));
            }
        };
        let (sender, receiver) = sync_channel(1);
        self.request(&shared, ThreadRequest::Remove(progress.number, sender))?;
        let target = Self::answer(&receiver)?;
        self.hub.remove_recording(progress.number);
        let time = agent.now();
        let ended = match target {
            Some(mut target) => {
                let channels = self.hub.channels().clone();
                target.end(&channels, agent.board(), time, vec![("stopped", "by a tool".into())])
            }
            None => Err(progress.failure().unwrap_or_else(|| "it has ended already".into())),
        };
        lock(&shared.recordings).retain(|other| other.number != progress.number);
        let path = progress.path.clone();
        let error = |reason| RecordError::Write { path: path.clone(), reason };
        if progress.number == MAIN_RECORDING {
            let mut state = self.state();
            (state.first, state.outcome) = (None, Some(ended.clone().map_err(error)));
        }
        match ended {
            Ok(recorded) => {
                host.logger.log(time, Level::Info, &summary_line(&recorded));
                Ok(RecordingEntry { values: recorded.values, bytes: recorded.bytes, ..progress.entry() })
            }
            Err(reason) => {
                let help = "`slate bag repair` makes a whole file of it";
                Err(refusal(error(reason).to_string(), help))
            }
        }
    }

    fn status(&self) -> RecordingStatus {
        let Ok((shared, _)) = self.thread_and_host() else { return RecordingStatus::default() };
        let recordings = lock(&shared.recordings).iter().map(|progress| progress.entry()).collect();
        let folder = self.state().saves.as_ref().and_then(|saves| std::path::absolute(saves.folder()).ok());
        RecordingStatus { recordings, flight: lock(&shared.flight).clone(), folder }
    }

    fn save(&self, agent: &dyn RecordedAgent, file: &Path) -> Result<SavedFlight, RecordingRefusal> {
        let (shared, host) = self.thread_and_host()?;
        let captured = self.capture(&shared)?;
        let Record { chunk, buffer, .. } = self.state().settings;
        let saved = save_to(file, &host, agent, Limits { chunk, buffer }, &captured).map_err(|reason| {
            let help = "name a new file, in a folder that exists, on a disk with room";
            refusal(format!("{} can't be written: {reason}", slate_runtime::printable(file)), help)
        })?;
        let shown = slate_runtime::printable(file);
        host.logger.log(agent.now(), Level::Info, &format!("a tool has saved the last seconds in {shown}"));
        Ok(saved)
    }

    fn history(
        &self,
        request: &HistoryRequest,
        take: &mut TakeValue<'_>,
    ) -> Result<History, RecordingRefusal> {
        let (shared, _) = self.thread_and_host()?;
        let captured = self.capture(&shared)?;
        // Without a word it would look as if nothing had been written.
        let settings = self.state().settings.clone();
        let wants = flight_filter(&settings);
        if let Some(channel) = captured.channel(&request.path).filter(|own| !wants(own)) {
            let (path, largest) = (&request.path, settings.flight.largest);
            let is_large = channel.largest as u64 > largest;
            return Err(refusal(
                match is_large {
                    true => format!(
                        "the last seconds leave out /{path}: its values may have {} bytes, and record.flight.largest is {largest}",
                        channel.largest
                    ),
                    false => format!("the last seconds leave out /{path}, which [record] does not choose"),
                },
                match is_large {
                    true => {
                        "start the agent with a larger one, such as --set record.flight.largest='\"1MiB\"'"
                    }
                    false => "see `select` and `exclude` of [record], and restart the agent",
                },
            ));
        }
        captured.history(request, take).ok_or_else(|| {
            let help = "`slate list` shows the properties; of the recorder itself nothing is kept";
            refusal(format!("nothing is kept of /{}", request.path), help)
        })
    }
}
