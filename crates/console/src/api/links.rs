//! The links, and the other agents that they may lead to.

use std::sync::Arc;

use serde::Deserialize;
use serde_json::{Map, Value as Json, json};
use slate_runtime::remote::Call;

use super::{DRY_RUN, TOKEN, ask, conflict, shape};
use crate::Role;
use crate::answer::Answer;
use crate::context::Context;
use crate::problem::Problem;
use crate::route::{Ask, Operation};
use crate::text::toml;

pub(super) const LIST: Operation = Operation {
    method: "GET",
    path: "/links",
    name: "links",
    summary: "The links, by their destinations",
    role: Role::Viewer,
    parameters: &[TOKEN],
    body: None,
    answer: || shape::list(shape::link()),
    kinds: &[],
    handler: |context, _| ask(context, Call::LinkList {}),
};

pub(super) const LINK: Operation = Operation {
    method: "PUT",
    path: "/links/{input}",
    name: "link",
    summary: "Links an input, or adds a sender to an inbox",
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
    handler: link,
};

pub(super) const UNLINK: Operation = Operation {
    method: "DELETE",
    path: "/links/{input}",
    name: "unlink",
    summary: "Takes the links of an input or inbox away",
    role: Role::Developer,
    parameters: &[DRY_RUN],
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
    parameters: &[TOKEN],
    body: None,
    answer: shape::anything,
    kinds: &[],
    handler: |context, _| ask(context, Call::Peers {}),
};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Link {
    from: String,
    #[serde(default)]
    options: Map<String, Json>,
}

pub(super) fn link(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    let link: Link = ask.body()?;
    let options = link.options.iter().map(|(name, value)| Ok((name.clone(), toml(value)?)));
    let call = Call::Link {
        to: ask.part("input").into(),
        from: link.from,
        options: options.collect::<Result<_, Problem>>()?,
        dry_run: ask.is_dry()?,
    };
    conflict(context, call)
}

pub(super) fn unlink(context: &Arc<Context>, ask: &Ask) -> Result<Answer, Problem> {
    conflict(context, Call::Unlink { to: ask.part("input").into(), from: None, dry_run: ask.is_dry()? })
}
