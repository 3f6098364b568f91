//! The operations.

mod history;
mod layouts;
mod leases;
mod log;
mod motion;
mod openapi;
mod parts;
mod playback;
pub(crate) mod recordings;
mod settings;
mod shape;
pub(crate) mod snapshots;
mod sockets;
mod statistics;
mod threads;
mod tree;
mod values;
mod write;

use std::sync::Arc;

use serde_json::{Value as Json, json};
use slate_runtime::remote::Call;

use crate::Role;
use crate::answer::Answer;
use crate::context::Context;
use crate::problem::Problem;
use crate::query::Query;
use crate::route::{Ask, Operation, Parameter};

/// The name of the operation that waits for nobody.
pub(crate) const STOP: &str = "stop";

/// The name of the operation that somebody who drives calls again and again.
pub(crate) const DRIVE: &str = "drive";

const DRY_RUN: Parameter =
    Parameter { name: "dry_run", doc: "Only finds out whether it can be done.", schema: shape::flag };

const PATTERN: Parameter = Parameter {
    name: "pattern",
    doc: "Which of them, such as /r2/planner/* or /**/timing; all unless given.",
    schema: shape::text,
};

const FORMAT: Parameter = Parameter {
    name: "format",
    doc: "The form of the answer, where a browser can't say it by `Accept`.",
    schema: || json!({ "enum": ["json", "text", "png", "jpeg", "mjpeg", "events"] }),
};

const SELECTION: [Parameter; 2] = [
    Parameter { name: "pointer", doc: "A part of the value, by JSON Pointer.", schema: shape::text },
    Parameter {
        name: "select",
        doc: "Parts of the value, by JSONPath without filters and functions; a list.",
        schema: shape::text,
    },
];

const TOKEN: Parameter =
    Parameter { name: "token", doc: "The token, where a browser can set no header.", schema: shape::text };

