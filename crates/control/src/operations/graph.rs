//! Graph of modules and links, with the positions of a drawing.

use std::sync::Arc;

use serde_json::{Value as Json, json};
use slate_sorted::SortedMap;

use super::shape;
use crate::Role;
use crate::agent::AgentControl;
use crate::answer::OperationAnswer;
use crate::graph::{DrawnGraph, GraphLink, ModuleGraph};
use crate::operation::{Operation, OperationRequest, Parameter};
use crate::problem::Problem;
use crate::surface::ControlSurface;

/// Maximum size of a drawing, pixels.
const MAX_PIXELS: f64 = 20_000.0;

pub(super) const READ: Operation = Operation::get(
    "/graph",
    "graph",
    Role::Viewer,
    "Modules, gates and links, with the positions of a drawing",
)
.parameters(&[
    Parameter {
        name: "hide",
        doc: "Words; a module is left out if its name contains one of them.",
        schema: shape::text,
    },
    Parameter { name: "width", doc: "Available width, pixels.", schema: length },
    Parameter { name: "height", doc: "Available height, pixels.", schema: length },
])
.answers(drawing, read);

fn length() -> Json {
    json!({ "type": "number", "minimum": 0, "maximum": MAX_PIXELS })
}

fn drawing() -> Json {
    let number = || json!({ "type": "number" });
    let point = || json!({ "type": "array", "items": number(), "minItems": 2, "maxItems": 2 });
    let node = shape::object(&[
        ("name", shape::text()),
        ("kind", json!({ "enum": ["module", "gate", "outside"] })),
        ("note", shape::text()),
        ("group", json!({ "type": "string", "description": "The robot; empty without one." })),
        ("x", number()),
        ("y", number()),
    ]);
    let link = shape::object(&[
        ("output", shape::text()),
        ("input", shape::text()),
        ("flow", json!({ "enum": ["values", "messages", "previous"] })),
        ("inferred", shape::flag()),
    ]);
    let edge = shape::object(&[
        ("from", shape::text()),
        ("to", shape::text()),
        ("back", json!({ "type": "boolean", "description": "True if it closes a loop." })),
        ("path", json!({ "type": "string", "description": "The line, as the attribute `d` of SVG." })),
        ("start", point()),
        ("end", point()),
        ("links", shape::list(link)),
    ]);
    let group = shape::object(&[
        ("name", shape::text()),
        ("x", number()),
        ("y", number()),
        ("width", number()),
        ("height", number()),
    ]);
    shape::object(&[
        ("title", shape::text()),
        ("width", number()),
        ("height", number()),
        ("node_width", number()),
        ("node_height", number()),
        ("nodes", shape::list(node)),
        ("edges", shape::list(edge)),
        ("groups", shape::list(group)),
    ])
}

fn read(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let length = |name| request.query.number(name, 0.0, MAX_PIXELS).map(Option::unwrap_or_default);
    let available = (length("width")?, length("height")?);
    let mut graph = graph(&surface.agent);
    let hidden = request.query.get("hide").unwrap_or_default();
    graph.hide(|name| hidden.split_whitespace().any(|word| name.contains(word)));
    Ok(OperationAnswer::json(json!(DrawnGraph::new(&graph, available))))
}

fn graph(agent: &AgentControl) -> ModuleGraph {
    let composer = agent.composer();
    let modules = composer.modules().into_iter();
    let links = composer.links().into_iter();
    let configuration = agent.settings.database.as_ref().map(|database| database.current());
    let configured = configuration.iter().flat_map(|configuration| configuration.actuators());
    let mut commands: SortedMap<&str, Vec<String>> = configured
        .map(|actuator| {
            let commands = actuator.commands.iter().map(|command| command.value.to_string());
            (actuator.name.value.as_str(), commands.collect())
        })
        .collect();
    let actuators = composer.actuators().into_iter().map(|(name, _)| {
        let commands = commands.remove(name.as_str()).unwrap_or_default();
        (name, commands)
    });
    ModuleGraph::new(
        composer.board().agent().into(),
        modules.map(|module| (module.name, module.condition.to_lowercase())).collect(),
        links
            .map(|link| GraphLink::new(link.to, link.from, &link.options, link.sends, link.inferred))
            .collect(),
        actuators.collect(),
    )
}
