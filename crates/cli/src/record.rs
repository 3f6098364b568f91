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
    /// Begins to record a running agent into a file; the newest value of each property comes first.
    Start(StartOptions),
    /// Ends a recording.
    Stop {
        /// Its file; unless given the only recording that a tool began, as that of the run ends with the run.
        file: Option<PathBuf>,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Shows what is recorded of an agent, and how that goes.
    Status {
        /// Prints it as JSON.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Saves the last seconds of an agent, which it keeps in memory, into a file.
    Snapshot {
        /// The file; it must not be there yet.
        #[arg(default_value = "flight.mcap")]
        file: PathBuf,
        #[command(flatten)]
        agent: AgentOption,
    },
    /// Fetches a recording that has ended from the folder of an agent's report, over HTTP: also from another computer.
    Fetch {
        /// Its name, such as `recording`; `slate api GET /recordings` shows which there are.
        name: String,
        /// The file that it is written into, which is not there yet; NAME.mcap in this folder unless given.
        #[arg(long)]
        out: Option<PathBuf>,
        #[command(flatten)]
        agent: AgentOption,
    },
}

#[derive(Debug, Args)]
pub struct StartOptions {
    /// Which properties, such as '/r2/**' or '/**/scan'; all unless given.
    pub select: Vec<String>,
    /// Which of them not; may be given several times.
    #[arg(long, value_name = "SELECT")]
    pub exclude: Vec<String>,
    /// At most so many values a second of each property.
    #[arg(long, value_name = "HZ", value_parser = rate, allow_negative_numbers = true)]
    pub rate: Option<f64>,
    /// Only values that are other ones than the last that was recorded.
    #[arg(long)]
    pub on_change: bool,
    /// The file; it must not be there yet.
    #[arg(long, default_value = "recording.mcap")]
    pub out: PathBuf,
    #[command(flatten)]
    pub agent: AgentOption,
}

const SCHEME: &str = "slate://";

/// What is no number at all can't be told to an agent, which says of others whether they will do.
fn rate(text: &str) -> Result<f64, String> {
    let rate = text.parse::<f64>().ok().filter(|rate| rate.is_finite());
    rate.ok_or_else(|| "expected values a second, such as 5".into())
}

/// Does what is asked; true, as what is refused is a failure.
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

/// How the files of recordings end.
const KIND: &str = ".mcap";

/// Writes a recording of an agent into a file here. Of what breaks off nothing is left.
fn fetch(agent: &AgentOption, name: &str, out: &Path) -> Result<(), Failure> {
    let coded = |byte: u8| match byte {
        byte if byte.is_ascii_alphanumeric() => char::from(byte).to_string(),
        byte => format!("%{byte:02X}"),
    };
    let path = format!("{BASE}/recordings/{}", name.bytes().map(coded).collect::<String>());
    let mut response =
        agent.over_http(None)?.ask(&Request { method: "GET", path: &path, ..Request::default() })?.well()?;
    let unwritten = |source: Error| match source.kind() {
        ErrorKind::AlreadyExists => Failure::Taken { path: out.into() },
        _ => Failure::File { path: out.into(), source },
    };
    let mut file = File::create_new(out).map_err(unwritten)?;
    let bytes = std::io::copy(&mut response.body, &mut file).inspect_err(|_| {
        // It is not there, or nobody can help it.
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
        output::line("the last seconds are not kept (record.flight.enabled)");
        return;
    };
    let seconds = flight.to.saturating_sub(flight.from) as f64 * 1e-9;
    let (own, most) = (megabytes(flight.bytes), megabytes(flight.memory));
    output::line(format_args!("in memory: the last {seconds:.1} s, {own:.1} of {most:.1} MB"));
    for file in &flight.saved {
        output::line(format_args!("saved: {}", printable(file)));
    }
    if flight.skipped > 0 {
        output::line(format_args!("{} more triggers came too soon after one before", flight.skipped));
    }
}
