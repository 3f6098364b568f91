//! Output of commands that change an agent.

use slate::control::{EnableResult, SettingChange};

use crate::output;

/// Prints changed settings.
pub fn show_changes(changed: &[SettingChange]) {
    if changed.is_empty() {
        output::line("no change");
    }
    for SettingChange { path, before, after, default, needs_reload, .. } in changed {
        let text = |value: &Option<String>| {
            let default = default.as_ref().map(|default| format!("{default} (default)"));
            value.clone().or(default).unwrap_or_else(|| "none".into())
        };
        output::line(format_args!("{path}: {} -> {}", text(before), text(after)));
        if let Some(plugin) = needs_reload {
            show_reload(plugin);
        }
    }
}

/// Prints how a module was enabled or disabled.
pub fn show_enable_result(name: &str, on: bool, switched: EnableResult) {
    let (state, already) = (if on { "on" } else { "off" }, if switched.changed { "" } else { " already" });
    output::line(format_args!("{name} is {state}{already}"));
    if let Some(plugin) = switched.needs_reload {
        show_reload(&plugin);
    }
}

/// Prints how a module that has failed for good is restarted.
fn show_reload(plugin: &str) {
    output::line(format_args!("it has failed for good: `slate plugin reload {plugin}` restarts it"));
}
