//! Setting of properties, and sending of messages.

use std::sync::Arc;

use hyper::StatusCode;
use serde_json::{Value as Json, json};
use slate_blackboard::interface::{Value, edit};
use slate_blackboard::{Access, BoardError, Property, is_within};
use slate_module::role;
use slate_runtime::ErrorCode;

use super::values::{own_path, url, version};
use super::{DRY_RUN, reply, shape};
use crate::Role;
use crate::agent::enabled;
use crate::answer::OperationAnswer;
use crate::entries::SettingChange;
use crate::operation::{Operation, OperationRequest, Pace};
use crate::problem::Problem;
use crate::schema::complete;
use crate::surface::ControlSurface;
use crate::text::{quoted, toml};

pub(super) const PUT: Operation = Operation::put(
    "/slate/{agent}/{path}",
    "write",
    Role::Operator,
    "Sets a parameter, an unlinked input, or `enabled` of a module, or a field of these",
    Pace::Change,
)
.parameters(&[DRY_RUN])
.body(shape::anything)
.answers(|| shape::list(shape::changed()), put);

pub(super) const PATCH: Operation = Operation::patch(
    "/slate/{agent}/{path}",
    "patch",
    Role::Operator,
    "Sets the named fields and keeps the others",
    Pace::Change,
)
.parameters(&[DRY_RUN])
.body(|| json!({ "type": "object", "minProperties": 1 }))
.answers(|| shape::list(shape::changed()), patch);

pub(super) const SEND: Operation = Operation::post(
    "/slate/{agent}/{path}",
    "send",
    Role::Operator,
    "Sends a message to an inbox, and waits up to 1 s for its answer",
    Pace::Slow,
)
.parameters(&[DRY_RUN])
.needs_run()
.body(shape::anything)
.answers(|| shape::object(&[("status", json!({ "enum": ["accepted", "done", "fits"] }))]), send);

/// Role of inboxes whose messages only developers send.
const DEVELOPER_ROLE: &str = "developer";

/// Setting that can be written.
struct WriteTarget {
    property: Arc<Property>,
    module: String,
    kind: WriteKind,
}

enum WriteKind {
    Enabled,
    /// Setting of the whole, and the fields behind it.
    Setting {
        path: String,
        fields: Vec<String>,
        is_parameter: bool,
    },
}

fn put(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let body: Json = request.body()?;
    let target = target(surface, request, &body)?;
    if let WriteKind::Setting { fields, .. } = &target.kind
        && fields.is_empty()
    {
        // PUT replaces the whole value.
        let entries = body.as_object().ok_or_else(|| {
            let message = format!("/{} is an object of fields", target.property.path());
            Problem::unfit(message, "GET /api/v1/interfaces/NAME returns the schema")
        })?;
        let help = "PATCH keeps the fields that are not named";
        complete(target.property.descriptor(), |name| entries.contains_key(name), help)?;
    }
    set(surface, request, &target, &body)
}

pub(super) fn patch(
    surface: &Arc<ControlSurface>,
    request: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let body: Json = request.body()?;
    if body.as_object().is_none_or(serde_json::Map::is_empty) {
        return Err(Problem::unfit("a patch names at least one field", "such as {\"speed\": 0.3}"));
    }
    let target = target(surface, request, &body)?;
    if let (WriteKind::Enabled, Some(value)) = (&target.kind, body.get("value")) {
        return set(surface, request, &target, &value.clone());
    }
    set(surface, request, &target, &body)
}

/// Returns the alternative to setting a linked input.
fn help_of_linked(surface: &ControlSurface, path: &str) -> String {
    let port = surface.agent.composer().port(path);
    // Without the link it may not be set either.
    if port.is_some_and(|port| matches!(port.role.as_str(), role::ACTUATION | role::COMMAND)) {
        return "it moves the robot, and has only what passed the gate; drive it by `slate teleop`, or set its goal: slate goal"
            .into();
    }
    format!("remove the link first: slate unlink {path}, or DELETE /api/v1/links/{path}")
}

