//! Metadata of a run, which are needed to repeat it.

use slate_blackboard::Board;
use slate_sorted::SortedMap;

/// The name of the attached configuration.
pub const CONFIGURATION: &str = "configuration.toml";

/// Returns the properties never written yet, each with its interface.
/// The file does not lack their values.
pub(super) fn unwritten(board: &Board) -> SortedMap<String, String> {
    let properties = board.properties().into_iter();
    let silent = properties.filter(|own| own.channel().is_some_and(|channel| channel.published() == 0));
    silent.map(|own| (format!("/{}", own.path()), own.descriptor().name.to_owned())).collect()
}

/// The beginning of a file.
#[derive(Clone)]
pub(super) struct RecordingHeader {
    /// Offset from the agent's time to that of the file, nanoseconds.
    pub epoch: u64,
    pub metadata: Vec<(&'static str, SortedMap<String, String>)>,
    /// Name, type and bytes of each file that goes along.
    pub attachments: Vec<(String, &'static str, Vec<u8>)>,
}

/// Returns the modules of each stage, in the order in which they run.
pub(super) fn stage_modules(order: Vec<(String, Vec<String>)>) -> SortedMap<String, String> {
    let stages = order.into_iter().enumerate();
    stages.map(|(index, (stage, modules))| (format!("{index:02} {stage}"), modules.join(" "))).collect()
}

/// Returns the URL of an inbox.
pub(super) fn inbox_url(path: &str) -> String {
    if path.contains("://") { path.to_owned() } else { format!("/{path}") }
}
