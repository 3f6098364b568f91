//! The last seconds, on their way into a file.

use std::collections::VecDeque;
use std::fs::{File as Disk, OpenOptions};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::thread::{Builder, JoinHandle};

use slate_blackboard::{Access, Stamp};
use slate_module::Level;
use slate_runtime::configuration::FlightTrigger;
use slate_runtime::recording::RecordedAgent;
use slate_runtime::recording::SavedFlight;
use slate_sorted::SortedMap;

use super::file::{File, Limits};
use super::flight::Captured;
use super::flight_preface::recording_header;
use super::host::Host;
use super::hub::Sink;
use super::lock::lock;
use super::run::RecordingHeader;

/// The last seconds that a trigger saves.
pub(super) struct Save {
    pub trigger: FlightTrigger,
    pub time: u64,
    /// The property that said so.
    pub path: String,
    pub captured: Captured,
}

/// Files that triggers save, each written in a thread of its own.
pub(super) struct Saves {
    host: Arc<Host>,
    folder: PathBuf,
    limits: Limits,
    state: Mutex<SavesState>,
}

#[derive(Default)]
struct SavesState {
    /// Number of saves by trigger.
    counts: SortedMap<FlightTrigger, u64>,
    /// The files that are there, with the trigger of each, the oldest first.
    files: VecDeque<(FlightTrigger, PathBuf)>,
    threads: Vec<JoinHandle<()>>,
}

impl Saves {
    pub fn new(host: &Arc<Host>, folder: &Path, limits: Limits) -> Arc<Self> {
        Arc::new(Self { host: Arc::clone(host), folder: folder.into(), limits, state: Mutex::default() })
    }

    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns the existing files, oldest first.
    pub fn files(&self) -> Vec<PathBuf> {
        lock(&self.state).files.iter().map(|(_, file)| file.clone()).collect()
    }

    /// Begins to write a file, and keeps at most `most` files of its trigger.
    pub fn begin(self: &Arc<Self>, save: Save, most: u64) {
        let own = Arc::clone(self);
        let thread = Builder::new().name("record save".into()).spawn(move || {
            slate_runtime::set_batch_scheduling();
            own.save(&save, most);
        });
        match thread {
            Ok(thread) => {
                let mut state = lock(&self.state);
                state.threads.retain(|thread| !thread.is_finished());
                state.threads.push(thread);
            }
            Err(error) => self.log(Level::Error, &format!("the last seconds can't be saved: {error}")),
        }
    }

    /// Creates the next free file of a trigger.
    /// Files of another run stay.
    fn create(&self, trigger: FlightTrigger) -> (PathBuf, io::Result<Disk>) {
        let folder = std::fs::create_dir_all(&self.folder);
        loop {
            let count = {
                let mut state = lock(&self.state);
                let count = state.counts.entry(trigger).or_default();
                *count += 1;
                *count
            };
            let path = self.folder.join(format!("flight-{}-{count}.mcap", trigger.name()));
            if let Err(error) = folder {
                return (path, Err(error));
            }
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                made => return (path, made),
            }
        }
    }

    fn save(&self, save: &Save, most: u64) {
        let Some(composer) = self.host.composer.upgrade() else { return };
        let recording_header = recording_header(&self.host, &composer, &save.captured);
        drop(composer);
        let why = [
            ("trigger", save.trigger.name().to_owned()),
            ("property", format!("/{}", save.path)),
            ("time_ns", save.time.to_string()),
        ];
        let (path, made) = self.create(save.trigger);
        let path = path.as_path();
        let saved = made.map_err(|error| error.to_string());
        let saved = saved
            .and_then(|disk| write(disk, path, recording_header, self.limits, &save.captured, why.into()));
        let shown = slate_runtime::printable(path);
        match saved {
            Ok(saved) => {
                let seconds = saved.to.saturating_sub(saved.from) as f64 * 1e-9;
                let (trigger, property) = (save.trigger.name(), &save.path);
                self.log(
                    Level::Info,
                    &format!(
                        "the last {seconds:.1} s are saved in {shown}, as /{property} reported a {trigger}"
                    ),
                );
                self.prune(save.trigger, path, most);
            }
            Err(reason) => {
                // A partial file can be repaired; an empty one only takes the name.
                if std::fs::metadata(path).is_ok_and(|found| found.is_file() && found.len() == 0) {
                    let _ = std::fs::remove_file(path);
                }
                self.log(Level::Error, &format!("the last seconds can't be saved in {shown}: {reason}"));
            }
        }
    }

    /// Adds a trigger's newest file, and removes its oldest one beyond `most`.
    fn prune(&self, trigger: FlightTrigger, path: &Path, most: u64) {
        let mut state = lock(&self.state);
        state.files.push_back((trigger, path.into()));
        let of = state.files.iter().filter(|(own, _)| *own == trigger).count() as u64;
        if of > most
            && let Some(index) = state.files.iter().position(|(own, _)| *own == trigger)
            && let Some((_, oldest)) = state.files.remove(index)
        {
            // It may have been removed already.
            let _ = std::fs::remove_file(oldest);
        }
    }

    fn log(&self, level: Level, text: &str) {
        self.host.logger.log(self.host.now(), level, text);
    }

    /// Waits for the files that are being written.
    pub fn wait(&self) {
        let threads = std::mem::take(&mut lock(&self.state).threads);
        for thread in threads {
            // One that panicked has said so.
            let _ = thread.join();
        }
    }
}

/// Saves the last seconds for a tool.
pub(super) fn save_to(
    path: &Path,
    host: &Host,
    composer: &dyn RecordedAgent,
    limits: Limits,
    captured: &Captured,
) -> Result<SavedFlight, String> {
    let recording_header = recording_header(host, composer, captured);
    let disk =
        OpenOptions::new().write(true).create_new(true).open(path).map_err(|error| error.to_string())?;
    let why = [("trigger", "a tool".to_owned()), ("time_ns", host.now().to_string())];
    write(disk, path, recording_header, limits, captured, why.into()).inspect_err(|_| {
        // The seconds are still in memory; the name must be free for another try.
        let _ = std::fs::remove_file(path);
    })
}

fn write(
    disk: Disk,
    path: &Path,
    recording_header: RecordingHeader,
    limits: Limits,
    captured: &Captured,
    why: SortedMap<&str, String>,
) -> Result<SavedFlight, String> {
    let mut file = File::create(Box::new(disk), recording_header, limits)?;
    captured.each(|is_before, head, bytes| {
        let channel = captured.channels.get(head.id as usize);
        let stamp = Stamp { sequence: head.sequence, time: head.time, generation: 0 };
        // No thread waits for this one.
        file.settle();
        match channel.filter(|_| is_before) {
            // Messages taken before are gone.
            Some(channel) if channel.access == Access::Messages => {}
            Some(channel) => {
                let at = (stamp, captured.from);
                file.write_initial(channel, head.id, head.items as usize, at, bytes);
            }
            None => file.value(channel, head.id, head.items as usize, stamp, bytes),
        }
    });
    if let Some(reason) = file.failure() {
        return Err(reason);
    }
    let extent = [("from_ns", captured.from.to_string()), ("to_ns", captured.to.to_string())];
    let all = why.into_iter().chain(extent).map(|(key, value)| (key.to_owned(), value));
    file.end("flight", all.collect())?;
    let (from, to) = (captured.from, captured.to);
    Ok(SavedFlight { file: path.into(), from, to, values: file.values, bytes: file.bytes() })
}
