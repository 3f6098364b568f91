//! What an agent does for those that know nothing of it but a narrow trait: its modules, what shares and what records.

use std::sync::Arc;

use slate_blackboard::Board;
use slate_module::Level;
use slate_module::aspect::Plugins;

use super::{Composer, WeakComposer};
use crate::aspects::{PluginChanges, SettingsChanges};
use crate::recording::RecordedAgent;
use crate::sharing::{RemotePath, SharingAgent, Standing};
use crate::snapshot::PluginMark;

/// What a module gets that asks while the agent ends.
const ENDS: &str = "the agent ends";

impl PluginChanges for WeakComposer {
    fn change_plugins(&self, module: &str, what: u32, plugin: &str) -> Result<String, String> {
        let composer = self.upgrade().ok_or(ENDS)?;
        composer.make_for_module(module, "a change of plugins that a module asked for", || {
            carry_out(&composer, module, what, plugin)
        })
    }
}

fn carry_out(composer: &Composer, module: &str, what: u32, plugin: &str) -> Result<String, String> {
    let done = match what {
        Plugins::LOAD => {
            composer.load(plugin).map(|loaded| format!("modules: {}", loaded.modules.join(", ")))
        }
        Plugins::UNLOAD if composer.runs(module, plugin) => {
            return Err(format!("`{plugin}` has the code of `{module}`, which asks for it to be unloaded"));
        }
        Plugins::UNLOAD => composer.unload(plugin).map(|libraries| {
            let became = |(name, state): &(String, &str)| format!("the library of {name} is {state}");
            libraries.iter().map(became).collect::<Vec<_>>().join(", ")
        }),
        Plugins::RELOAD => composer.reload(plugin, None).map(|reload| {
            let became = |(module, state): &(String, Result<(), String>)| match state {
                Ok(()) => format!("{module} goes on with its state"),
                Err(reason) => format!("{module} begins afresh: {reason}"),
            };
            reload.modules.iter().map(became).collect::<Vec<_>>().join(", ")
        }),
        other => return Err(format!("there is no request {other}")),
    };
    done.map_err(|error| error.to_string())
}

impl SettingsChanges for WeakComposer {
    fn change_settings(&self, module: &str, lines: &str) -> Result<String, String> {
        let composer = self.upgrade().ok_or(ENDS)?;
        let answer = composer
            .recorded_answer(module, lines)
            .unwrap_or_else(|| composer.change_for(module, lines).map_err(|report| report.to_string()));
        composer.tell_asked(module, lines, &answer);
        answer
    }
}

impl SharingAgent for WeakComposer {
    fn remote_stands(&self, path: &RemotePath, standing: Standing) {
        if let Some(composer) = self.upgrade() {
            composer.remote_stands(path, standing);
        }
    }

    fn log(&self, level: Level, text: &str) {
        if let Some(composer) = self.upgrade() {
            composer.log(level, text);
        }
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

    fn links(&self) -> Vec<(String, String)> {
        let inbox = |path: String| if path.contains("://") { path } else { format!("/{path}") };
        let told = |link: crate::LinkStatus| match link.sends {
            true => (link.from.trim_start_matches('/').to_owned(), inbox(link.to)),
            false => (link.to, link.from),
        };
        self.links().into_iter().map(told).collect()
    }

    fn order(&self) -> Vec<(String, Vec<String>)> {
        self.order()
    }

    fn configuration_text(&self) -> String {
        self.configuration_text()
    }
}
