use std::fs::{File, TryLockError};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

use clap::Args;
use slate::control::{Client, ClientError, TraceEntry};
use slate::runtime::printable;

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;

#[derive(Debug, Args)]
pub struct TraceOptions {
    /// Duration, seconds; Ctrl-C ends it earlier
    #[arg(long, default_value_t = 5.0, value_parser = seconds)]
    pub seconds: f64,
    /// File for https://ui.perfetto.dev; an existing one is replaced
    #[arg(long, default_value = "trace.json")]
    pub out: PathBuf,
    /// Print the number of spans of each track as JSON
    #[arg(long)]
    pub json: bool,
    #[command(flatten)]
    pub agent: AgentOption,
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if seconds > 0.0 && seconds <= 3600.0 => Ok(seconds),
        _ => Err("expected seconds, more than 0 and at most 3600".into()),
    }
}

/// Polling period of the recording's progress.
const POLL_PERIOD: Duration = Duration::from_millis(250);

/// Records an execution trace of a running agent's modules.
pub fn trace(options: &TraceOptions) -> Result<bool, Failure> {
    let file = options.agent.file(&options.out)?;
    let mut client = options.agent.connect()?;
    let is_local = client.is_local();
    let interrupted = interrupts();
    let recorded = client
        .record_trace(&file)
        .and_then(|()| record(&mut client, options.seconds, &interrupted))
        // The files of an agent elsewhere are its own.
        .map_err(|error| if is_local { without_end(error, &file) } else { error.into() })?;
    if options.json {
        output::document("slate.trace/1", &recorded);
    } else {
        output::line(summary(&recorded));
    }
    if let Some(warning) = warning(&recorded) {
        eprintln!("warning: {warning}");
    }
    Ok(true)
}

/// Hears of Ctrl-C, the second of which ends the process.
fn interrupts() -> Receiver<()> {
    let (sender, receiver) = sync_channel(1);
    let is_stopping = AtomicBool::new(false);
    let handled = ctrlc::set_handler(move || {
        if is_stopping.swap(true, Ordering::AcqRel) {
            std::process::exit(130);
        }
        // It is waited for, or it has ended by itself.
        let _ = sender.try_send(());
    });
    if let Err(error) = handled {
        eprintln!("Ctrl-C will discard the trace: {error}");
    }
    receiver
}

/// Waits for the end of the recording.
/// It notices a failed recording or the agent's end meanwhile.
fn record(client: &mut Client, seconds: f64, interrupted: &Receiver<()>) -> Result<TraceEntry, ClientError> {
    let mut left = Duration::try_from_secs_f64(seconds).unwrap_or(Duration::ZERO);
    while !left.is_zero() {
        let part = left.min(POLL_PERIOD);
        match interrupted.recv_timeout(part) {
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => std::thread::sleep(part),
            Ok(()) => break,
        }
        left -= part;
        let progress = client.trace_progress()?;
        if progress.ended {
            eprintln!("the agent has ended; the trace is complete until then");
            return Ok(progress);
        }
    }
    client.end_trace()
}

/// Cleans up after a killed agent, which can't; returns the failure.
fn without_end(error: ClientError, file: &Path) -> Failure {
    use ErrorKind::{BrokenPipe, ConnectionReset, UnexpectedEof};
    let ClientError::Lost { name, error: lost } = &error else { return error.into() };
    if !matches!(lost.kind(), BrokenPipe | ConnectionReset | UnexpectedEof) {
        return error.into();
    }
    let part = part_of(file);
    for _ in 0..100 {
        match remove_abandoned(&part) {
            Ok(true) => return Failure::TraceWithoutEnd { agent: name.clone(), left: None },
            // Of a process that ends, the connection may be closed before the file.
            Ok(false) => std::thread::sleep(Duration::from_millis(20)),
            Err(_) => break,
        }
    }
    Failure::TraceWithoutEnd { agent: name.clone(), left: Some(part) }
}

/// Returns the path under which an agent writes a file until it is complete.
fn part_of(file: &Path) -> PathBuf {
    let mut name = file.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    file.with_file_name(name)
}

/// Removes an abandoned file, which no process locks; false if one does.
fn remove_abandoned(part: &Path) -> std::io::Result<bool> {
    let file = match File::open(part) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(true),
        opened => opened?,
    };
    match file.try_lock() {
        Ok(()) => std::fs::remove_file(part).map(|()| true),
        Err(TryLockError::WouldBlock) => Ok(false),
        Err(TryLockError::Error(error)) => Err(error),
    }
}

fn summary(recorded: &TraceEntry) -> String {
    let tracks = recorded.tracks.len();
    let seconds = recorded.to.saturating_sub(recorded.from) as f64 * 1e-9;
    format!(
        "{} spans of {tracks} {} over {seconds:.2} s in {}; open it in https://ui.perfetto.dev",
        recorded.spans(),
        if tracks == 1 { "track" } else { "tracks" },
        printable(&recorded.file)
    )
}

/// Describes missing spans by track.
fn warning(recorded: &TraceEntry) -> Option<String> {
    let missing = recorded.tracks.iter().filter(|track| track.missing > 0);
    let missing: Vec<_> = missing.map(|track| format!("{} of {}", track.missing, track.name)).collect();
    (!missing.is_empty()).then(|| {
        format!(
            "{} spans are missing, as the disk was too slow: {}; the trace marks where",
            recorded.missing(),
            missing.join(", ")
        )
    })
}
