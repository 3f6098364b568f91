//! The links, and the other agents that they may lead to.

use std::sync::Arc;

use serde::Deserialize;
use serde_json::json;

use super::{DRY_RUN, TOKEN, conflict, shape, told};
use crate::Role;
use crate::answer::Answer;
use crate::context::Context;
use crate::operation::{Ask, Operation, Pace, Parameter};
use crate::problem::Problem;
use crate::text::{Texts, texts};

pub(super) const LIST: Operation = Operation {
    method: "GET",
    path: "/links",
    name: "links",
    summary: "The links, by their destinations",
    role: Role::Viewer,
    pace: Pace::Change,
    parameters: &[TOKEN],
    body: None,
    answer: || shape::list(shape::link()),
    kinds: &[],
    handler: |context, _| told(context.agent.links()),
};

pub(super) const LINK: Operation = Operation {
    method: "PUT",
    path: "/links/{input}",
    name: "link",
    summary: "Links an input, or adds a sender to an inbox",
    role: Role::Developer,
    pace: Pace::Change,
    parameters: &[DRY_RUN],
    body: Some(|| {
        json!({
            "type": "object",
            "required": ["from"],
            "properties": {
                "from": shape::text(),
                "options": texts("What else its table says, such as `every`."),
            },
            "additionalProperties": false,
        })
    }),
    answer: || shape::list(shape::changed()),
    kinds: &[],
    handler: link,
};

pub(super) const UNLINK: Operation = Operation {
    method: "DELETE",
    path: "/links/{input}",
    name: "unlink",
    summary: "Removes the links of an input or inbox",
    role: Role::Developer,
    pace: Pace::Change,
    parameters: &[
        Parameter {
            name: "from",
            doc: "The source of the link; all links unless given.",
            schema: shape::text,
        },
        DRY_RUN,
    ],
    body: None,
    answer: || shape::list(shape::changed()),
    kinds: &[],
    handler: unlink,
};

pub(super) const PEERS: Operation = Operation {
    method: "GET",
    path: "/peers",
    name: "peers",
    summary: "The other agents that are known, and what goes to and fro",
    role: Role::Viewer,
    pace: Pace::Slow,
    parameters: &[TOKEN],
    body: None,
    answer: peers,
    kinds: &[],
    handler: |context, _| told(context.agent.peers()),
};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Link {
    from: String,
    #[serde(default)]
    options: Texts,
}

fn link(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    let link: Link = ask.body()?;
    let (to, from) = (ask.own_url(ask.part("input")), ask.own_url(&link.from));
    conflict(context.agent.link(&to, &from, link.options.texts()?, ask.is_dry()?))
}

fn unlink(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    let from = ask.query.get("from").map(|from| ask.own_url(from));
    conflict(context.agent.unlink(&ask.own_url(ask.part("input")), from.as_deref(), ask.is_dry()?))
}

fn peers() -> serde_json::Value {
    let read = shape::object(&[
        ("path", shape::text()),
        ("served", shape::flag()),
        ("received", shape::count()),
        ("lost", shape::count()),
        ("reason", shape::text()),
    ]);
    let served = shape::object(&[("path", shape::text()), ("sent", shape::count()), ("lag", shape::count())]);
    let peer = shape::object(&[
        ("agent", shape::text()),
        ("endpoint", shape::optional(shape::text())),
        ("connected", shape::optional(shape::count())),
        ("round_trip", shape::count()),
        ("offset", json!({ "type": "integer" })),
        ("reason", shape::text()),
        ("reads", shape::list(read)),
        ("serves", shape::list(served)),
    ]);
    let rejected = shape::object(&[
        ("from", shape::text()),
        ("reason", shape::text()),
        ("count", shape::count()),
        ("ago", shape::count()),
    ]);
    shape::object(&[("peers", shape::list(peer)), ("rejected", shape::list(rejected))])
}