/// Resolves a path to a setting that the caller may write.
fn target(surface: &ControlSurface, request: &OperationRequest, body: &Json) -> Result<WriteTarget, Problem> {
    let url = url(request)?;
    let other = || {
        let message = format!("{url} is of another agent, and only that one changes it");
        let help =
            format!("ask that agent itself: slate set {url} --agent {}", url.agent().unwrap_or_default());
        Problem::not_found(message, help).of(ErrorCode::OtherAgent)
    };
    let path = own_path(surface, &url).ok_or_else(other)?;
    let (property, field) = surface.board().find(&path)?;
    let not_allowed = |error_code: ErrorCode, message: String, help: &str, allowed: &str| {
        Err(Problem::new(StatusCode::METHOD_NOT_ALLOWED, message, help).of(error_code).with("allow", allowed))
    };
    let own = property.path().to_owned();
    if !is_within(&path, &own) {
        let message = format!("/{path} is linked, from /{own}");
        return not_allowed(ErrorCode::Linked, message, &help_of_linked(surface, &path), "GET");
    }
    let Some(module) = module_of(surface, &own) else {
        let message = format!("/{own} is the host's own, which writes it");
        let help = "settings of the host are changed by `slate config set` and PATCH /api/v1/settings";
        return not_allowed(ErrorCode::OneWriter, message, help, "GET");
    };
    let external = property.external();
    if !external.is_empty() {
        let message = format!("/{own} has the values of {external}, and a property has one writer");
        return not_allowed(ErrorCode::OneWriter, message, "send the value there", "GET");
    }
    match property.access() {
        Access::Setting if surface.agent.properties.access(&property) == "queue" => {
            let message = format!("/{own} is a queue, which takes the values of its link alone");
            let help = format!("link it: slate link {own} PROPERTY, or PUT /api/v1/links/{own}");
            return not_allowed(ErrorCode::OneWriter, message, &help, "GET");
        }
        Access::Setting => {}
        Access::Output => {
            let message = format!("/{own} is written by module `{module}`, and a property has one writer");
            let help = format!(
                "set what the module works with: `slate list '/{module}/*'` shows its inputs and params; or link its \
                 readers to another property: slate link"
            );
            return not_allowed(ErrorCode::OneWriter, message, &help, "GET");
        }
        Access::Messages => {
            let message = format!("/{own} takes messages of modules that are linked to it");
            let help = "send one: slate send, or POST; or link the output of a module to it: slate link";
            return not_allowed(ErrorCode::Messages, message, help, "POST");
        }
    }
    let port = &own[module.len() + 1..];
    let key = quoted(&module);
    let fields: Vec<_> = field.split('/').filter(|field| !field.is_empty()).map(ToOwned::to_owned).collect();
    let kind = match port {
        "enabled" => WriteKind::Enabled,
        "params" => WriteKind::Setting { path: format!("modules.{key}.params"), fields, is_parameter: true },
        port => {
            // Names of ports may have slashes.
            let port = if port.contains('/') { quoted(port) } else { port.into() };
            WriteKind::Setting { path: format!("modules.{key}.inputs.{port}"), fields, is_parameter: false }
        }
    };
    let is_for_operators = match kind {
        WriteKind::Enabled => false,
        WriteKind::Setting { is_parameter, .. } => !is_parameter || surface.is_operable(&path, body),
    };
    if !is_for_operators && request.caller.role < Role::Developer {
        let message = format!(
            "{} may not do this: parameters and switches are a developer's",
            request.caller.role.with_article()
        );
        let help = "ask with the token of a developer, or let `console.operable` have what operators set";
        return Err(Problem::new(StatusCode::FORBIDDEN, message, help));
    }
    Ok(WriteTarget { property, module, kind })
}

/// Returns the module that has a property.
fn module_of(surface: &ControlSurface, path: &str) -> Option<String> {
    let modules = surface.agent.composer().modules().into_iter().map(|module| module.name);
    modules.filter(|module| path.starts_with(&format!("{module}/"))).max_by_key(String::len)
}

fn set(
    surface: &Arc<ControlSurface>,
    request: &OperationRequest,
    target: &WriteTarget,
    body: &Json,
) -> Result<OperationAnswer, Problem> {
    let dry = request.is_dry()?;
    // One at a time, so that of two clients with one version only the first changes it.
    let _turn = surface.turn();
    let holds = || check_version(request, &target.property);
    let (path, fields, is_parameter) = match &target.kind {
        WriteKind::Setting { path, fields, is_parameter } => (path, fields, *is_parameter),
        WriteKind::Enabled => {
            let wrong = || Problem::unfit("`enabled` is true or false", "send true or false");
            let on = body.as_bool().ok_or_else(wrong)?;
            holds()?;
            if dry {
                return Ok(OperationAnswer::json(json!([])));
            }
            let switched = surface.agent.enable(&target.module, on)?;
            let changed = switched.changed.then(|| SettingChange {
                path: enabled(&target.module),
                before: Some((!on).to_string()),
                after: Some(on.to_string()),
                needs_reload: switched.needs_reload,
                ..SettingChange::default()
            });
            return Ok(OperationAnswer::json(json!(Vec::from_iter(changed))));
        }
    };
    check_value(target, fields, body)?;
    let changes = match (is_parameter, fields.is_empty(), body) {
        (_, true, Json::Object(entries)) if is_parameter => entries
            .iter()
            .map(|(name, value)| Ok((format!("{path}.{}", quoted(name)), toml(value)?)))
            .collect::<Result<Vec<_>, Problem>>()?,
        // An input is a whole in the configuration, with the other fields as they are.
        (false, ..) => vec![(path.clone(), toml(&whole(target, fields, body)?)?)],
        _ => {
            let names: Vec<_> = fields.iter().map(|field| quoted(field)).collect();
            vec![(format!("{path}.{}", names.join(".")), toml(body)?)]
        }
    };
    if dry {
        holds()?;
        return reply(surface.agent.settings.set(&changes, true));
    }
    let changed = surface.agent.settings.set_if(&changes, holds)?;
    Ok(OperationAnswer::json(serde_json::to_value(changed).unwrap_or_default()))
}

