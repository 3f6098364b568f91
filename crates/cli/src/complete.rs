//! Candidates for shell completion.

use std::ffi::OsStr;
use std::sync::mpsc::channel;
use std::time::Duration;

use clap::ValueEnum;
use clap_complete::CompletionCandidate;
use slate::control::Client;
use slate::runtime::directory::agents;
use slate_sorted::SortedSet;

use crate::examples;
use crate::local_agents::query_default;

/// Time limit for candidates.
/// A person waits for the key; names that come later are not offered.
const CANDIDATE_TIMEOUT: Duration = Duration::from_millis(150);

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Shell {
    Bash,
    Elvish,
    Fish,
    Powershell,
    Zsh,
}

/// Returns the candidates that `find` finds in time.
fn in_time(find: impl FnOnce() -> SortedSet<String> + Send + 'static) -> SortedSet<String> {
    let (sender, found) = channel();
    // A hanging query ends with this program; without a thread, nothing is found.
    let _ = std::thread::Builder::new().spawn(move || sender.send(find()));
    found.recv_timeout(CANDIDATE_TIMEOUT).unwrap_or_default()
}

fn candidates(names: SortedSet<String>, current: &OsStr) -> Vec<CompletionCandidate> {
    let current = current.to_string_lossy().into_owned();
    names.into_iter().filter(|name| name.starts_with(&current)).map(CompletionCandidate::new).collect()
}

/// Completes the names of local agents.
pub fn of_agents(current: &OsStr) -> Vec<CompletionCandidate> {
    candidates(in_time(|| agents().into_iter().collect()), current)
}

/// Completes properties of the default remote agent, else of all local agents.
pub fn of_properties(current: &OsStr) -> Vec<CompletionCandidate> {
    // A path may begin without its slash.
    let slash = if current.to_string_lossy().starts_with('/') || current.is_empty() { "/" } else { "" };
    let found = in_time(move || {
        let all = query_default(|client| client.properties(None)).into_iter().flatten();
        all.map(|property| format!("{slash}{}", property.path)).collect()
    });
    candidates(found, current)
}

/// Completes the names of modules.
pub fn of_modules(current: &OsStr) -> Vec<CompletionCandidate> {
    let found =
        in_time(|| query_default(Client::modules).into_iter().flatten().map(|module| module.name).collect());
    candidates(found, current)
}

/// Completes linked inputs.
pub fn of_links(current: &OsStr) -> Vec<CompletionCandidate> {
    let found = in_time(|| query_default(Client::links).into_iter().flatten().map(|link| link.to).collect());
    candidates(found, current)
}

/// Completes the examples, and the configurations of this folder.
pub fn of_configurations(current: &OsStr) -> Vec<CompletionCandidate> {
    let text = current.to_string_lossy().into_owned();
    let (folder, _) = text.rsplit_once('/').unwrap_or((".", ""));
    let entries = std::fs::read_dir(if folder.is_empty() { "/" } else { folder });
    let files = entries.into_iter().flatten().flatten().filter_map(|entry| {
        let name = entry.file_name().to_str()?.to_owned();
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        let name = if is_folder { format!("{name}/") } else { name };
        let prefix = if text.contains('/') { format!("{folder}/") } else { String::new() };
        (is_folder && !name.starts_with('.') || name.ends_with(".toml")).then(|| format!("{prefix}{name}"))
    });
    candidates(files.chain(examples::names().map(String::from)).collect(), current)
}
