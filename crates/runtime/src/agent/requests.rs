//! The agent's implementation of the narrow traits that others know it by.
//! These are its modules, the sharing and the recording.

use std::sync::Arc;

use slate_blackboard::Board;
use slate_module::aspect::Plugins;

use super::Composer;
use super::handle::{AgentHandle, WeakHandle};
use super::plugins::{PluginLoader, Reloader};
use super::settings::SettingsChanger;
use crate::aspects::{PluginChanges, SettingsChanges};
use crate::recording::RecordedAgent;
use crate::snapshot::PluginMark;

/// Answer to a module's request while the agent ends.
const ENDS: &str = "the agent ends";

impl PluginChanges for WeakHandle {
    fn change_plugins(&self, module: &str, what: u32, plugin: &str) -> Result<String, String> {
        let agent = self.upgrade().ok_or(ENDS)?;
        agent.recorder.make_for_module(module, "a change of plugins requested by a module", || {
            carry_out(&agent, module, what, plugin)
        })
    }
}

fn carry_out(agent: &AgentHandle, module: &str, what: u32, plugin: &str) -> Result<String, String> {
    let loader = PluginLoader::new(agent);
    let done = match what {
        Plugins::LOAD => loader.load(plugin).map(|loaded| format!("modules: {}", loaded.modules.join(", "))),
        Plugins::UNLOAD if loader.runs(module, plugin) => {
            return Err(format!("`{plugin}` has the code of `{module}`, which asks for it to be unloaded"));
        }
        Plugins::UNLOAD => loader.unload(plugin).map(|libraries| {
            let became = |(name, state): &(String, &str)| format!("the library of {name} is {state}");
            libraries.iter().map(became).collect::<Vec<_>>().join(", ")
        }),
        Plugins::RELOAD => Reloader::new(agent).reload(plugin, None).map(|reload| {
            let became = |(module, state): &(String, Result<(), String>)| match state {
                Ok(()) => format!("{module} continues with its state"),
                Err(reason) => format!("{module} restarts with a fresh state: {reason}"),
            };
            reload.modules.iter().map(became).collect::<Vec<_>>().join(", ")
        }),
        other => return Err(format!("there is no request {other}")),
    };
    done.map_err(|error| error.to_string())
}

impl SettingsChanges for WeakHandle {
    fn change_settings(&self, module: &str, lines: &str) -> Result<String, String> {
        let agent = self.upgrade().ok_or(ENDS)?;
        // In a run that is made again, as it was then.
        let answer = agent.shared.recorded_answer(module, lines).unwrap_or_else(|| {
            SettingsChanger::new(&agent).change_for(module, lines).map_err(|report| report.to_string())
        });
        agent.recorder.record_request(module, lines, &answer);
        answer
    }
}

impl RecordedAgent for Composer {
    fn board(&self) -> &Arc<Board> {
        self.board()
    }

    fn now(&self) -> u64 {
        self.now()
    }

    fn cycles(&self) -> u64 {
        self.cycles()
    }

    fn plugin_marks(&self) -> Vec<PluginMark> {
        self.plugin_marks()
    }

    fn kinds(&self) -> Vec<(String, String)> {
        self.modules().into_iter().map(|module| (module.name, module.kind)).collect()
    }

    fn inboxes(&self) -> Vec<String> {
        self.links().into_iter().filter(|link| link.sends).map(|link| inbox(link.to)).collect()
    }

    fn links(&self) -> Vec<(String, String)> {
        let request = |link: crate::LinkStatus| match link.sends {
            true => (link.from.trim_start_matches('/').to_owned(), inbox(link.to)),
            false => (link.to, link.from),
        };
        self.links().into_iter().filter(|link| !link.external).map(request).collect()
    }

    fn order(&self) -> Vec<(String, Vec<String>)> {
        self.order()
    }

    fn configuration_text(&self) -> String {
        self.configuration_text()
    }
}

/// Returns the path of an inbox in a recording; a URL for another agent's inbox.
fn inbox(path: String) -> String {
    if path.contains("://") { path } else { format!("/{path}") }
}
