//! The seam to what records an agent: it sees every value that is written, and is told what is changed from outside.

use std::path::PathBuf;

use slate_blackboard::Taps;

use crate::configuration::{Database, Options, Report};
pub use crate::snapshot::PluginMark;

/// Records an agent. It sees the values of each property that it has a [tap](Taps::tap) for, in the threads that write
/// them.
pub trait Recording: Taps {
    /// The agent was changed by somebody outside of it, and not by one of its modules: between its cycle of that number and
    /// the next one if it is in lockstep.
    fn changed(&self, cycle: u64, time: u64, change: &Change);
}

/// A change of an agent that runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Change {
    /// The setting at a path has that value, or is as the files say it if there is none.
    Setting {
        /// As `--set` takes it; or `MODULE/enabled`, for a switch that is not in the configuration.
        path: String,
        /// As TOML.
        value: Option<String>,
    },
    /// A plugin goes on with the code of that library.
    Reload {
        /// The plugin.
        plugin: String,
        /// The library.
        file: PathBuf,
        /// A hash over it.
        hash: u64,
    },
    /// Something that can't be made again from a recording.
    Other {
        /// What, in words.
        what: String,
    },
}

/// The configuration that a recorded agent had, to load one like it: `text` is what
/// [`Composer::configuration_text`](crate::Composer::configuration_text) gave. `sets` are settings of the command line that go over it.
///
/// # Errors
/// When it is none any more, or a setting is wrong.
pub fn configuration(name: &str, text: &str, sets: Vec<String>) -> Result<Database, Report> {
    // Whatever stands at the top was meant for somebody.
    let document = text.parse::<toml_edit::DocumentMut>().unwrap_or_default();
    let extra_tables = document.iter().map(|(name, _)| name.to_owned()).collect();
    let options = Options { sets, extra_tables, ..Options::default() };
    Database::from_text(name, text, options)
}
