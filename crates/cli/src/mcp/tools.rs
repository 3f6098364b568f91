//! Tools: the operations that answer in JSON and need no own connection.
//! Each such operation of the table is one tool, and two more are composed of several.

use serde_json::{Map, Value, json};
use slate::control::client::percent_encoded;
use slate::control::operations::{DRIVE, OPERATIONS, STOP};
use slate::control::{Operation, Parameter, Role};

/// Tool that explains the codes of errors.
pub const EXPLAIN_TOOL: &str = "explain";

/// Maximum duration of a command, s.
pub const MAX_DRIVE_DURATION: f64 = 10.0;

/// Operations that are no tools.
/// Sockets, files and documents for programs, operations that end with a connection, and leases, which the tool that
/// drives manages.
const EXCLUDED_OPERATIONS: &[&str] = &[
    "index",
    "openapi",
    "live",
    "teleoperation",
    "fetch_recording",
    "metrics",
    "layouts",
    "save_layout",
    "remove_layout",
    "record_trace",
    "trace_progress",
    "end_trace",
    "take",
    "give_back",
];

/// Part of a path that names the agent.
const AGENT_PART: &str = "agent";

/// Argument of a body that is not an object of known fields.
const BODY_ARGUMENT: &str = "body";

/// Parameter that chooses the form of an answer.
const FORMAT_PARAMETER: &str = "format";

/// Tool with its JSON Schema.
pub struct ToolEntry {
    pub name: &'static str,
    pub doc: &'static str,
    pub reads_only: bool,
    pub schema: Map<String, Value>,
}

/// Returns the operation that a tool carries out.
pub fn operation(name: &str) -> Option<&'static Operation> {
    OPERATIONS
        .iter()
        .find(|operation| operation.name == name && !EXCLUDED_OPERATIONS.contains(&name) && name != DRIVE)
}

/// Returns the tools of a role.
pub fn of(role: Role) -> Vec<ToolEntry> {
    let own = OPERATIONS.iter().filter(|operation| operation.role <= role);
    let mut tools: Vec<_> = own.filter_map(|own| operation(own.name)).map(described).collect();
    tools.push(explain());
    if role >= Role::Operator {
        tools.push(drive());
    }
    tools
}

fn described(operation: &Operation) -> ToolEntry {
    let reads_only = operation.method == "GET" || matches!(operation.name, "watch" | "measure");
    ToolEntry { name: operation.name, doc: operation.summary, reads_only, schema: schema(operation) }
}

fn explain() -> ToolEntry {
    let code = json!({ "type": "string", "description": "Such as S006." });
    ToolEntry {
        name: EXPLAIN_TOOL,
        doc: "Meaning of an error's code, and its remedy",
        reads_only: true,
        schema: object([("code".to_owned(), code)].into_iter().collect(), vec!["code".into()]),
    }
}

fn drive() -> ToolEntry {
    let fields = [
        (
            "actuator",
            json!({ "type": "string", "description": "Its name, as the tool `actuators` lists it." }),
        ),
        (
            "command",
            json!({
                "type": "object",
                "description": "All fields of the actuator's interface; the tool `interface` has them.",
            }),
        ),
        (
            "seconds",
            json!({
                "type": "number",
                "exclusiveMinimum": 0,
                "maximum": MAX_DRIVE_DURATION,
                "description": "For how long; 1 unless given. Then the command ends, and the controls are given back.",
            }),
        ),
    ];
    let fields = fields.into_iter().map(|(name, schema)| (name.to_owned(), schema)).collect();
    ToolEntry {
        name: DRIVE,
        doc: "Takes the controls of an actuator, commands it for a while, and gives them back",
        reads_only: false,
        schema: object(fields, vec!["actuator".into(), "command".into()]),
    }
}

fn object(properties: Map<String, Value>, required: Vec<Value>) -> Map<String, Value> {
    let mut schema = Map::new();
    schema.insert("type".into(), json!("object"));
    schema.insert("properties".into(), Value::Object(properties));
    schema.insert("required".into(), Value::Array(required));
    schema.insert("additionalProperties".into(), json!(false));
    schema
}

/// Returns the name of a variable part of a path, which is in braces.
fn name(part: &str) -> Option<&str> {
    part.strip_prefix('{')?.strip_suffix('}')
}

/// Returns the query parameters, without the token of browsers and the format.
/// A tool answers in JSON.
fn query(operation: &Operation) -> impl Iterator<Item = &'static Parameter> {
    operation.own_parameters.iter().filter(|parameter| parameter.name != FORMAT_PARAMETER)
}

fn has_formats(operation: &Operation) -> bool {
    operation.own_parameters.iter().any(|parameter| parameter.name == FORMAT_PARAMETER)
}