/// All of them. What is more special stands before what is more general.
pub(crate) const OPERATIONS: &[Operation] = &[
    Operation {
        method: "GET",
        path: "",
        name: "index",
        summary: "What there is",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: shape::anything,
        kinds: &[],
        handler: |_, _| Ok(Answer::json(openapi::index(OPERATIONS))),
    },
    Operation {
        method: "GET",
        path: "/openapi.json",
        name: "openapi",
        summary: "This document",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: shape::anything,
        kinds: &[],
        handler: |context, _| Ok(Answer::json(openapi::document(OPERATIONS, context))),
    },
    Operation {
        method: "GET",
        path: "/agent",
        name: "agent",
        summary: "The agent, and what the caller may do",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: shape::agent,
        kinds: &[],
        handler: tree::agent,
    },
    Operation {
        method: "GET",
        path: "/properties",
        name: "properties",
        summary: "The properties, in the order of their paths",
        role: Role::Viewer,
        parameters: &[
            PATTERN,
            Parameter { name: "values", doc: "With values of at most 4 KiB.", schema: shape::flag },
            TOKEN,
        ],
        body: None,
        answer: || shape::list(shape::property()),
        kinds: &[],
        handler: tree::properties,
    },
    Operation {
        method: "GET",
        path: "/interfaces",
        name: "interfaces",
        summary: "What values are made of, by their names",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: || json!({ "type": "object", "additionalProperties": { "type": "object" } }),
        kinds: &[],
        handler: tree::interfaces,
    },
    Operation {
        method: "GET",
        path: "/interfaces/{interface}",
        name: "interface",
        summary: "What values of an interface are made of, as JSON Schema",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: || json!({ "type": "object" }),
        kinds: &[],
        handler: tree::interface,
    },
    Operation {
        method: "GET",
        path: "/slate/{agent}/{path}",
        name: "read",
        summary: "The newest value of slate://agent/path, or a stream of its values",
        role: Role::Viewer,
        parameters: &[
            FORMAT,
            SELECTION[0],
            SELECTION[1],
            Parameter {
                name: "bare",
                doc: "The value alone, without sequence and time.",
                schema: shape::flag,
            },
            Parameter {
                name: "rate",
                doc: "How often a stream looks for news, in Hz; 10 unless given.",
                schema: || json!({ "type": "number", "minimum": 0.01, "maximum": 100 }),
            },
            Parameter {
                name: "every",
                doc: "A stream has each value that is kept, and not only the newest.",
                schema: shape::flag,
            },
            Parameter {
                name: "quality",
                doc: "The quality of JPEG; 80 unless given.",
                schema: || json!({ "type": "integer", "minimum": 1, "maximum": 100 }),
            },
            TOKEN,
        ],
        body: None,
        answer: shape::reading,
        kinds: &["text/plain", "image/png", "image/jpeg", "multipart/x-mixed-replace", "text/event-stream"],
        handler: values::read,
    },
    Operation {
        method: "PUT",
        path: "/slate/{agent}/{path}",
        name: "write",
        summary: "Sets a parameter, an input without a link, or whether a module is enabled; or a field of them",
        role: Role::Operator,
        parameters: &[DRY_RUN],
        body: Some(shape::anything),
        answer: || shape::list(shape::changed()),
        kinds: &[],
        handler: write::put,
    },
    Operation {
        method: "PATCH",
        path: "/slate/{agent}/{path}",
        name: "patch",
        summary: "Sets fields, and leaves the others as they are",
        role: Role::Operator,
        parameters: &[DRY_RUN],
        body: Some(|| json!({ "type": "object", "minProperties": 1 })),
        answer: || shape::list(shape::changed()),
        kinds: &[],
        handler: write::patch,
    },
    Operation {
        method: "POST",
        path: "/slate/{agent}/{path}",
        name: "send",
        summary: "Sends a message to a property that takes them; waits up to a second for what becomes of it",
        role: Role::Operator,
        parameters: &[DRY_RUN],
        body: Some(shape::anything),
        answer: || shape::object(&[("status", json!({ "enum": ["accepted", "done", "fits"] }))]),
        kinds: &[],
        handler: write::send,
    },
    Operation {
        method: "GET",
        path: "/queues/{agent}/{path}",
        name: "queue",
        summary: "The values that a property keeps, the oldest first",
        role: Role::Viewer,
        parameters: &[
            SELECTION[0],
            SELECTION[1],
            Parameter { name: "after", doc: "Only those after that sequence number.", schema: shape::count },
            Parameter { name: "limit", doc: "At most so many; 1000 unless given.", schema: shape::count },
            TOKEN,
        ],
        body: None,
        answer: || {
            shape::object(&[
                ("values", shape::list(shape::reading())),
                ("next", shape::count()),
                ("lost", shape::count()),
            ])
        },
        kinds: &[],
        handler: values::queue,
    },
    Operation {
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
    },
    Operation {
        method: "PUT",
        path: "/modules/{module}",
        name: "switch",
        summary: "Switches a module on or off",
        role: Role::Developer,
        parameters: &[],
        body: Some(|| shape::object(&[("enabled", shape::flag())])),
        answer: || {
            shape::object(&[("changed", shape::flag()), ("needs_reload", shape::optional(shape::text()))])
        },
        kinds: &[],
        handler: parts::switch,
    },
    Operation {
        method: "GET",
        path: "/plugins",
        name: "plugins",
        summary: "The plugins that are loaded, and those that are known",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: || shape::list(shape::plugin()),
        kinds: &[],
        handler: |context, _| ask(context, Call::PluginList {}),
    },
    Operation {
        method: "PUT",
        path: "/plugins/{plugin}",
        name: "load",
        summary: "Loads a plugin, or a list of plugins, of the configuration",
        role: Role::Developer,
        parameters: &[],
        body: None,
        answer: shape::anything,
        kinds: &[],
        handler: parts::load,
    },
    Operation {
        method: "DELETE",
        path: "/plugins/{plugin}",
        name: "unload",
        summary: "Unloads a plugin, or those of a list",
        role: Role::Developer,
        parameters: &[],
        body: None,
        answer: shape::anything,
        kinds: &[],
        handler: parts::unload,
    },
    Operation {
        method: "POST",
        path: "/plugins/{plugin}/reload",
        name: "reload",
        summary: "Exchanges the code of a plugin by what its library has now",
        role: Role::Developer,
        parameters: &[],
        body: None,
        answer: shape::anything,
        kinds: &[],
        handler: parts::reload,
    },
    Operation {
        method: "GET",
        path: "/links",
        name: "links",
        summary: "The links, by their inputs",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: || shape::list(shape::link()),
        kinds: &[],
        handler: |context, _| ask(context, Call::LinkList {}),
    },
    Operation {
        method: "PUT",
        path: "/links/{input}",
        name: "link",
        summary: "Links an input",
        role: Role::Developer,
        parameters: &[DRY_RUN],
        body: Some(|| {
            json!({
                "type": "object",
                "required": ["from"],
                "properties": {
                    "from": shape::text(),
                    "options": { "type": "object", "description": "What else its table says, such as `every`." },
                },
                "additionalProperties": false,
            })
        }),
        answer: || shape::list(shape::changed()),
        kinds: &[],
        handler: parts::link,
    },
    Operation {
        method: "DELETE",
        path: "/links/{input}",
        name: "unlink",
        summary: "Takes the link of an input away",
        role: Role::Developer,
        parameters: &[DRY_RUN],
        body: None,
        answer: || shape::list(shape::changed()),
        kinds: &[],
        handler: parts::unlink,
    },
    Operation {
        method: "GET",
        path: "/peers",
        name: "peers",
        summary: "The other agents that are known, and what goes to and fro",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: shape::anything,
        kinds: &[],
        handler: |context, _| ask(context, Call::Peers {}),
    },
    Operation {
        method: "GET",
        path: "/settings",
        name: "settings",
        summary: "The settings at a path and below it, and where each is written",
        role: Role::Viewer,
        parameters: &[
            Parameter { name: "path", doc: "As --set takes it; all unless given.", schema: shape::text },
            TOKEN,
        ],
        body: None,
        answer: || shape::list(shape::setting()),
        kinds: &[],
        handler: settings::list,
    },
    Operation {
        method: "GET",
        path: "/parameters",
        name: "parameters",
        summary: "The parameters of all modules, with their defaults and ranges",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: || shape::list(shape::parameter()),
        kinds: &[],
        handler: parts::parameters,
    },
    Operation {
        method: "PATCH",
        path: "/settings",
        name: "set",
        summary: "Changes settings, all or none, by their paths",
        role: Role::Developer,
        parameters: &[DRY_RUN],
        body: Some(|| json!({ "type": "object", "minProperties": 1 })),
        answer: || shape::list(shape::changed()),
        kinds: &[],
        handler: settings::set,
    },
    Operation {
        method: "DELETE",
        path: "/settings",
        name: "revert",
        summary: "Takes back what was changed at run time and not saved",
        role: Role::Developer,
        parameters: &[Parameter {
            name: "path",
            doc: "That and what is below it; all unless given.",
            schema: shape::text,
        }],
        body: None,
        answer: || shape::list(shape::changed()),
        kinds: &[],
        handler: settings::revert,
    },
    Operation {
        method: "GET",
        path: "/settings/differences",
        name: "differences",
        summary: "What holds and is not what the files say",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: || shape::list(shape::different()),
        kinds: &[],
        handler: |context, _| ask(context, Call::ConfigDiff {}),
    },
    Operation {
        method: "POST",
        path: "/settings/save",
        name: "save",
        summary: "Writes what was changed at run time into the files, with their comments kept",
        role: Role::Developer,
        parameters: &[],
        body: Some(
            || json!({ "type": "object", "properties": { "to": { "enum": ["origin", "host"] } }, "additionalProperties": false }),
        ),
        answer: || shape::object(&[("files", shape::list(shape::text()))]),
        kinds: &[],
        handler: settings::save,
    },
    Operation {
        method: "GET",
        path: "/log",
        name: "log",
        summary: "The last lines of the log, or those that come as a stream of events",
        role: Role::Viewer,
        parameters: &[
            Parameter {
                name: "format",
                doc: "`events` for a stream.",
                schema: || json!({ "enum": ["json", "events"] }),
            },
            Parameter { name: "after", doc: "Only those after that sequence number.", schema: shape::count },
            Parameter {
                name: "level",
                doc: "Only those of that importance or more.",
                schema: || json!({ "enum": ["error", "warn", "info", "debug", "trace"] }),
            },
            Parameter {
                name: "module",
                doc: "Only those of a module, or of all whose names begin so.",
                schema: shape::text,
            },
            TOKEN,
        ],
        body: None,
        answer: || shape::list(shape::line()),
        kinds: &["text/event-stream"],
        handler: log::lines,
    },
    Operation {
        method: "POST",
        path: "/log",
        name: "note",
        summary: "Writes a line into the log, such as of something that is to be found again in the recording",
        role: Role::Operator,
        parameters: &[],
        body: Some(|| {
            shape::object(&[("text", json!({ "type": "string", "minLength": 1, "maxLength": 256 }))])
        }),
        answer: || json!({ "type": "object", "maxProperties": 0 }),
        kinds: &[],
        handler: log::note,
    },
    Operation {
        method: "GET",
        path: "/statistics",
        name: "statistics",
        summary: "How often each module runs, how long it takes, and what it misses",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: || {
            shape::object(&[
                ("time", shape::count()),
                ("modules", shape::list(shape::anything())),
                ("loop", shape::anything()),
                ("log", shape::anything()),
            ])
        },
        kinds: &[],
        handler: statistics::statistics,
    },
    threads::READ,
    Operation {
        method: "GET",
        path: "/metrics",
        name: "metrics",
        summary: "The same for Prometheus",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: shape::text,
        kinds: &["text/plain"],
        handler: statistics::metrics,
    },
    Operation {
        method: "GET",
        path: "/actuators",
        name: "actuators",
        summary: "The actuators, how their gates stand, and what they get",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: || shape::list(shape::actuator()),
        kinds: &[],
        handler: motion::actuators,
    },
    Operation {
        method: "POST",
        path: "/stop",
        name: STOP,
        summary: "Stops all actuators until `reset` and `arm`; it is no emergency stop",
        role: Role::Viewer,
        parameters: &[],
        body: Some(
            || json!({ "description": "Such as {\"reason\": \"...\"}; nothing that comes with it is a reason not to stop." }),
        ),
        answer: || shape::object(&[("stopped", shape::list(shape::text()))]),
        kinds: &[],
        handler: motion::stop,
    },
    Operation {
        method: "POST",
        path: "/reset",
        name: "reset",
        summary: "Ends a stop; nothing moves before the actuators are armed",
        role: Role::Operator,
        parameters: &[],
        body: None,
        answer: || shape::object(&[("was_stopped", shape::flag())]),
        kinds: &[],
        handler: motion::reset,
    },
    Operation {
        method: "POST",
        path: "/arm",
        name: "arm",
        summary: "Lets commands through to the actuators, or to one",
        role: Role::Operator,
        parameters: &[],
        body: Some(|| {
            let actuator = shape::optional(shape::text());
            json!({ "type": "object", "properties": { "actuator": actuator }, "additionalProperties": false })
        }),
        answer: || json!({ "type": "object", "maxProperties": 0 }),
        kinds: &[],
        handler: motion::arm,
    },
    Operation {
        method: "GET",
        path: "/leases",
        name: "leases",
        summary: "The actuators, and who has the controls of each",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: || shape::list(shape::holder()),
        kinds: &[],
        handler: leases::list,
    },
    Operation {
        method: "POST",
        path: "/leases",
        name: "take",
        summary: "Takes the controls of an actuator, which nobody else has then",
        role: Role::Operator,
        parameters: &[],
        body: Some(|| shape::object(&[("actuator", shape::text())])),
        answer: shape::lease,
        kinds: &[],
        handler: leases::take,
    },
    Operation {
        method: "PUT",
        path: "/leases/{lease}",
        name: DRIVE,
        summary: "Renews a lease of controls, which holds for 5 s, and commands the actuator for 150 ms",
        role: Role::Operator,
        parameters: &[],
        body: Some(shape::drive),
        answer: || {
            shape::object(&[
                ("actuator", shape::text()),
                ("gate", shape::anything()),
                ("time", shape::count()),
            ])
        },
        kinds: &[],
        handler: leases::renew,
    },
    Operation {
        method: "DELETE",
        path: "/leases/{lease}",
        name: "give_back",
        summary: "Gives the controls back",
        role: Role::Operator,
        parameters: &[],
        body: None,
        answer: || json!({ "type": "object", "maxProperties": 0 }),
        kinds: &[],
        handler: leases::give_back,
    },
    Operation {
        method: "POST",
        path: "/snapshots/{snapshot}/load",
        name: "load_snapshot",
        summary: "Goes on from a snapshot",
        role: Role::Developer,
        parameters: &[],
        body: None,
        answer: shape::snapshot,
        kinds: &[],
        handler: snapshots::load,
    },
    Operation {
        method: "POST",
        path: "/snapshots/{snapshot}",
        name: "save_snapshot",
        summary: "Takes a snapshot, into the folder `snapshots` where the agent was started",
        role: Role::Developer,
        parameters: &[],
        body: None,
        answer: shape::snapshot,
        kinds: &[],
        handler: snapshots::save,
    },
    Operation {
        method: "GET",
        path: "/recording",
        name: "recording",
        summary: "What the agent records of itself",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: shape::anything,
        kinds: &[],
        handler: statistics::recording,
    },
    recordings::LIST,
    recordings::END,
    recordings::FLIGHT,
    recordings::START,
    playback::STATUS,
    playback::PAUSE,
    playback::RESUME,
    playback::STEP,
    playback::SEEK,
    playback::RATE,
    playback::LOOP,
    history::READ,
    sockets::LIVE,
    sockets::TELEOPERATION,
    sockets::REMOTE,
    Operation {
        method: "GET",
        path: "/layouts",
        name: "layouts",
        summary: "The layouts of the page that the project has, by their names",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: || json!({ "type": "object" }),
        kinds: &[],
        handler: layouts::list,
    },
    Operation {
        method: "PUT",
        path: "/layouts/{layout}",
        name: "save_layout",
        summary: "Writes a layout into the project, as console/layouts/NAME.json where the agent was started",
        role: Role::Developer,
        parameters: &[],
        body: Some(|| {
            json!({
                "type": "object",
                "properties": { "title": shape::text(), "columns": { "type": "array", "minItems": 1 } },
                "required": ["title", "columns"],
            })
        }),
        answer: || shape::object(&[("file", shape::text())]),
        kinds: &[],
        handler: layouts::save,
    },
    Operation {
        method: "DELETE",
        path: "/layouts/{layout}",
        name: "remove_layout",
        summary: "Removes a layout of the project",
        role: Role::Developer,
        parameters: &[],
        body: None,
        answer: || json!({ "type": "object", "maxProperties": 0 }),
        kinds: &[],
        handler: layouts::remove,
    },
    Operation {
        method: "GET",
        path: "/documents",
        name: "documents",
        summary: "What the program tells beside the blackboard, such as the world of a simulator: names",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: || shape::list(shape::text()),
        kinds: &[],
        handler: tree::documents,
    },
    Operation {
        method: "GET",
        path: "/documents/{document}",
        name: "document",
        summary: "One of these",
        role: Role::Viewer,
        parameters: &[TOKEN],
        body: None,
        answer: shape::anything,
        kinds: &[],
        handler: tree::document,
    },
];

