//! The routes of the table of operations: their variable parts, which each handler names.

use slate_control::operations::{OPERATIONS, of_request};
use slate_control::{BASE, Operation};

use super::*;

/// Value of a part, which names nothing that an agent has.
const NOTHING: &str = "@nothing";

/// A developer in another program, who may name no file.
fn developer() -> Caller {
    let connection = Arc::new(Arc::new(Connections::default()).admit());
    Caller { role: Role::Developer, who: "a test".into(), local: None, is_told: false, connection }
}

/// The smallest value that fits a schema of a body.
fn smallest(schema: &Value) -> Value {
    let required = schema["required"].as_array().cloned().unwrap_or_default();
    let field = |name: &Value| {
        let name = name.as_str().unwrap();
        (name.to_owned(), smallest(&schema["properties"][name]))
    };
    match schema["type"].as_str() {
        Some("string") => json!(NOTHING),
        Some("number" | "integer") => schema.get("minimum").cloned().unwrap_or(json!(0)),
        Some("boolean") => json!(false),
        Some("array") => json!([smallest(&schema["items"])]),
        Some("object") if required.is_empty() && schema["minProperties"] == 1 => json!({ NOTHING: null }),
        Some("object") => Value::Object(required.iter().map(field).collect()),
        _ => Value::Null,
    }
}

#[test]
fn variable_parts_of_a_route_have_names_of_their_own() {
    for operation in OPERATIONS {
        let (path, names) = (operation.path, operation.part_names());
        let mut names: Vec<_> = names.collect();
        assert_eq!(path.matches(['{', '}']).count(), 2 * names.len(), "{path}: a part is wholly in braces");
        assert!(names.iter().all(|name| !name.is_empty() && !name.contains(['{', '}'])), "{path}");
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "{path}: a name is there twice");
    }
}

#[test]
fn handlers_take_only_parts_of_their_route() {
    let (agent, _server, _client) = open("parts");
    let surface = Arc::new(ControlSurface::new(&agent).unwrap());
    for operation in OPERATIONS.iter().filter(|operation| operation.part_names().next().is_some()) {
        let parts: Vec<_> = operation.part_names().map(|name| (name, NOTHING)).collect();
        let body = operation.body.map_or(Value::Null, |schema| smallest(&schema()));
        let Err(refusal) = carry_out(&surface, &developer(), operation.name, &parts, body) else {
            panic!("{} is done to nothing", operation.name);
        };
        assert!(!refusal.status.is_server_error(), "{}: {refusal}", operation.name);
    }
}

#[test]
fn missing_or_unknown_part_is_refused_by_its_name() {
    let (agent, _server, _client) = open("missing");
    let surface = Arc::new(ControlSurface::new(&agent).unwrap());
    let refusal = |name: &str, parts: &[(&str, &str)]| {
        let Err(refusal) = carry_out(&surface, &developer(), name, parts, json!(1.0)) else {
            panic!("{name} is done with {parts:?}");
        };
        refusal.to_string()
    };
    for parts in [&[][..], &[("path", "")]] {
        let refusal = refusal("write", parts);
        assert!(refusal.contains("the part `path` of /slate/{agent}/{path} is missing"), "{refusal}");
    }
    let parts = [("path", "teller/params/first"), ("plugin", "teller")];
    let unknown = refusal("write", &parts);
    assert!(unknown.contains("/slate/{agent}/{path} has no part `plugin`"), "{unknown}");
    assert!(unknown.contains("agent, path"), "{unknown}");
    let unneeded = refusal("stop", &[("path", "teller")]);
    assert!(unneeded.contains("/stop has no part `path`"), "{unneeded}");
    // The agent is this one unless named.
    assert!(carry_out(&surface, &developer(), "write", &parts[..1], json!(1.0)).is_ok());
}

#[test]
fn route_may_have_any_number_of_parts() {
    let known = slate_control::operations::by_name("agent").unwrap().clone();
    let operation = Operation { path: "/a/{one}/b/{two}/{three}", ..known };
    let parts = [("two", "2"), ("three", "3/4"), ("one", "1")];
    let captured = operation.capture("own", &parts).unwrap();
    let captured: Vec<_> = captured.iter().map(|(name, value)| (*name, value.as_str())).collect();
    assert_eq!(captured, [("one", "1"), ("two", "2"), ("three", "3/4")]);
    assert!(operation.capture("own", &parts[..2]).unwrap_err().to_string().contains("the part `one`"));
}

#[test]
fn no_route_is_shadowed_by_an_earlier_one() {
    let mut seen = Vec::new();
    for operation in OPERATIONS {
        assert!(!seen.contains(&(operation.method, operation.path)), "{} is there twice", operation.name);
        seen.push((operation.method, operation.path));
        // No fixed part of a route is spelt like this one.
        let part = |part: &'static str| if part.starts_with('{') { NOTHING } else { part };
        let path = operation.path.split('/').map(part).collect::<Vec<_>>().join("/");
        let found = of_request(operation.method, &format!("{BASE}{path}"));
        let found = found.map_or_else(|problem| problem.to_string(), |found| found.operation.name.to_owned());
        assert_eq!(
            found, operation.name,
            "{} {} has the route of an earlier operation: put it in front of that one",
            operation.method, operation.path
        );
    }
    let names: slate_sorted::SortedSet<_> = OPERATIONS.iter().map(|operation| operation.name).collect();
    assert_eq!(names.len(), OPERATIONS.len(), "two operations have one name");
}