/// Refuses any format but JSON, such as a stream, which never ends.
fn check_format(operation: &Operation, arguments: &Map<String, Value>) -> Result<(), String> {
    match arguments.get(FORMAT_PARAMETER).filter(|_| has_formats(operation)) {
        None | Some(Value::Null) => Ok(()),
        Some(Value::String(json)) if json == "json" => Ok(()),
        Some(other) => Err(format!(
            "`{}` answers in JSON only, not as {other}; call it again for newer values",
            operation.name
        )),
    }
}

/// Returns the fields of a body that are arguments by themselves.
fn fields(operation: &Operation) -> Option<(Map<String, Value>, Vec<Value>)> {
    let body = operation.body?();
    let fields = body.get("properties")?.as_object()?.clone();
    let is_taken = |field: &String| {
        operation.part_names().chain(query(operation).map(|own| own.name)).any(|own| own == field)
    };
    if fields.keys().any(is_taken) {
        return None;
    }
    let required = body.get("required").and_then(Value::as_array).cloned();
    Some((fields, required.unwrap_or_default()))
}

/// Returns whether the whole body is one argument.
fn has_body(operation: &Operation) -> bool {
    operation.body.is_some() && fields(operation).is_none() && operation.name != STOP
}

fn schema(operation: &Operation) -> Map<String, Value> {
    let (mut properties, mut required) = fields(operation).unwrap_or_default();
    for part in operation.part_names() {
        if part == AGENT_PART {
            let doc = "Another agent that this one knows; this one unless given.";
            properties.insert(part.into(), json!({ "type": "string", "description": doc }));
            continue;
        }
        properties.insert(part.into(), json!({ "type": "string" }));
        required.push(part.into());
    }
    for parameter in query(operation) {
        let mut schema = (parameter.schema)();
        if let Some(schema) = schema.as_object_mut() {
            schema.insert("description".into(), parameter.doc.into());
        }
        properties.insert(parameter.name.into(), schema);
    }
    if let (true, Some(body)) = (has_body(operation), operation.body) {
        properties.insert(BODY_ARGUMENT.into(), body());
        required.push(BODY_ARGUMENT.into());
    }
    object(properties, required)
}

/// Returns path and body of the request for a tool.
pub fn request(
    operation: &Operation,
    agent: &str,
    arguments: &Map<String, Value>,
) -> Result<(String, Option<Value>), String> {
    check_format(operation, arguments)?;
    let known = schema(operation);
    let known = known.get("properties").and_then(Value::as_object).cloned().unwrap_or_default();
    let is_known =
        |name: &str| known.contains_key(name) || name == FORMAT_PARAMETER && has_formats(operation);
    if let Some(other) = arguments.keys().find(|name| !is_known(name)) {
        let names: Vec<_> = known.keys().map(String::as_str).collect();
        return Err(format!(
            "unknown argument `{other}` of `{}`, which takes {}",
            operation.name,
            names.join(", ")
        ));
    }
    let mut path = String::new();
    for part in operation.path.split('/').skip(1) {
        path.push('/');
        match name(part) {
            None => path.push_str(part),
            Some(name) => {
                let parts: Vec<_> =
                    of_path(name, agent, arguments)?.split('/').map(percent_encoded).collect();
                // Only the path of a property has parts of its own.
                path.push_str(&parts.join(if name == "path" { "/" } else { "%2F" }));
            }
        }
    }
    let mut separator = '?';
    for parameter in query(operation) {
        let Some(value) = arguments.get(parameter.name).filter(|value| !value.is_null()) else { continue };
        let value = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
        path = format!("{path}{separator}{}={}", parameter.name, percent_encoded(&value));
        separator = '&';
    }
    Ok((path, body(operation, arguments)))
}

fn of_path<'a>(name: &str, agent: &'a str, arguments: &'a Map<String, Value>) -> Result<&'a str, String> {
    let given = arguments.get(name).and_then(Value::as_str);
    match given {
        None if name == AGENT_PART => Ok(agent),
        // A slash before the path of a property is how people write it.
        Some(given) if name == "path" => Ok(given.trim_start_matches('/')),
        Some(given) => Ok(given),
        None => Err(format!("`{name}` is missing, a text")),
    }
}

fn body(operation: &Operation, arguments: &Map<String, Value>) -> Option<Value> {
    if has_body(operation) {
        return arguments.get(BODY_ARGUMENT).cloned();
    }
    let (fields, _) = fields(operation)?;
    let given: Map<_, _> =
        fields.keys().filter_map(|field| Some((field.clone(), arguments.get(field)?.clone()))).collect();
    (!given.is_empty()).then_some(Value::Object(given))
}
