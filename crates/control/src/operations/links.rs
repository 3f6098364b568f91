//! Links, and the other agents of their ends.

use std::sync::Arc;

use serde::Deserialize;
use serde_json::json;

use super::{DRY_RUN, conflict, reply, shape};
use crate::Role;
use crate::answer::OperationAnswer;
use crate::operation::{Operation, OperationRequest, Pace, Parameter};
use crate::problem::Problem;
use crate::surface::ControlSurface;
use crate::text::{Texts, texts};

pub(super) const LIST: Operation = Operation::get("/links", "links", Role::Viewer, "Links, by destination")
    .pace(Pace::Change)
    .answers(|| shape::list(shape::link()), |surface, _| reply(surface.agent.links()));

pub(super) const LINK: Operation = Operation::put(
    "/links/{input}",
    "link",
    Role::Developer,
    "Links an input, or adds a sender to an inbox",
    Pace::Change,
)
.parameters(&[DRY_RUN])
.body(|| {
    json!({
        "type": "object",
        "required": ["from"],
        "properties": {
            "from": shape::text(),
            "options": texts("Options of the link, such as `every`."),
        },
        "additionalProperties": false,
    })
})
.answers(|| shape::list(shape::changed()), link);

pub(super) const UNLINK: Operation = Operation::delete(
    "/links/{input}",
    "unlink",
    Role::Developer,
    "Removes the links of an input or inbox",
    Pace::Change,
)
.parameters(&[
    Parameter { name: "from", doc: "The source of the link; all links unless given.", schema: shape::text },
    DRY_RUN,
])
.answers(|| shape::list(shape::changed()), unlink);

pub(super) const PEERS: Operation =
    Operation::get("/peers", "peers", Role::Viewer, "Known agents, and the traffic with each")
        .answers(peers, |surface, _| reply(surface.agent.peers()));

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LinkRequest {
    from: String,
    #[serde(default)]
    options: Texts,
}

fn link(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let link: LinkRequest = request.body()?;
    let (to, from) = (request.own_url(request.part("input")?), request.own_url(&link.from));
    conflict(surface.agent.link(&to, &from, link.options.texts()?, request.is_dry()?))
}

fn unlink(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let from = request.query.get("from").map(|from| request.own_url(from));
    conflict(surface.agent.unlink(
        &request.own_url(request.part("input")?),
        from.as_deref(),
        request.is_dry()?,
    ))
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
