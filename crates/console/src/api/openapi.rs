//! What the API is, for programs.

use serde_json::{Map, Value as Json, json};

use super::shape;
use crate::route::{BASE, Operation};

/// The paths, each with what can be done there.
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

/// The document, of OpenAPI 3.1.
pub(super) fn document(operations: &[Operation]) -> Json {
    let mut paths = Map::new();
    for operation in operations {
        let path = paths.entry(format!("{BASE}{}", operation.path)).or_insert_with(|| json!({}));
        path[operation.method.to_ascii_lowercase()] = of(operation);
    }
    json!({
        "openapi": "3.1.0",
        "info": {
            "title": "Slate",
            "version": env!("CARGO_PKG_VERSION"),
            "description": "An agent over HTTP. Times are nanoseconds of the agent's time, numbers in SI units; what is not \
                            finite is null. A slash in a part of a path may be written as %2F.",
        },
        "paths": paths,
        "components": {
            "securitySchemes": { "token": { "type": "http", "scheme": "bearer" } },
            "schemas": { "Problem": shape::problem() },
        },
        "security": [{ "token": [] }],
    })
}

fn of(operation: &Operation) -> Json {
    let in_path = operation.path.split('/').filter_map(|part| part.strip_prefix('{')?.strip_suffix('}'));
    let in_path = in_path.map(|name| {
        json!({ "name": name, "in": "path", "required": true, "schema": { "type": "string", "minLength": 1 } })
    });
    // The token is said once, as the scheme of all.
    let in_query =
        operation.parameters.iter().filter(|parameter| parameter.name != "token").map(|parameter| {
            let schema = (parameter.schema)();
            json!({ "name": parameter.name, "in": "query", "description": parameter.doc, "schema": schema })
        });
    let mut parameters: Vec<_> = in_path.chain(in_query).collect();
    if matches!(operation.name, "write" | "patch") {
        let doc = "The ETag of the value that is to be changed; another one is refused with 412.";
        parameters.push(
            json!({ "name": "If-Match", "in": "header", "description": doc, "schema": { "type": "string" } }),
        );
    }
    let mut content = Map::new();
    if operation.kinds != ["text/plain"] {
        content.insert("application/json".into(), json!({ "schema": (operation.answer)() }));
    }
    for kind in operation.kinds {
        content.insert((*kind).into(), json!({}));
    }
    let mut document = json!({
        "operationId": operation.name,
        "summary": operation.summary,
        "description": format!("For a {} and whoever may more.", operation.role),
        "parameters": parameters,
        "responses": {
            "200": { "description": "It is done.", "content": content },
            "default": {
                "description": "It is not done, and why.",
                "content": {
                    "application/problem+json": { "schema": { "$ref": "#/components/schemas/Problem" } },
                },
            },
        },
    });
    if let Some(body) = operation.body {
        let needed = !matches!(operation.name, super::STOP | "arm" | "save");
        document["requestBody"] =
            json!({ "required": needed, "content": { "application/json": { "schema": body() } } });
    }
    document
}
