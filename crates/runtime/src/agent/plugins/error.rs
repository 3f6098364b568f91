use std::path::PathBuf;
use std::time::Duration;

use slate_configuration::ErrorCode;
use slate_configuration::Report;
use slate_engine::plugin::LibraryError;

/// Error of changing plugins; the agent continues unchanged.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum PluginError {
    /// File that is not a suitable plugin.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Library(#[from] LibraryError),
    /// Mismatch with the configuration.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Unfit(#[from] Report),
    /// A plugin of that name is already loaded.
    #[error("plugin `{name}` is already loaded")]
    #[diagnostic(help("reload it to exchange its code, or unload it first"))]
    Loaded {
        /// Name.
        name: String,
    },
    /// Two plugins bring the same kind of module.
    #[error("plugin `{name}` defines the module kind `{kind}`, which plugin `{other}` already defines")]
    #[diagnostic(help("unload `{other}` first, or give the kind another name"))]
    SameKind {
        /// New plugin.
        name: String,
        /// The kind.
        kind: String,
        /// Plugin that has the kind already.
        other: String,
    },
    /// Unknown plugin.
    #[error("no plugin `{name}`{}", nearest(.near))]
    #[diagnostic(help("name a loaded plugin, one of [plugins] in the configuration, or a library's file"))]
    Unknown {
        /// Requested name.
        name: String,
        /// Most similar names.
        near: Vec<String>,
    },
    /// Known, but not loaded.
    #[error("plugin `{name}` is not loaded")]
    #[diagnostic(help("load it first: slate plugin load {name}"))]
    NotLoaded {
        /// Name.
        name: String,
    },
    /// List whose plugins are not loaded.
    #[error("no plugin of the list `{name}` is loaded")]
    #[diagnostic(help("load them first: slate plugin load {name}"))]
    NoneLoaded {
        /// Name.
        name: String,
    },
    /// List of plugins in place of one; code is exchanged for one plugin at a time.
    #[error("`{name}` is a list of plugins, and code is exchanged one plugin at a time")]
    #[diagnostic(help("do it for each of its plugins: {}", .members.join(", ")))]
    List {
        /// Name.
        name: String,
        /// Plugins of the list.
        members: Vec<String>,
    },
    /// Plugin without a file in the configuration.
    #[error("plugin `{name}` has neither a file nor a list of plugins in the configuration")]
    #[diagnostic(help("give it one: [plugins.{name}] file = \"lib{name}.so\""))]
    NoFile {
        /// Name.
        name: String,
    },
    /// Linked into the program.
    #[error("plugin `{name}` is linked in, so there is no file that it can be reloaded from")]
    #[diagnostic(help("name the library that replaces it"))]
    LinkedIn {
        /// Name.
        name: String,
    },
    /// Missing dependency of a plugin.
    #[error("plugin `{name}` needs plugin `{dependency}`, which does not exist")]
    #[diagnostic(help("add [plugins.{dependency}] with its file to the configuration, or load it first"))]
    Missing {
        /// The plugin.
        name: String,
        /// Missing dependency.
        dependency: String,
    },
    /// Circular dependency of plugins.
    #[error("cyclic dependency of plugins: {}", .circle.join(" -> "))]
    #[diagnostic(help("remove one dependency from a `plugin!` line"))]
    Circle {
        /// The plugins, the first one again at the end.
        circle: Vec<String>,
    },
    /// Dependency of another plugin.
    #[error("plugin `{name}` is needed by {}", .by.join(", "))]
    #[diagnostic(help("unload those first"))]
    Needed {
        /// The plugin.
        name: String,
        /// The plugins that need it.
        by: Vec<String>,
    },
    /// Library of another plugin.
    #[error("{} is plugin `{found}`, expected `{expected}`", slate_configuration::printable(.file))]
    #[diagnostic(help("load it as a plugin of its own, or name the plugin that it replaces"))]
    OtherPlugin {
        /// The library.
        file: PathBuf,
        /// Found plugin.
        found: String,
        /// Expected plugin.
        expected: String,
    },
    /// Veto of a module against unloading.
    #[error("module `{module}` can't be unloaded now: {reason}")]
    #[diagnostic(help("bring it into a state in which it can, and try again"))]
    Veto {
        /// The module.
        module: String,
        /// Reason.
        reason: String,
    },
    /// A module's code did not return.
    #[error(
        "module `{module}` has not returned from its last call, so nothing of it can be saved or unloaded"
    )]
    #[diagnostic(help("wait until it returns; an isolated module could be ended"))]
    Late {
        /// The module.
        module: String,
    },
    /// A thread of a module does not stop.
    #[error("thread `{thread}` of module `{module}` has not ended within {limit:?} after the stop request")]
    #[diagnostic(help("wait until it ends and try again; a thread that waits for a device needs a timeout"))]
    Thread {
        /// The module.
        module: String,
        /// Thread.
        thread: String,
        /// Time waited.
        limit: Duration,
    },
    /// A module could not be made.
    #[error("module `{module}` can't be set up by the new code: {reason}")]
    #[diagnostic(help("fix its parameters or the code"))]
    Refused {
        /// The module.
        module: String,
        /// Reason.
        reason: String,
    },
    /// A shadow can't run beside the plugin, or take over.
    #[error("plugin `{name}`: {reason}")]
    #[diagnostic(help("{help}"))]
    Shadow {
        /// The plugin.
        name: String,
        /// Reason.
        reason: String,
        /// Remedy.
        help: String,
    },
    /// Time source of the agent.
    #[error("module `{module}` is the time source, and without it no time passes")]
    #[diagnostic(help("reload the plugin to exchange its code, or end the agent"))]
    TimeSource {
        /// The module.
        module: String,
    },
}

impl PluginError {
    /// Error code, if any.
    pub fn error_code(&self) -> Option<ErrorCode> {
        Some(match self {
            Self::Library(_) | Self::SameKind { .. } | Self::OtherPlugin { .. } => ErrorCode::Library,
            Self::Unfit(report) => return report.error_code(),
            Self::Unknown { .. } | Self::NotLoaded { .. } | Self::NoneLoaded { .. } => ErrorCode::Name,
            Self::Circle { .. } => ErrorCode::Circle,
            Self::TimeSource { .. } => ErrorCode::TimeSource,
            _ => return None,
        })
    }
}

fn nearest(names: &[String]) -> String {
    if names.is_empty() { String::new() } else { format!("; nearest: {}", names.join(", ")) }
}
