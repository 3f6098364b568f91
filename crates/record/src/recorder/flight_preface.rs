//! Metadata of the last seconds: the state of the run at their first value.

use slate_runtime::configuration::{Link, Value};
use slate_runtime::recording::RecordedAgent;
use slate_runtime::recording::configuration;
use slate_sorted::{SortedMap, SortedSet};

use super::flight::{Captured, Past};
use super::host::{AgentContent, Host};
use super::run::{CONFIGURATION, RecordingHeader, inbox_url, stage_modules};

/// Returns the preface of a file with the last seconds.
/// Changes within them are messages of the file.
pub(super) fn recording_header(
    host: &Host,
    composer: &dyn RecordedAgent,
    captured: &Captured,
) -> RecordingHeader {
    let now = || host.recording_header(&AgentContent::of(composer), composer.board(), false, false);
    let Some((began, first)) = &host.began else { return now() };
    // New code brings modules with settings of their own: what holds now is nearer to it than what held at the beginning.
    let known = if captured.past.has_new_code { None } else { changed(first, &captured.past) };
    let mut recording_header = known.unwrap_or_else(now);
    let from_cycle = |(name, run): &(&str, SortedMap<String, String>)| {
        (*name == "run").then(|| run.get("from_cycle")?.parse::<u64>().ok()).flatten()
    };
    let before = first.metadata.iter().find_map(from_cycle).unwrap_or_default();
    let since = captured.from.saturating_sub(*began).saturating_add(host.period / 2);
    // On the wall clock a cycle may have been left out, but never the first one.
    let since = since.checked_div(host.period).unwrap_or_default().max(1);
    let since = if captured.past.is_there { since } else { 0 };
    for (_, run) in recording_header.metadata.iter_mut().filter(|(name, _)| *name == "run") {
        run.insert("from_cycle".into(), before.saturating_add(since).to_string());
    }
    recording_header
}

/// Returns the preface with the settings that were changed since the beginning.
/// `None` if the result is not a valid configuration.
fn changed(first: &RecordingHeader, past: &Past) -> Option<RecordingHeader> {
    let mut recording_header = first.clone();
    if let Some(order) = past.stages.clone() {
        let stages = recording_header.metadata.iter_mut().filter(|(name, _)| *name == "stages");
        stages.for_each(|(_, stages)| *stages = stage_modules(order.clone()));
    }
    if past.settings.is_empty() {
        return Some(recording_header);
    }
    let (name, _, bytes) =
        recording_header.attachments.iter_mut().find(|(name, ..)| name == CONFIGURATION)?;
    let text = merge_changes(&String::from_utf8_lossy(bytes), past);
    let current = configuration(name, &text, Vec::new()).ok()?.current();
    *bytes = text.into_bytes();
    for (_, links) in recording_header.metadata.iter_mut().filter(|(name, _)| *name == "links") {
        let inboxes: SortedSet<String> = links.values().cloned().collect();
        let entry = |link: &Link| {
            let (to, from) = (link.to.value.clone(), link.from.value.to_string());
            // An inbox stays one.
            match inbox_url(&to) {
                inbox if inboxes.contains(&inbox) => (from.trim_start_matches('/').to_owned(), inbox),
                _ => (to, from),
            }
        };
        *links = current.links().iter().map(entry).collect();
    }
    Some(recording_header)
}

/// Returns the configuration with the changes, a line for each setting.
fn merge_changes(text: &str, past: &Past) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for (path, value) in &past.settings {
        let value = match value {
            Some(value) => value.as_str(),
            // The input itself, and none of the options of its link.
            None if path.starts_with("links.") && path.ends_with('"') => "false",
            None => continue,
        };
        // A switch that is past the configuration.
        let paths = match path.strip_suffix("/enabled") {
            Some(module) if !module.contains('.') => {
                let quoted = Value::Text(module.into());
                vec![format!("modules.{quoted}.enabled"), format!("modules.{module}.enabled")]
            }
            _ => vec![path.clone()],
        };
        // A link may have had options, each with a line, and what has no settings at all has one too.
        let is_replaced = |line: &str| {
            let own = line.split_once(" = ").map_or(line, |(own, _)| own);
            paths.iter().any(|path| own == path || is_below(own, path) || is_below(path, own))
        };
        lines.retain(|line| !is_replaced(line));
        lines.push(format!("{} = {value}", paths[0]));
    }
    lines.push(String::new());
    lines.join("\n")
}

/// Returns true if a path is that of a setting within another path.
fn is_below(path: &str, other: &str) -> bool {
    path.strip_prefix(other).is_some_and(|rest| rest.starts_with('.'))
}