/// Sets what the host sets, for a client that speaks otherwise.
pub(crate) fn put_value(
    context: &Arc<Context>,
    role: Role,
    who: &str,
    path: &str,
    value: &Json,
) -> Result<Answer, Problem> {
    write::put(context, &spoken(context, role, who, path, value))
}

/// Sends a message, for a client that speaks otherwise.
pub(crate) fn send_value(
    context: &Arc<Context>,
    role: Role,
    who: &str,
    path: &str,
    value: &Json,
) -> Result<Answer, Problem> {
    write::send(context, &spoken(context, role, who, path, value))
}

fn spoken(context: &Context, role: Role, who: &str, path: &str, value: &Json) -> Ask {
    Ask {
        role,
        who: who.to_owned(),
        captured: vec![("agent", context.agent().to_owned()), ("path", path.to_owned())],
        query: Query::default(),
        accept: String::new(),
        if_match: None,
        last_event: None,
        body: Some(value.clone()),
    }
}

/// Asks the desk that the tools at the local socket ask too.
fn ask(context: &Context, call: Call) -> Result<Answer, Problem> {
    Ok(Answer::json(made(context, call)?))
}

fn made(context: &Context, call: Call) -> Result<Json, Problem> {
    context.desk.make(call).map_err(Problem::from)
}
