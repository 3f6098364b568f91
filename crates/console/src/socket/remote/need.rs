//! What a call takes: who may make it, and what becomes of the file that it names.

use std::path::{Path, PathBuf};

use serde_json::Value as Json;
use slate_blackboard::Url;
use slate_runtime::playback::Order;
use slate_runtime::remote::Call;

use crate::Role;
use crate::api::{recordings, snapshots};
use crate::context::Context;
use crate::problem::Problem;

/// What a call takes.
pub(super) struct Need<'c> {
    /// Who may make it, and whoever may more.
    pub role: Role,
    /// The file that it names, and which files it may name.
    pub file: Option<(&'c mut PathBuf, Files)>,
}

/// Which files a call may name. Whoever may name any file may overwrite any, so a name has no folder here: that is the agent's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Files {
    /// A recording in the folder of the report, which may have to be a new one.
    Recording { is_new: bool },
    /// A trace there, a new one.
    Trace,
    /// A snapshot.
    Snapshot,
    /// Values of another agent, beside the snapshots.
    Values,
    /// None: the code of a plugin is chosen by who may log in there.
    Library,
}

/// What a call takes. Roles are those that the operations of the API have which do the same.
pub(super) fn need<'c>(context: &Context, call: &'c mut Call) -> Need<'c> {
    use Role::{Developer, Operator, Viewer};
    let with = |role, file, files| Need { role, file: Some((file, files)) };
    let role = match call {
        // Whoever looks, and a stop is for everybody.
        Call::PluginList {}
        | Call::ModuleList {}
        | Call::LinkList {}
        | Call::Peers {}
        | Call::ConfigGet { .. }
        | Call::ConfigDiff {}
        | Call::ConfigRefused {}
        | Call::PropertyList { .. }
        | Call::Read { .. }
        | Call::ReadHistory { .. }
        | Call::RecordStatus {}
        | Call::Watch { .. }
        | Call::Measure { .. }
        | Call::ControlsList {}
        | Call::Replay { order: Order::Status }
        | Call::Stop { .. } => Viewer,
        // Whoever drives.
        Call::PropertySet { url, value } => match is_for_operators(context, url, value) {
            true => Operator,
            false => Developer,
        },
        Call::MessageSend { .. }
        | Call::ControlsTake { .. }
        | Call::ControlsCommand { .. }
        | Call::ControlsRelease {}
        | Call::ControlsLeave {}
        | Call::Replay {
            order:
                Order::Pause | Order::Resume | Order::Step(_) | Order::Seek(_) | Order::Rate(_) | Order::Loop(_),
        }
        | Call::Reset {}
        | Call::Arm { .. }
        | Call::RecordStop { file: None } => Operator,
        Call::RecordStart { file, .. } | Call::RecordSnapshot { file } => {
            return with(Operator, file, Files::Recording { is_new: true });
        }
        Call::RecordStop { file: Some(file) } => {
            return with(Operator, file, Files::Recording { is_new: false });
        }
        // Whoever changes the agent.
        Call::PluginLoad { file: None, .. }
        | Call::PluginUnload { .. }
        | Call::PluginReload { file: None, .. }
        | Call::PluginEndShadow { .. }
        | Call::PluginPromote { .. }
        | Call::ModuleEnable { .. }
        | Call::ModuleDisable { .. }
        | Call::Link { .. }
        | Call::Unlink { .. }
        | Call::ConfigSet { .. }
        | Call::ConfigRevert { .. }
        | Call::ConfigSave { .. }
        | Call::TraceProgress {}
        | Call::TraceEnd {} => Developer,
        Call::PluginLoad { file: Some(file), .. }
        | Call::PluginReload { file: Some(file), .. }
        | Call::PluginShadow { file, .. } => return with(Developer, file, Files::Library),
        Call::TraceRecord { file } => return with(Developer, file, Files::Trace),
        Call::SnapshotSave { file } | Call::SnapshotLoad { file } => {
            return with(Developer, file, Files::Snapshot);
        }
        Call::SnapshotRemote { file, .. } => return with(Developer, file, Files::Values),
    };
    Need { role, file: None }
}

/// Whether what a URL leads to is an operator's to set: an input of a module here, as goals are inputs, or a parameter that the
/// configuration gives operators. All else is a developer's.
fn is_for_operators(context: &Context, url: &str, value: &Json) -> bool {
    let is_own = |url: &Url| url.agent().is_none_or(|agent| agent == context.agent());
    let Some(url) = Url::parse(url).ok().filter(is_own) else { return false };
    let path = url.path_in("");
    let modules = context.desk.composer().modules().into_iter().map(|module| module.name);
    let ports =
        modules.filter_map(|module| path.strip_prefix(&module)?.strip_prefix('/').map(ToOwned::to_owned));
    // The module with the longest name has it.
    let port = ports.min_by_key(String::len);
    port.is_some_and(|port| match port.split('/').next() {
        Some("enabled") => false,
        Some("params") => context.is_operable(&path, value),
        _ => true,
    })
}

impl Files {
    /// Where a file of that name is.
    pub fn place(self, context: &Context, name: &Path) -> Result<PathBuf, Problem> {
        let stem = |kind: &str| {
            let name = name.to_str().unwrap_or_default();
            name.strip_suffix(kind).and_then(|name| name.strip_suffix('.')).unwrap_or(name)
        };
        let recording = stem(recordings::KIND);
        match self {
            Self::Recording { is_new: true } => recordings::new_file(context, recording, recordings::KIND),
            Self::Recording { is_new: false } => recordings::file(context, recording, recordings::KIND),
            Self::Trace => recordings::new_file(context, stem("json"), "json"),
            Self::Snapshot => snapshots::file(stem(snapshots::KIND), snapshots::KIND),
            Self::Values => snapshots::file(stem("json"), "json"),
            Self::Library => {
                let help =
                    "name a plugin of the configuration, or load the library at the computer of the agent";
                Err(Problem::bad("a library can't be named over the network", help))
            }
        }
    }
}
