//! What the agent is made of: modules, plugins, links.

use std::sync::Arc;

use hyper::StatusCode;
use serde::Deserialize;
use serde_json::{Map, Value as Json, json};
use slate_module::Parameter;
use slate_runtime::remote::Call;

use crate::answer::Answer;
use crate::context::Context;
use crate::problem::Problem;
use crate::route::Ask;
use crate::text::toml;

/// What is made of it can't be changed so now.
fn conflict(context: &Context, call: Call) -> Result<Answer, Problem> {
    let made = context.desk.make(call);
    made.map(Answer::json).map_err(|refusal| Problem::refused(StatusCode::CONFLICT, refusal))
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Switch {
    enabled: bool,
}

pub(super) fn switch(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    let name = ask.part("module").to_owned();
    let switch: Switch = ask.body()?;
    if context.desk.composer().modules().iter().all(|module| module.name != name) {
        let help = "GET /api/v1/modules lists them";
        return Err(Problem::not_found(format!("no module is called `{name}`"), help));
    }
    conflict(context, if switch.enabled { Call::ModuleEnable { name } } else { Call::ModuleDisable { name } })
}

pub(super) fn parameters(context: &Arc<Context>, _: &Ask) -> Result<Answer, Problem> {
    let composer = context.desk.composer();
    let of_module = |name: String| {
        let parameters = composer.parameters(&name).into_iter();
        parameters.map(move |Parameter { name: parameter, default, range }| {
            // An endless range is none.
            let range = range.filter(|(least, most)| least.is_finite() && most.is_finite());
            json!({ "module": name, "name": parameter, "default": default, "range": range })
        })
    };
    let all = composer.modules().into_iter().flat_map(|module| of_module(module.name));
    Ok(Answer::json(all.collect()))
}

/// The plugin that is named, or list of plugins; a library can't be, as whoever may load any file may do anything.
fn plugin(context: &Context, ask: &Ask) -> Result<String, Problem> {
    let name = ask.part("plugin").to_owned();
    let composer = context.desk.composer();
    let mut known: Vec<_> = composer.plugins().into_iter().map(|plugin| plugin.name).collect();
    let current = context.desk.settings().map(|settings| settings.current());
    let entries = current.iter().flat_map(|configuration| configuration.plugins());
    known.extend(entries.map(|entry| entry.name.value.clone()));
    if known.contains(&name) {
        return Ok(name);
    }
    Err(Problem::not_found(format!("no plugin is called `{name}`"), "GET /api/v1/plugins lists them"))
}

pub(super) fn load(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    conflict(context, Call::PluginLoad { name: Some(plugin(context, ask)?), file: None })
}

pub(super) fn unload(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    conflict(context, Call::PluginUnload { name: plugin(context, ask)? })
}

pub(super) fn reload(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    conflict(context, Call::PluginReload { name: plugin(context, ask)?, file: None })
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Link {
    from: String,
    #[serde(default)]
    options: Map<String, Json>,
}

pub(super) fn link(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    let link: Link = ask.body()?;
    let options = link.options.iter().map(|(name, value)| Ok((name.clone(), toml(value)?)));
    let call = Call::Link {
        to: ask.part("input").into(),
        from: link.from,
        options: options.collect::<Result<_, Problem>>()?,
        dry_run: ask.is_dry()?,
    };
    conflict(context, call)
}

pub(super) fn unlink(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    conflict(context, Call::Unlink { to: ask.part("input").into(), dry_run: ask.is_dry()? })
}
