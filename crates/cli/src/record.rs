//! Recordings of running agents.

use std::fs::File;
use std::io::{Error, ErrorKind};
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use slate::runtime::printable;
use slate::runtime::recording::{RecordingEntry, RecordingStatus};

use crate::connection::AgentOption;
use crate::failure::Failure;
use crate::output;
use slate::control::BASE;
use slate::control::client::Request;

#[derive(Debug, Subcommand)]
pub enum RecordVerb {
    /// Start a recording; it begins with the newest value of each property
    Start(StartOptions),
    /// Stop a recording
    Stop {
        /// File of the recording [default: the only one that a tool has started]
        file: Option<PathBuf>,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Show the active recordings
    Status {
        /// Print as JSON
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Save the last seconds from the flight recorder
    Snapshot {
        /// New file
        #[arg(default_value = "flight.mcap")]
        file: PathBuf,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Download a finished recording
    Fetch {
        /// Name, such as `recording`; `slate api GET /recordings` lists all
        name: String,
        /// New file [default: NAME.mcap]
        #[arg(long)]
        out: Option<PathBuf>,
        #[command(flatten)]
        agent: AgentOption,
    },
}

#[derive(Debug, Args)]
pub struct StartOptions {
    /// Properties, such as '/r2/**' or '/**/scan' [default: all]
    pub select: Vec<String>,
    /// Exclude properties; repeatable
    #[arg(long, value_name = "SELECT")]
    pub exclude: Vec<String>,
    /// Maximum rate of each property, Hz
    #[arg(long, value_name = "HZ", value_parser = rate, allow_negative_numbers = true)]
    pub rate: Option<f64>,
    /// Record a value only if it differs from the one before
    #[arg(long)]
    pub on_change: bool,
    /// New file
    #[arg(long, default_value = "recording.mcap")]
    pub out: PathBuf,
    #[command(flatten)]
    pub agent: AgentOption,
}

const SCHEME: &str = "slate://";

/// Parses a rate; the agent checks its range.
fn rate(text: &str) -> Result<f64, String> {
    let rate = text.parse::<f64>().ok().filter(|rate| rate.is_finite());
    rate.ok_or_else(|| "expected Hz, such as 5".into())
}

/// Runs the command; returns true, as a refusal is a failure.
pub fn record(verb: &RecordVerb) -> Result<bool, Failure> {
    match verb {
        RecordVerb::Start(options) => {
            let file = options.agent.file(&options.out)?;
            let mut patterns = options.select.iter().chain(&options.exclude);
            let named = patterns.find(|pattern| pattern.starts_with(SCHEME));
            let mut client = match named {
                Some(url) => options.agent.connect_for(url)?,
                None => options.agent.connect()?,
            };
            let own = format!("{SCHEME}{}", client.name());
            // A URL of the agent itself is a path there; any other one it refuses.
            let path = |pattern: &String| match pattern.strip_prefix(&own) {
                Some(path) if path.starts_with('/') => path.to_owned(),
                _ => pattern.clone(),
            };
            let paths = |patterns: &[String]| patterns.iter().map(path).collect::<Vec<_>>();
            let (select, exclude) = (paths(&options.select), paths(&options.exclude));
            let what = (&*select, &*exclude);
            client.start_recording(&file, what, options.rate, options.on_change)?;
            output::line(format_args!("{} records into {}", client.name(), printable(&options.out)));
        }
        RecordVerb::Stop { file, agent } => {
            let file = file.as_deref().map(|file| agent.file(file)).transpose()?;
            let entry = agent.connect()?.stop_recording(file.as_deref())?;
            output::line(format_args!("{} has {}", printable(&entry.file), counts(&entry)));
        }
        RecordVerb::Status { json, agent } => {
            let status = agent.connect()?.recordings()?;
            if *json { output::document("slate.record/1", &status) } else { show(&status) }
        }
        RecordVerb::Snapshot { file, agent } => {
            let saved = agent.connect()?.save_flight(&agent.file(file)?)?;
            let seconds = saved.to.saturating_sub(saved.from) as f64 * 1e-9;
            let (file, values) = (printable(file), saved.values);
            output::line(format_args!("{file} has the last {seconds:.3} s: {values} values"));
        }
        RecordVerb::Fetch { name, out, agent } => {
            let name = name.strip_suffix(KIND).unwrap_or(name);
            fetch(agent, name, &out.clone().unwrap_or_else(|| format!("{name}{KIND}").into()))?;
        }
    }
    Ok(true)
}

/// File extension of recordings.
const KIND: &str = ".mcap";

/// Downloads a recording of an agent into a file.
/// An interrupted download leaves no file.
fn fetch(agent: &AgentOption, name: &str, out: &Path) -> Result<(), Failure> {
    let coded = |byte: u8| match byte {
        byte if byte.is_ascii_alphanumeric() => char::from(byte).to_string(),
        byte => format!("%{byte:02X}"),
    };
    let path = format!("{BASE}/recordings/{}", name.bytes().map(coded).collect::<String>());
    let request = Request { method: "GET", path: &path, ..Request::default() };
    let mut response = agent.request(None, &request)?;
    let unwritten = |source: Error| match source.kind() {
        ErrorKind::AlreadyExists => Failure::Taken { path: out.into() },
        _ => Failure::File { path: out.into(), source },
    };
    let mut file = File::create_new(out).map_err(unwritten)?;
    let bytes = std::io::copy(&mut response.body, &mut file).inspect_err(|_| {
        // It does not exist, or can't be removed.
        let _ = std::fs::remove_file(out);
    });
    let bytes = bytes.map_err(unwritten)?;
    output::line(format_args!("{} has {:.1} MB", printable(out), megabytes(bytes)));
    Ok(())
}

fn counts(entry: &RecordingEntry) -> String {
    let dropped = match entry.dropped {
        0 => String::new(),
        dropped => format!(", {dropped} dropped"),
    };
    format!("{} values{dropped}, {:.1} MB", entry.values, megabytes(entry.bytes))
}

fn megabytes(bytes: u64) -> f64 {
    bytes as f64 * 1e-6
}

fn show(status: &RecordingStatus) {
    if status.recordings.is_empty() {
        output::line("nothing is recorded");
    }
    for entry in &status.recordings {
        let since = entry.from as f64 * 1e-9;
        let end =
            entry.failure.as_ref().map_or_else(String::new, |reason| format!("; it has ended: {reason}"));
        let (file, counts) = (printable(&entry.file), counts(entry));
        output::line(format_args!("{file}: {counts} since {since:.3} s{end}"));
    }
    let Some(flight) = &status.flight else {
        output::line("flight recorder: off (record.flight.enabled)");
        return;
    };
    let seconds = flight.to.saturating_sub(flight.from) as f64 * 1e-9;
    let (own, most) = (megabytes(flight.bytes), megabytes(flight.memory));
    output::line(format_args!("flight recorder: the last {seconds:.1} s, {own:.1} of {most:.1} MB"));
    for file in &flight.saved {
        output::line(format_args!("saved: {}", printable(file)));
    }
    if flight.skipped > 0 {
        output::line(format_args!(
            "{} triggers were ignored as they followed another too closely",
            flight.skipped
        ));
    }
}
