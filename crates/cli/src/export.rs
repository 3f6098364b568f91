//! Export of a run as a page that plays it without an agent.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use serde_json::Value as Json;
use slate::console::{RecordedRun, RecordedSample, exported_page};
use slate::control::{Client, ClientError};
use slate_sorted::SortedMap;

use crate::failure::Failure;
use crate::replay::with_playback;

/// Name of the page in its folder.
const PAGE: &str = "index.html";

/// Answers of the agent that the page shows.
const RESOURCES: [&str; 12] = [
    "/agent",
    "/properties",
    "/interfaces",
    "/documents",
    "/links",
    "/modules",
    "/actuators",
    "/parameters",
    "/settings/differences",
    "/layouts",
    "/threads",
    "/graph?hide=&width=1200&height=700",
];

/// Maximum number of values of a property in one answer of an agent.
const MAX_VALUES: u64 = 10_000;

/// Maximum size of a property's values, bytes.
/// Larger values are exported at a lower rate.
const MAX_SIZE: usize = 4 << 20;

/// Recording in the folder of a run.
const RECORDING: &str = "run.mcap";

/// Interface of images, which a page would take too much space for.
const IMAGE: &str = "Image";

/// Written page.
pub struct ExportedPage {
    pub file: PathBuf,
    pub size: usize,
    pub properties: usize,
    pub values: usize,
}

/// Writes the page of a recording, or of an agent's last seconds, into a folder.
pub fn export(
    folder: &Path,
    recording: Option<&Path>,
    rate: f64,
    connect: impl FnOnce() -> Result<Client, Failure>,
) -> Result<ExportedPage, Failure> {
    // The folder of a run has its recording.
    let recording = recording.map(|file| if file.is_dir() { file.join(RECORDING) } else { file.to_owned() });
    let run = match &recording {
        Some(file) => with_playback(file, |client| gather(client, file_name(file), rate))?,
        None => gather(&mut connect()?, String::new(), rate)?,
    };
    let file = folder.join(PAGE);
    let failed = |source| Failure::File { path: file.clone(), source };
    let page = exported_page(&run).map_err(failed)?;
    std::fs::create_dir_all(folder).and_then(|()| std::fs::write(&file, &page)).map_err(failed)?;
    let values = run.histories.values().map(Vec::len).sum();
    Ok(ExportedPage { size: page.len(), properties: run.histories.len(), values, file })
}

fn file_name(file: &Path) -> String {
    file.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Reads a run over the control surface, each property at most at a rate in Hz.
fn gather(client: &mut Client, file: String, rate: f64) -> Result<RecordedRun, Failure> {
    let (from, to) = extent(client)?;
    let mut resources = SortedMap::new();
    for path in RESOURCES {
        resources.insert(path.split('?').next().unwrap_or(path).to_owned(), client.call("GET", path, None)?);
    }
    for name in texts(&resources["/documents"]) {
        let path = format!("/documents/{name}");
        let document = client.call("GET", &path, None)?;
        resources.insert(path, document);
    }
    let agent = client.name().to_owned();
    let limit = ((to.saturating_sub(from) as f64 * 1e-9 * rate) as u64 + 2).min(MAX_VALUES);
    let mut histories = SortedMap::new();
    for property in resources["/properties"].as_array().into_iter().flatten() {
        let (Some(path), Some(interface)) = (property["path"].as_str(), property["interface"].as_str())
        else {
            continue;
        };
        if interface == IMAGE || property["access"] == "messages" {
            continue;
        }
        let samples = history(client, &agent, path, limit)?;
        if !samples.is_empty() {
            histories.insert(path.to_owned(), samples);
        }
    }
    Ok(RecordedRun { agent, file, from, to, resources, histories })
}

fn texts(list: &Json) -> Vec<String> {
    list.as_array().into_iter().flatten().filter_map(Json::as_str).map(str::to_owned).collect()
}

/// Returns the times between which the agent knows values, ns.
fn extent(client: &mut Client) -> Result<(u64, u64), Failure> {
    let playback: Json = client.call("GET", "/playback", None)?;
    let number = |value: &Json| value.as_u64().unwrap_or_default();
    if !playback.is_null() {
        let begin = number(&playback["begin"]);
        return Ok((begin + number(&playback["from"]), begin + number(&playback["to"])));
    }
    let recordings: Json = client.call("GET", "/recordings", None)?;
    match &recordings["flight"] {
        Json::Null => Err(Failure::NothingToExport { agent: client.name().to_owned() }),
        flight => Ok((number(&flight["from"]), number(&flight["to"]))),
    }
}

#[derive(Deserialize)]
struct HistoryAnswer {
    values: Vec<HistoryValue>,
    next: Option<String>,
}

#[derive(Deserialize)]
struct HistoryValue {
    time: u64,
    sequence: u64,
    value: Json,
}

/// Reads at most `limit` values of a property, spread evenly.
/// Of large values, as many as fit.
fn history(client: &mut Client, agent: &str, path: &str, limit: u64) -> Result<Vec<RecordedSample>, Failure> {
    let read = |client: &mut Client, query: &str| -> Result<HistoryAnswer, Failure> {
        Ok(client.call("GET", &format!("/history/{agent}/{path}?{query}"), None)?)
    };
    let newest = match read(client, "limit=1") {
        // Properties of the playback itself have no recorded values.
        Err(Failure::Agent(ClientError::Refused(_))) => return Ok(Vec::new()),
        newest => newest?.values,
    };
    let Some(HistoryValue { value, .. }) = newest.first() else { return Ok(Vec::new()) };
    let fitting = (MAX_SIZE / value.to_string().len().max(1)) as u64;
    let limit = limit.min(fitting.max(1));
    let mut samples: Vec<RecordedSample> = Vec::new();
    let mut query = format!("limit={limit}");
    loop {
        let HistoryAnswer { values, next } = read(client, &query)?;
        samples
            .extend(values.into_iter().map(|HistoryValue { time, sequence, value }| (time, sequence, value)));
        let left = limit.saturating_sub(samples.len() as u64);
        match next {
            Some(next) if left > 0 => query = format!("from={next}&limit={left}"),
            _ => return Ok(samples),
        }
    }
}
