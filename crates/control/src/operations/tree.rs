//! Listings: the agent, its properties, interfaces and documents.

use std::sync::Arc;

use hyper::StatusCode;
use serde_json::{Value as Json, json};
use slate_blackboard::Property;
use slate_blackboard::interface::Descriptor;
use slate_runtime::ErrorCode;
use slate_sorted::SortedMap;

use super::{API_VERSION, shape};
use crate::Role;
use crate::answer::OperationAnswer;
use crate::operation::{Operation, OperationRequest, Pace, Parameter};
use crate::problem::Problem;
use crate::schema;
use crate::surface::ControlSurface;

const PATTERN: Parameter = Parameter {
    name: "pattern",
    doc: "Pattern of paths, such as /r2/planner/* or /**/timing; all unless given.",
    schema: shape::text,
};

pub(super) const AGENT: Operation =
    Operation::get("/agent", "agent", Role::Viewer, "The agent, and the caller's role")
        .pace(Pace::Prompt)
        .answers(shape::agent, agent);

pub(super) const PROPERTIES: Operation =
    Operation::get("/properties", "properties", Role::Viewer, "Properties, sorted by path")
        .parameters(&[
            PATTERN,
            Parameter { name: "values", doc: "Includes values up to 4 KiB.", schema: shape::flag },
        ])
        .answers(|| shape::list(shape::property()), properties);

pub(super) const INTERFACES: Operation =
    Operation::get("/interfaces", "interfaces", Role::Viewer, "Interfaces, by name")
        .answers(|| json!({ "type": "object", "additionalProperties": { "type": "object" } }), interfaces);

pub(super) const INTERFACE: Operation =
    Operation::get("/interfaces/{interface}", "interface", Role::Viewer, "JSON Schema of an interface")
        .answers(|| json!({ "type": "object" }), interface);

pub(super) const DOCUMENTS: Operation = Operation::get(
    "/documents",
    "documents",
    Role::Viewer,
    "Documents of the program beside the blackboard, such as the world of a simulator: names",
)
.answers(|| shape::list(shape::text()), documents);

pub(super) const DOCUMENT: Operation =
    Operation::get("/documents/{document}", "document", Role::Viewer, "One of these")
        .answers(shape::anything, document);

/// Maximum size of a value in a list, bytes.
const MAX_INLINE_SIZE: usize = 4096;

pub(super) fn agent(
    surface: &Arc<ControlSurface>,
    request: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let stopped = surface.agent.composer().actuators().into_iter().find_map(|(_, reason)| reason);
    Ok(OperationAnswer::json(json!({
        "api": API_VERSION,
        "name": surface.name(),
        "version": env!("CARGO_PKG_VERSION"),
        "run": surface.session,
        "role": request.caller.role.name(),
        "time": surface.now(),
        "lockstep": surface.is_lockstep,
        "stopped": stopped,
        "over": surface.run_end(),
    })))
}

pub(super) fn properties(
    surface: &Arc<ControlSurface>,
    request: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let pattern = request.query.get("pattern").map(|pattern| request.own_url(pattern));
    let values = request.query.flag("values")?;
    let found = surface.agent.properties.list(pattern.as_deref()).map_err(|refusal| {
        let is_unknown = refusal.code.as_deref() == Some(ErrorCode::Name.code());
        Problem::refused(if is_unknown { StatusCode::NOT_FOUND } else { StatusCode::BAD_REQUEST }, refusal)
    })?;
    let is_elsewhere = pattern.is_some_and(|pattern| surface.agent.properties.remote.of(&pattern).is_some());
    if is_elsewhere {
        return Ok(OperationAnswer::json(json!(found)));
    }
    let found = found.iter().filter_map(|found| surface.board().get(&found.path));
    Ok(OperationAnswer::json(found.map(|(property, _)| entry(surface, &property, values)).collect()))
}

fn entry(surface: &ControlSurface, property: &Property, values: bool) -> Json {
    let channel = property.channel();
    let mut entry = json!({
        "path": property.path(),
        "url": format!("slate://{}/{}", surface.name(), property.path()),
        "interface": property.descriptor().name,
        "doc": property.doc(),
        "access": surface.agent.properties.access(property),
        "sequence": channel.map_or(0, |channel| channel.published()),
        "readers": property.readers(),
    });
    let is_small =
        channel.is_some_and(|channel| channel.shape().bytes(channel.shape().capacity) <= MAX_INLINE_SIZE);
    if values
        && is_small
        && let Ok(Some((value, stamp))) = surface.board().read(property.path())
    {
        entry["value"] = serde_json::to_value(value).unwrap_or_default();
        entry["time"] = json!(stamp.time);
    }
    entry
}

/// Returns the interfaces of all properties, by name.
/// Of two with one name, that of the first property.
fn known(surface: &ControlSurface) -> SortedMap<&'static str, &'static Descriptor> {
    let mut known = SortedMap::new();
    for property in surface.board().properties() {
        known.entry(property.descriptor().name).or_insert(property.descriptor());
    }
    known
}

pub(super) fn interfaces(
    surface: &Arc<ControlSurface>,
    _: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let schemas = known(surface).into_iter().map(|(name, of)| (name.to_owned(), schema::of_interface(of)));
    Ok(OperationAnswer::json(Json::Object(schemas.collect())))
}

pub(super) fn interface(
    surface: &Arc<ControlSurface>,
    request: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let name = request.part("interface")?;
    let known = known(surface);
    let descriptor = known.get(name).ok_or_else(|| {
        let near = slate_blackboard::nearest_names(name, known.keys().copied());
        let help = match near.is_empty() {
            true => "GET /api/v1/interfaces lists them".into(),
            false => format!("did you mean {}?", near.join(" or ")),
        };
        Problem::not_found(format!("no property has the interface `{name}`"), help)
    })?;
    Ok(OperationAnswer::json(schema::of_interface(descriptor)))
}

pub(super) fn documents(
    surface: &Arc<ControlSurface>,
    _: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    Ok(OperationAnswer::json(surface.documents().into_iter().map(|document| json!(document.name)).collect()))
}

pub(super) fn document(
    surface: &Arc<ControlSurface>,
    request: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let name = request.part("document")?;
    let found = surface.documents().into_iter().find(|document| document.name == name);
    let unknown =
        || Problem::not_found(format!("no document is called `{name}`"), "GET /api/v1/documents lists them");
    Ok(OperationAnswer::json((found.ok_or_else(unknown)?.read)()))
}
