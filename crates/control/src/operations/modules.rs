//! The modules, and their parameters.

use std::sync::Arc;

use serde::Deserialize;
use serde_json::{Value as Json, json};
use slate_module::Parameter;

use super::{TOKEN, named, shape, told};
use crate::Role;
use crate::answer::Answer;
use crate::context::Context;
use crate::operation::{Ask, Operation, Pace};
use crate::problem::Problem;

pub(super) const LIST: Operation = Operation {
    method: "GET",
    path: "/modules",
    name: "modules",
    summary: "The modules, and how they are",
    role: Role::Viewer,
    pace: Pace::Prompt,
    parameters: &[TOKEN],
    body: None,
    answer: || shape::list(shape::module()),
    kinds: &[],
    handler: |context, _| told(context.agent.modules()),
};

pub(super) const SWITCH: Operation = Operation {
    method: "PUT",
    path: "/modules/{module}",
    name: "switch",
    summary: "Switches a module on or off",
    role: Role::Developer,
    pace: Pace::Change,
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
    pace: Pace::Slow,
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
    let switch: Switch = ask.body()?;
    named(context.agent.enable(ask.part("module"), switch.enabled))
}

pub(super) fn parameters(context: &Arc<Context>, _: &Ask) -> Result<Answer, Problem> {
    let composer = context.agent.composer();
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
