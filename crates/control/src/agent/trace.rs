//! Recording a trace for a tool.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use slate_module::Level;

use super::refusal::refusal;
use crate::entries::{Refusal, TraceEntry, TrackEntry};
use slate_runtime::Composer;
use slate_runtime::replacement::Replacement;
use slate_runtime::timing::{Recorded, Recording};

/// Trace that a tool records; it is discarded when dropped before its end.
#[derive(Default)]
pub(crate) enum ToolTrace {
    /// No trace.
    #[default]
    Nothing,
    UnderWay {
        recording: Recording<Replacement>,
        file: PathBuf,
        composer: Composer,
    },
    /// The tool has not heard of its end yet.
    Over(Result<TraceEntry, Refusal>),
}

impl ToolTrace {
    /// Returns whether a recording is in progress.
    pub fn is_under_way(&self) -> bool {
        matches!(self, Self::UnderWay { .. })
    }

    /// Begins to record.
    pub fn record(&mut self, composer: &Composer, file: &Path) -> Result<(), Refusal> {
        if let Self::UnderWay { file, .. } = self {
            let message = format!("this connection records into {} already", slate_runtime::printable(file));
            return Err(refusal(message, "end that with DELETE /api/v1/trace, or connect once more"));
        }
        let recording =
            Replacement::create(file).and_then(|replacement| composer.trace().record(replacement));
        let recording = recording.map_err(|error| failed(file, &error))?;
        composer.say(&format!("a tool records a trace into {}", slate_runtime::printable(file)));
        *self = Self::UnderWay { recording, file: file.into(), composer: composer.clone() };
        Ok(())
    }

    /// Returns the progress.
    pub fn progress(&mut self) -> Result<TraceEntry, Refusal> {
        match self {
            Self::Nothing => Err(no_trace()),
            Self::UnderWay { recording, file, .. } => match recording.recorded() {
                Ok(recorded) => Ok(entry(file, false, recorded)),
                Err(_) => {
                    self.finish();
                    self.progress()
                }
            },
            Self::Over(result) => result.clone(),
        }
    }

    /// Ends it.
    pub fn end(&mut self) -> Result<TraceEntry, Refusal> {
        self.finish();
        match std::mem::take(self) {
            Self::Over(result) => result,
            _ => Err(no_trace()),
        }
    }

    /// Handles the loss of the tool.
    /// Its trace is discarded, unless the agent itself ends.
    pub fn abandon(mut self, agent_ends: bool) {
        if agent_ends {
            self.finish();
        }
        if let Self::UnderWay { recording, file, composer } = self {
            drop(recording);
            let file = slate_runtime::printable(&file);
            composer
                .say(&format!("a tool disconnected before the end of its trace {file}, which is discarded"));
        }
    }

    /// Ends the trace, and keeps its result for the tool.
    pub fn finish(&mut self) {
        match std::mem::take(self) {
            Self::UnderWay { recording, file, composer } => {
                let result = recording.end().and_then(|(recorded, replacement)| {
                    replacement.keep()?;
                    Ok(entry(&file, true, recorded))
                });
                let result = result.map_err(|error| failed(&file, &error));
                match &result {
                    Ok(entry) => {
                        let (spans, missing) = (entry.spans(), entry.missing());
                        let file = slate_runtime::printable(&file);
                        composer.say(&format!("the trace {file} has {spans} spans; {missing} are missing"));
                    }
                    Err(refusal) => {
                        composer.log(Level::Error, &format!("the trace has failed: {}", refusal.message));
                    }
                }
                *self = Self::Over(result);
            }
            other => *self = other,
        }
    }
}

fn entry(file: &Path, ended: bool, recorded: Recorded) -> TraceEntry {
    let Recorded { from, to, tracks } = recorded;
    let tracks = tracks.into_iter();
    let tracks =
        tracks.map(|track| TrackEntry { name: track.name, spans: track.spans, missing: track.missing });
    TraceEntry { file: file.into(), ended, from, to, tracks: tracks.collect() }
}

fn no_trace() -> Refusal {
    refusal("this connection records no trace", "begin with POST /api/v1/trace")
}

fn failed(file: &Path, error: &io::Error) -> Refusal {
    let help = match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
            "make room on the disk, or name a file on another one"
        }
        ErrorKind::FileTooLarge => "record for less time, or name a file where larger ones may be",
        ErrorKind::AlreadyExists => "wait for the other one, or name another file",
        _ => "name a file in a folder that exists and can be written to",
    };
    refusal(format!("{} can't be written: {error}", slate_runtime::printable(file)), help)
}
