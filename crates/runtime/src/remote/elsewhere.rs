//! What tools ask of another agent, through one that knows it.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Duration;

use serde_json::json;
use slate_blackboard::nearest_paths;

use super::desk::{Desk, Done, reading, refusal, result};
use super::protocol::{PropertyEntry, Refusal, RemoteSnapshotEntry};
use crate::sharing::RemoteProperty;

/// How long the other agent may take for an answer.
const LIMIT: Duration = Duration::from_secs(1);

/// The agent and the path or pattern of a whole URL.
pub(super) fn split(url: &str) -> Option<(&str, &str)> {
    let rest = url.strip_prefix("slate://")?;
    Some(rest.split_once('/').unwrap_or((rest, "**")))
}

impl Desk {
    /// The agent and what is asked of it, when that is another one than this.
    pub(super) fn elsewhere<'u>(&self, url: &'u str) -> Option<(&'u str, &'u str)> {
        split(url).filter(|(agent, _)| *agent != self.composer.board().agent())
    }

    pub(super) fn remote_properties(&self, agent: &str, pattern: &str) -> Done {
        let entry = |property: RemoteProperty| PropertyEntry {
            path: property.path,
            interface: property.descriptor.name.into(),
            doc: property.doc,
        };
        let properties = self.some_of(agent, pattern, false)?;
        result(properties.into_iter().map(entry).collect::<Vec<_>>())
    }

    pub(super) fn remote_read(&self, agent: &str, path: &str) -> Done {
        // What stands behind the property is a field; only the other agent knows where that begins.
        let ends = path.rmatch_indices('/').map(|(end, _)| end);
        for end in [path.len()].into_iter().chain(ends) {
            let (property, field) = (&path[..end], path[end..].trim_start_matches('/'));
            if let Some(property) = self.ask(agent, property, true)?.first() {
                let value = property.value(field);
                let value = value.map_err(|error| {
                    refusal(format!("slate://{agent}/{}: {error}", property.path), &seen(agent))
                })?;
                return result(value.map(reading));
            }
        }
        Err(self.nothing_at(agent, path))
    }

    /// Writes the newest values of properties into a file, which is there as a whole or not at all.
    pub(super) fn remote_snapshot(&self, url: &str, file: &Path) -> Done {
        let Some((agent, pattern)) = self.elsewhere(url) else {
            let message = format!("`{url}` names no other agent");
            return Err(refusal(message, "such as slate://other/**; without it all of this agent is saved"));
        };
        let properties = self.some_of(agent, pattern, true)?;
        let entry = RemoteSnapshotEntry {
            agent: agent.into(),
            properties: properties.len(),
            values: properties.iter().filter(|property| property.newest.is_some()).count(),
        };
        write(agent, &properties, file).map_err(|error| {
            let message = format!("{} can't be written: {error}", crate::printable(file));
            refusal(message, "name a file in a folder that can be written to")
        })?;
        result(entry)
    }

    /// At least one property.
    fn some_of(&self, agent: &str, pattern: &str, values: bool) -> Result<Vec<RemoteProperty>, Refusal> {
        let found = self.ask(agent, pattern, values)?;
        if !found.is_empty() {
            return Ok(found);
        }
        let beginning: Vec<_> = pattern.split('/').take_while(|name| !name.starts_with('*')).collect();
        Err(self.nothing_at(agent, &beginning.join("/")))
    }

    fn ask(&self, agent: &str, pattern: &str, values: bool) -> Result<Vec<RemoteProperty>, Refusal> {
        // One that is none would match nothing there.
        slate_blackboard::Pattern::parse(pattern).map_err(|error| {
            refusal(error.to_string(), "such as slate://robot/planner/* or slate://robot/**")
        })?;
        let inspection = self.composer.inspection().ok_or_else(|| {
            let message = format!("this agent shares nothing, so it knows no agent `{agent}`");
            refusal(message, "give it a [share] table, or ask the other agent itself with --agent")
        })?;
        let known = "`slate peers` shows the agents that this one knows, and why they are not there";
        inspection.list(agent, pattern, values, LIMIT).map_err(|reason| refusal(reason, known))
    }

    /// There is no such property.
    fn nothing_at(&self, agent: &str, path: &str) -> Refusal {
        let all = self.ask(agent, "**", false).unwrap_or_default();
        let near = nearest_paths(path, '/', all.iter().map(|property| property.path.as_str()));
        let near = if near.is_empty() { String::new() } else { format!("; nearest: {}", near.join(", ")) };
        refusal(format!("no property at slate://{agent}/{path}{near}"), &seen(agent))
    }
}

fn seen(agent: &str) -> String {
    format!("`slate list slate://{agent}/**` shows the properties")
}

/// One property after the other, as the text of a value takes far more memory than the value.
fn write(agent: &str, properties: &[RemoteProperty], file: &Path) -> std::io::Result<()> {
    let mut name = file.file_name().unwrap_or_default().to_owned();
    name.push(".part");
    let part = file.with_file_name(name);
    let written = File::create(&part).and_then(|opened| {
        let mut out = BufWriter::new(opened);
        write!(out, "{{\"agent\":{},\"properties\":[", json!(agent))?;
        for (index, property) in properties.iter().enumerate() {
            let newest = property.value("").ok().flatten().map(reading);
            let entry = json!({
                "path": property.path,
                "interface": property.descriptor.name,
                "schema": format!("{:016x}", property.descriptor.hash),
                "newest": newest,
            });
            write!(out, "{}\n{entry}", if index == 0 { "" } else { "," })?;
        }
        out.write_all(b"\n]}\n")?;
        out.into_inner().map_err(|error| error.into_error())?.sync_all()?;
        fs::rename(&part, file)
    });
    if written.is_err() {
        // It may not even have been made.
        let _ = fs::remove_file(&part);
    }
    written
}