/// Refuses an invalid value of the interface, in words of the interface.
fn check_value(target: &WriteTarget, fields: &[String], body: &Json) -> Result<(), Problem> {
    let descriptor = target.property.descriptor();
    let (mut bytes, items) = present(&target.property)?;
    let wrong = |error| BoardError::Access { url: format!("/{}", target.property.path()), error };
    edit(descriptor, &mut bytes, items, &fields.join("/"), &value(body)?).map(drop).map_err(wrong)?;
    Ok(())
}

/// Returns the resulting value as JSON.
fn whole(target: &WriteTarget, fields: &[String], body: &Json) -> Result<Json, Problem> {
    let descriptor = target.property.descriptor();
    let (mut bytes, items) = present(&target.property)?;
    let wrong = |error| BoardError::Access { url: format!("/{}", target.property.path()), error };
    let items = edit(descriptor, &mut bytes, items, &fields.join("/"), &value(body)?).map_err(wrong)?;
    let view = slate_blackboard::interface::View::new(descriptor, &bytes, items);
    let mut whole = view.and_then(|view| serde_json::to_value(view).ok()).unwrap_or_default();
    // No setting says that there is nothing.
    without_nothing(&mut whole);
    Ok(whole)
}

fn without_nothing(value: &mut Json) {
    match value {
        Json::Object(entries) => {
            entries.retain(|_, value| !value.is_null());
            entries.values_mut().for_each(without_nothing);
        }
        Json::Array(items) => items.iter_mut().for_each(without_nothing),
        _ => {}
    }
}

/// Returns the current bytes and the item count of the tail.
/// The bytes have room for the longest tail.
fn present(property: &Property) -> Result<(Vec<u8>, usize), Problem> {
    let shape = property.channel().map(|channel| channel.shape());
    let room = shape.map_or(0, |shape| shape.bytes(shape.capacity));
    let (mut bytes, items) = property.newest()?.map_or((Vec::new(), 0), |(bytes, items, _)| (bytes, items));
    bytes.resize(room, 0);
    Ok((bytes, items))
}

fn value(body: &Json) -> Result<Value, Problem> {
    serde_json::from_value(body.clone()).map_err(|error| Problem::unfit(error.to_string(), "send a value"))
}

/// Refuses a change of a value that is not the one the caller has seen.
fn check_version(request: &OperationRequest, property: &Property) -> Result<(), Problem> {
    let Some(wanted) = &request.if_match else { return Ok(()) };
    let newest = property.newest()?.map_or(0, |(_, _, stamp)| stamp.sequence);
    let present = version(newest);
    let mut wanted = wanted.split(',').map(str::trim);
    if wanted.any(|version| version == "*" || version == present) {
        return Ok(());
    }
    let message = format!("the value is of version {present} now");
    Err(Problem::new(StatusCode::PRECONDITION_FAILED, message, "read it again").with("etag", present))
}

fn send(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let body: Json = request.body()?;
    let dry = request.is_dry()?;
    let url = url(request)?;
    if let Some(path) = own_path(surface, &url) {
        let (property, field) = surface.board().find(&path)?;
        if property.access() == Access::Messages && !field.is_empty() {
            return Err(Problem::not_found(format!("/{path} is a part of a message"), "send the whole one"));
        }
        if property.access() != Access::Messages {
            let message = format!("/{} takes no messages", property.path());
            let help = "`slate set` and PUT set what can be set; `slate list` shows what there is";
            let problem = Problem::new(StatusCode::METHOD_NOT_ALLOWED, message, help);
            return Err(problem.of(ErrorCode::Value).with("allow", "GET, PUT, PATCH"));
        }
        let port = surface.agent.composer().port(property.path());
        if port.is_some_and(|port| port.role == DEVELOPER_ROLE) && request.caller.role < Role::Developer {
            let message = format!(
                "{} may not do this: orders to /{path} are a developer's",
                request.caller.role.with_article()
            );
            let help = "ask with the token of a developer";
            return Err(Problem::new(StatusCode::FORBIDDEN, message, help));
        }
    }
    let sent = surface.agent.messages.send(&url.to_string(), &body, dry);
    let status = sent.map_err(|refusal| {
        let status = match refusal.code.as_deref().and_then(ErrorCode::from_code) {
            Some(ErrorCode::OtherAgent) => StatusCode::NOT_FOUND,
            Some(_) => StatusCode::UNPROCESSABLE_ENTITY,
            None => StatusCode::CONFLICT,
        };
        Problem::refused(status, refusal)
    })?;
    Ok(OperationAnswer::json(json!({ "status": status })))
}
