//! Modules, and their parameters.

use std::sync::Arc;

use serde::Deserialize;
use serde_json::{Value as Json, json};
use slate_module::Parameter;

use super::{named, reply, shape};
use crate::Role;
use crate::answer::OperationAnswer;
use crate::operation::{Operation, OperationRequest, Pace};
use crate::problem::Problem;
use crate::surface::ControlSurface;

pub(super) const LIST: Operation =
    Operation::get("/modules", "modules", Role::Viewer, "Modules and their states")
        .pace(Pace::Prompt)
        .answers(|| shape::list(shape::module()), |surface, _| reply(surface.agent.modules()));

pub(super) const DESCRIBE: Operation = Operation::get(
    "/modules/{module}",
    "describe",
    Role::Viewer,
    "Documentation of a module, its ports and its parameters",
)
.pace(Pace::Prompt)
.answers(documentation, |surface, request| named(surface.agent.describe(request.board_path("module")?)));

pub(super) const SWITCH: Operation = Operation::put(
    "/modules/{module}",
    "switch",
    Role::Developer,
    "Enables or disables a module",
    Pace::Change,
)
.body(|| shape::object(&[("enabled", shape::flag())]))
.answers(
    || shape::object(&[("changed", shape::flag()), ("needs_reload", shape::optional(shape::text()))]),
    switch,
);

pub(super) const PARAMETERS: Operation = Operation::get(
    "/parameters",
    "parameters",
    Role::Viewer,
    "Parameters of all modules, with defaults, ranges, and whether an operator may set them",
)
.answers(|| shape::list(shape::parameter()), parameters);

fn documentation() -> Json {
    let port = shape::object(&[
        ("name", shape::text()),
        ("direction", shape::text()),
        ("interface", shape::text()),
        ("role", shape::text()),
        ("doc", shape::text()),
    ]);
    let parameter =
        shape::object(&[("name", shape::text()), ("unit", shape::text()), ("doc", shape::text())]);
    shape::object(&[
        ("name", shape::text()),
        ("doc", shape::text()),
        ("ports", shape::list(port)),
        ("parameters", shape::list(parameter)),
    ])
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SwitchRequest {
    enabled: bool,
}

pub(super) fn switch(
    surface: &Arc<ControlSurface>,
    request: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let switch: SwitchRequest = request.body()?;
    named(surface.agent.enable(request.board_path("module")?, switch.enabled).map(|switched| json!(switched)))
}

pub(super) fn parameters(
    surface: &Arc<ControlSurface>,
    _: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let composer = surface.agent.composer();
    let of_module = |name: String| {
        let parameters = composer.parameters(&name).into_iter();
        parameters.map(move |Parameter { name: parameter, default, range, .. }| {
            // An infinite range is not a range.
            let range = range.filter(|(least, most)| least.is_finite() && most.is_finite());
            let operable = surface.is_operable(&format!("{name}/params/{parameter}"), &Json::Null);
            json!({ "module": name, "name": parameter, "default": default, "range": range, "operable": operable })
        })
    };
    let all = composer.modules().into_iter().flat_map(|module| of_module(module.name));
    Ok(OperationAnswer::json(all.collect()))
}
