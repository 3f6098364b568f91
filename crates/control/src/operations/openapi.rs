//! OpenAPI document of the operations.

use std::sync::Arc;

use serde_json::{Map, Value as Json, json};
use slate_blackboard::{Access, Property};

use super::{OPERATIONS, shape, sockets};
use crate::Role;
use crate::answer::{OCTET_STREAM, OperationAnswer};
use crate::operation::{BASE, Operation, TOKEN};
use crate::surface::ControlSurface;

pub(super) const INDEX: Operation =
    Operation::get("", "index", Role::Viewer, "Links to the operations of the agent")
        .answers(shape::anything, |_, _| Ok(OperationAnswer::json(index(OPERATIONS))));

pub(super) const DOCUMENT: Operation =
    Operation::get("/openapi.json", "openapi", Role::Viewer, "This document")
        .answers(shape::anything, |surface, _| Ok(OperationAnswer::json(document(OPERATIONS, surface))));

/// Returns the paths, each with its operations.
pub(super) fn index(operations: &[Operation]) -> Json {
    let entry = |operation: &Operation| {
        json!({
            "method": operation.method,
            "path": format!("{BASE}{}", operation.path),
            "role": operation.role.name(),
            "summary": operation.summary,
        })
    };
    json!({ "openapi": format!("{BASE}/openapi.json"), "operations": operations.iter().map(entry).collect::<Vec<_>>() })
}

/// Scheme of the token in the query, for the operations that accept it there.
const QUERY_TOKEN: &str = "query_token";

/// Returns the OpenAPI 3.1 document.
pub(super) fn document(operations: &[Operation], surface: &ControlSurface) -> Json {
    let mut paths = Map::new();
    for operation in operations {
        let path = paths.entry(format!("{BASE}{}", operation.path)).or_insert_with(|| json!({}));
        path[operation.method.to_ascii_lowercase()] = of(operation, surface);
    }
    json!({
        "openapi": "3.1.0",
        "info": {
            "title": "Slate",
            "version": env!("CARGO_PKG_VERSION"),
            "description": "An agent over HTTP. Times are nanoseconds of the agent's time, numbers in SI units; non-finite \
                            numbers are null. A slash in a part of a path may be written as %2F.",
        },
        "paths": paths,
        "components": {
            "securitySchemes": {
                "token": { "type": "http", "scheme": "bearer" },
                QUERY_TOKEN: { "type": "apiKey", "in": "query", "name": TOKEN.name, "description": TOKEN.doc },
            },
            "schemas": { "Problem": shape::problem() },
        },
        "security": [{ "token": [] }],
    })
}

/// Returns an existing value as an example of a part of a path.
/// A stream has no end, so an operation that may be one has no example.
fn example(operation: &Operation, part: &str, surface: &ControlSurface) -> Option<String> {
    let properties = surface.board().properties();
    let is_settable = |property: &&Arc<Property>| {
        property.access() == Access::Setting && property.path().ends_with("/params")
    };
    match part {
        _ if operation.name == "read" => None,
        "agent" => Some(surface.name().to_owned()),
        "path" if operation.method == "GET" => Some("log/tail".into()),
        "path" => properties.iter().find(is_settable).map(|property| property.path().to_owned()),
        "interface" => Some("LogLine".into()),
        "module" => surface.agent.composer().modules().first().map(|module| module.name.clone()),
        "plugin" => surface.agent.composer().plugins().first().map(|plugin| plugin.name.clone()),
        "input" => surface.agent.composer().links().first().map(|link| link.to.clone()),
        "document" => surface.documents().first().map(|document| document.name.clone()),
        _ => None,
    }
}

/// Responses of refused operations, common to all.
const PROBLEMS: &[(&str, &str)] = &[
    ("401", "Missing or unknown token."),
    ("403", "The role is not sufficient, or the request comes from a foreign page."),
    ("429", "Too many requests, or too many wrong tokens."),
    ("503", "Too many requests in progress."),
    ("default", "The request was refused; the body says why."),
];

fn responses(status: &str, done: Json) -> Json {
    let problem =
        json!({ "application/problem+json": { "schema": { "$ref": "#/components/schemas/Problem" } } });
    let mut responses = json!({ status: done });
    for (status, description) in PROBLEMS {
        responses[*status] = json!({ "description": description, "content": problem });
    }
    responses
}

fn of(operation: &Operation, surface: &ControlSurface) -> Json {
    let in_path = operation.part_names().map(|name| {
        let mut part =
            json!({ "name": name, "in": "path", "required": true, "schema": { "type": "string", "minLength": 1 } });
        if let Some(example) = example(operation, name, surface) {
            part["example"] = json!(example);
        }
        part
    });
    // The token is a scheme of security.
    let in_query = operation.own_parameters.iter().map(|parameter| {
        let schema = (parameter.schema)();
        json!({ "name": parameter.name, "in": "query", "description": parameter.doc, "schema": schema })
    });
    let mut parameters: Vec<_> = in_path.chain(in_query).collect();
    if matches!(operation.name, "write" | "patch") {
        let doc = "ETag of the value to change; a different one is refused with 412.";
        parameters.push(
            json!({ "name": "If-Match", "in": "header", "description": doc, "schema": { "type": "string" } }),
        );
    }
    let mut content = Map::new();
    if !matches!(operation.kinds, ["text/plain"] | [OCTET_STREAM]) {
        content.insert("application/json".into(), json!({ "schema": (operation.answer)() }));
    }
    for kind in operation.kinds {
        content.insert((*kind).into(), json!({}));
    }
    let (status, done) = match sockets::is_socket(operation) {
        true => ("101", json!({ "description": "It is open." })),
        false => ("200", json!({ "description": "It is done.", "content": content })),
    };
    let mut document = json!({
        "operationId": operation.name,
        "summary": operation.summary,
        "description": format!("Required role: {} or higher.", operation.role.name()),
        "parameters": parameters,
        "responses": responses(status, done),
    });
    if operation.accepts_token() {
        document["security"] = json!([{ "token": [] }, { QUERY_TOKEN: [] }]);
    }
    if let Some(body) = operation.body {
        let is_optional = matches!(
            operation.name,
            super::STOP | super::DRIVE | "arm" | "save" | "start_recording" | "step_playback" | "reload"
        );
        let needed = !is_optional;
        document["requestBody"] =
            json!({ "required": needed, "content": { "application/json": { "schema": body() } } });
    }
    document
}
