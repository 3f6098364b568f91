//! The modules, and their parameters.

use std::sync::Arc;

use serde::Deserialize;
use serde_json::{Value as Json, json};
use slate_module::Parameter;
use slate_runtime::remote::Call;

use super::{TOKEN, ask, conflict, shape};
use crate::Role;
use crate::answer::Answer;
use crate::context::Context;
use crate::problem::Problem;
use crate::route::{Ask, Operation};

pub(super) const LIST: Operation = Operation {
    method: "GET",
    path: "/modules",
    name: "modules",
    summary: "The modules, and how they are",
    role: Role::Viewer,
    parameters: &[TOKEN],
    body: None,
    answer: || shape::list(shape::module()),
    kinds: &[],
    handler: |context, _| ask(context, Call::ModuleList {}),
};

pub(super) const SWITCH: Operation = Operation {
    method: "PUT",
    path: "/modules/{module}",
    name: "switch",
    summary: "Switches a module on or off",
    role: Role::Developer,
    parameters: &[],
    body: Some(|| shape::object(&[("enabled", shape::flag())])),
    answer: || shape::object(&[("changed", shape::flag()), ("needs_reload", shape::optional(shape::text()))]),
    kinds: &[],
    handler: switch,
};

pub(super) const PARAMETERS: Operation = Operation {
    method: "GET",
    path: "/parameters",
    name: "parameters",
    summary: "The parameters of all modules, with their defaults and ranges, and whether an operator may set them",
    role: Role::Viewer,
    parameters: &[TOKEN],
    body: None,
    answer: || shape::list(shape::parameter()),
    kinds: &[],
    handler: parameters,
};

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
            let operable = context.is_operable(&format!("{name}/params/{parameter}"), &Json::Null);
            json!({ "module": name, "name": parameter, "default": default, "range": range, "operable": operable })
        })
    };
    let all = composer.modules().into_iter().flat_map(|module| of_module(module.name));
    Ok(Answer::json(all.collect()))
}
