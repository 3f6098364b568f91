//! Values as they come, for callers that ask again and again.

use std::sync::Arc;
use std::time::Duration;

use serde::Deserialize;
use serde_json::json;

use super::{reply, shape};
use crate::Role;
use crate::agent::MAX_CALL_DURATION;
use crate::answer::OperationAnswer;
use crate::entries::Watched;
use crate::operation::{Operation, OperationRequest, Pace};
use crate::problem::Problem;
use crate::surface::ControlSurface;

pub(super) const WATCH: Operation = Operation::post(
    "/watch",
    "watch",
    Role::Viewer,
    "The values of several properties that are newer than those already seen; waits for the first \
     one", Pace::Slow).body(|| {
        let watched = json!({
            "type": "object",
            "required": ["url"],
            "properties": {
                "url": shape::text(),
                "after": { "type": ["integer", "null"], "minimum": 0, "description": "The last sequence number seen." },
            },
        });
        json!({
            "type": "object",
            "required": ["of"],
            "properties": {
                "of": { "type": "array", "items": watched, "minItems": 1, "maxItems": 1000 },
                "within": wait("The longest wait, ms; 0 unless given."),
            },
            "additionalProperties": false,
        })
    }).answers(|| {
        shape::list(shape::object(&[
            ("of", shape::count()),
            ("missed", shape::count()),
            ("readings", shape::list(shape::reading())),
        ]))
    }, watch);

pub(super) const MEASURE: Operation = Operation::post(
    "/measure",
    "measure",
    Role::Viewer,
    "The rates, intervals and sizes of the values of several properties, measured for a while",
    Pace::Slow,
)
.body(|| {
    let urls = json!({ "type": "array", "items": shape::text(), "minItems": 1, "maxItems": 1000 });
    shape::object(&[("urls", urls), ("time", wait("Duration of the measurement, ms."))])
})
.answers(|| shape::list(measured()), measure);

fn wait(doc: &str) -> serde_json::Value {
    json!({ "type": "integer", "minimum": 0, "maximum": MAX_CALL_DURATION.as_millis() as u64, "description": doc })
}

fn measured() -> serde_json::Value {
    let number = || shape::optional(json!({ "type": "number" }));
    let spread = shape::object(&[
        ("min", shape::count()),
        ("mean", json!({ "type": "number" })),
        ("deviation", json!({ "type": "number" })),
        ("p50", shape::count()),
        ("p95", shape::count()),
        ("p99", shape::count()),
        ("max", shape::count()),
    ]);
    shape::object(&[
        ("url", shape::text()),
        ("interface", shape::text()),
        ("count", shape::count()),
        ("rate", number()),
        ("interval", shape::optional(spread)),
        ("unseen", shape::count()),
        ("size", number()),
        ("bandwidth", number()),
        ("age", shape::optional(shape::count())),
        ("readers", shape::count()),
        ("has_writer", shape::flag()),
        ("lost", shape::count()),
    ])
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WatchRequest {
    of: Vec<Watched>,
    #[serde(default)]
    within: u64,
}

fn watch(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let WatchRequest { mut of, within } = request.body()?;
    of.iter_mut().for_each(|watched| watched.url = request.own_url(&watched.url));
    let is_over = surface.run_end().is_some();
    let within = if is_over { Duration::ZERO } else { Duration::from_millis(within) };
    let news = surface.agent.values.watch(&of, within)?;
    let is_elsewhere = |watched: &Watched| surface.agent.properties.remote.of(&watched.url).is_some();
    match surface.run_end() {
        // Another agent may continue.
        Some(how) if news.as_array().is_some_and(Vec::is_empty) && !of.iter().any(is_elsewhere) => {
            Err(Problem::run_over(surface.name(), how, "no new value arrived"))
        }
        _ => Ok(OperationAnswer::json(news)),
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MeasureRequest {
    urls: Vec<String>,
    time: u64,
}

fn measure(surface: &Arc<ControlSurface>, request: &OperationRequest) -> Result<OperationAnswer, Problem> {
    let MeasureRequest { urls, time } = request.body()?;
    let urls: Vec<_> = urls.iter().map(|url| request.own_url(url)).collect();
    reply(surface.agent.values.measure(&urls, Duration::from_millis(time)))
}
