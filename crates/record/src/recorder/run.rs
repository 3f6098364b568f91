//! What a recording says of the run: what is needed to make it again.

use std::collections::BTreeMap;

use slate_blackboard::Board;
use slate_runtime::recording::RecordedAgent;

use super::host::Host;

/// The name of the attached configuration.
pub const CONFIGURATION: &str = "configuration.toml";

/// The properties that nobody has written yet, each with its interface: what is not in the file of them was not lost.
pub(super) fn unwritten(board: &Board) -> BTreeMap<String, String> {
    let properties = board.properties().into_iter();
    let silent = properties.filter(|own| own.channel().is_some_and(|channel| channel.published() == 0));
    silent.map(|own| (format!("/{}", own.path()), own.descriptor().name.to_owned())).collect()
}

/// What stands at the beginning of a file.
#[derive(Clone)]
pub(super) struct Preface {
    /// What is added to the agent's time for that of the file.
    pub epoch: u64,
    pub metadata: Vec<(&'static str, BTreeMap<String, String>)>,
    /// Name, type and bytes of each file that goes along.
    pub attachments: Vec<(String, &'static str, Vec<u8>)>,
}

impl Preface {
    /// `is_whole` says whether all is recorded, and `is_first` whether it is from before the run on.
    pub fn new(host: &Host, composer: &dyn RecordedAgent, is_whole: bool, is_first: bool) -> Self {
        let mut run = host.run.clone();
        run.insert("from_cycle".into(), composer.cycles().to_string());
        run.insert("whole".into(), is_whole.to_string());
        // Recordings of before have none.
        run.insert("messages".into(), "true".into());
        run.insert("begins".into(), if is_first { "with the run" } else { "in the run" }.into());
        let plugins = composer
            .plugin_marks()
            .into_iter()
            .map(|plugin| (plugin.name, format!("{} {:016x}", plugin.version, plugin.hash)));
        let metadata = vec![
            ("run", run),
            ("plugins", plugins.collect()),
            ("memories", host.memories.clone()),
            ("modules", composer.kinds().into_iter().collect()),
            ("stages", told_stages(composer.order())),
            ("links", composer.links().into_iter().collect()),
        ];
        let text = composer.configuration_text();
        let own = (CONFIGURATION.to_owned(), "application/toml", text.into_bytes());
        let others = host.files.iter().map(|(name, bytes)| (name.clone(), "application/toml", bytes.clone()));
        let attachments = std::iter::once(own).chain(others).collect();
        Self { epoch: host.epoch, metadata, attachments }
    }
}

/// The modules of each stage, in the order in which they run.
pub(super) fn told_stages(order: Vec<(String, Vec<String>)>) -> BTreeMap<String, String> {
    let stages = order.into_iter().enumerate();
    stages.map(|(place, (stage, modules))| (format!("{place:02} {stage}"), modules.join(" "))).collect()
}

/// The URL of an inbox.
pub(super) fn absolute(path: &str) -> String {
    if path.contains("://") { path.to_owned() } else { format!("/{path}") }
}
