//! What a recording says of the run: what is needed to make it again.

use std::collections::BTreeMap;
use std::time::UNIX_EPOCH;

use slate_runtime::Agent;
use slate_runtime::configuration::Record;

/// The name of the attached configuration.
pub(crate) const CONFIGURATION: &str = "configuration.toml";

/// What is added to the agent's time for that of the file: in lockstep nothing, and else the date of its start, so that
/// recordings of several robots fit together.
pub(super) fn epoch(agent: &Agent) -> u64 {
    if agent.is_lockstep() {
        return 0;
    }
    let date = agent.date_of(0).duration_since(UNIX_EPOCH).unwrap_or_default();
    u64::try_from(date.as_nanos()).unwrap_or_default()
}

/// The metadata that stand at the beginning.
pub(super) fn metadata(agent: &Agent, settings: &Record) -> Vec<(&'static str, BTreeMap<String, String>)> {
    let composer = agent.composer();
    let configuration = agent.configuration();
    let is_whole =
        settings.exclude.is_empty() && settings.select.iter().any(|pattern| pattern.to_string() == "**");
    let date = agent.date_of(agent.now()).duration_since(UNIX_EPOCH).unwrap_or_default();
    let name = agent.board().agent();
    let run = [
        ("agent", name.to_owned()),
        // The name and the date are enough to tell one run from another.
        ("run", format!("{name}-{:x}-{:x}", date.as_nanos(), std::process::id())),
        ("seed", configuration.seed().value.to_string()),
        ("clock", if agent.is_lockstep() { "lockstep" } else { "wall" }.into()),
        ("epoch_ns", epoch(agent).to_string()),
        ("armed", agent.begins_armed().to_string()),
        ("from_cycle", composer.cycles().to_string()),
        ("slate", env!("CARGO_PKG_VERSION").into()),
        ("whole", is_whole.to_string()),
    ];
    let memories = agent.memories().map(|(module, began)| {
        (module.to_owned(), began.map_or_else(|| "none".into(), |hash| format!("{hash:016x}")))
    });
    let plugins = composer
        .plugin_marks()
        .into_iter()
        .map(|plugin| (plugin.name, format!("{} {:016x}", plugin.version, plugin.hash)));
    let modules = composer.modules().into_iter().map(|module| (module.name, module.kind));
    let stages = composer
        .order()
        .into_iter()
        .enumerate()
        .map(|(place, (stage, modules))| (format!("{place:02} {stage}"), modules.join(" ")));
    let links = composer.links().into_iter().map(|link| (link.to, link.from));
    vec![
        ("run", run.map(|(key, value)| (key.to_owned(), value)).into()),
        ("plugins", plugins.collect()),
        ("memories", memories.collect()),
        ("modules", modules.collect()),
        ("stages", stages.collect()),
        ("links", links.collect()),
    ]
}

/// Name, type and bytes of each file that goes along.
pub(super) fn attachments(agent: &Agent) -> Vec<(String, &'static str, Vec<u8>)> {
    let text = agent.composer().configuration_text();
    vec![(CONFIGURATION.to_owned(), "application/toml", text.into_bytes())]
}
