//! Statistics of the agent.

use std::fmt::Write;
use std::sync::Arc;

use serde_json::{Value as Json, json};

use super::shape;
use crate::Role;
use crate::answer::OperationAnswer;
use crate::operation::{Operation, OperationRequest};
use crate::problem::Problem;
use crate::surface::ControlSurface;

pub(super) const STATISTICS: Operation = Operation::get(
    "/statistics",
    "statistics",
    Role::Viewer,
    "Rates, durations and missed deadlines of each module",
)
.answers(
    || {
        shape::object(&[
            ("time", shape::count()),
            ("modules", shape::list(shape::anything())),
            ("loop", shape::anything()),
            ("log", shape::anything()),
        ])
    },
    statistics,
);

pub(super) const METRICS: Operation =
    Operation::get("/metrics", "metrics", Role::Viewer, "Statistics for Prometheus")
        .kinds(&["text/plain"])
        .answers(shape::text, metrics);

pub(super) const RECORDING: Operation =
    Operation::get("/recording", "recording", Role::Viewer, "State of the agent's own recording")
        .answers(shape::anything, recording);

/// Returns a value on the blackboard; null without one.
fn newest(surface: &ControlSurface, path: &str) -> Json {
    let read = surface.board().read(path).ok().flatten();
    read.and_then(|(value, _)| serde_json::to_value(value).ok()).unwrap_or_default()
}

pub(super) fn statistics(
    surface: &Arc<ControlSurface>,
    _: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let modules = surface.agent.composer().modules().into_iter().map(|module| {
        json!({
            "timing": newest(surface, &format!("{}/timing", module.name)),
            "name": module.name,
            "condition": module.condition,
            "waiting_for": module.waiting_for,
            "ticks": module.ticks,
            "misses": module.misses,
            "panics": module.panics,
        })
    });
    Ok(OperationAnswer::json(json!({
        "time": surface.now(),
        "modules": modules.collect::<Vec<_>>(),
        "loop": { "state": newest(surface, "loop/state"), "histogram": newest(surface, "loop/histogram") },
        "log": newest(surface, "log/counts"),
    })))
}

pub(super) fn recording(
    surface: &Arc<ControlSurface>,
    _: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    Ok(OperationAnswer::json(newest(surface, "record/state")))
}

pub(super) fn metrics(
    surface: &Arc<ControlSurface>,
    _: &OperationRequest,
) -> Result<OperationAnswer, Problem> {
    let mut text = String::new();
    let modules = surface.agent.composer().modules();
    // Nothing is wrong with writing into a text.
    let _ = write!(
        text,
        "# TYPE slate_time_seconds gauge\nslate_time_seconds {}\n# TYPE slate_module_working gauge\n",
        surface.now() as f64 / 1e9
    );
    for module in &modules {
        let working = u8::from(module.condition == "WORKING");
        let _ = writeln!(text, "slate_module_working{{module=\"{}\"}} {working}", module.name);
    }
    type Count = fn(&slate_runtime::ModuleStatus) -> u64;
    let counts: &[(&str, Count)] = &[
        ("slate_module_ticks_total", |module| module.ticks),
        ("slate_module_misses_total", |module| module.misses),
        ("slate_module_panics_total", |module| module.panics),
    ];
    for (name, count) in counts {
        let _ = writeln!(text, "# TYPE {name} counter");
        for module in &modules {
            let _ = writeln!(text, "{name}{{module=\"{}\"}} {}", module.name, count(module));
        }
    }
    let stopped = surface.agent.composer().actuators();
    text.push_str("# TYPE slate_actuator_stopped gauge\n");
    for (name, reason) in stopped {
        let _ =
            writeln!(text, "slate_actuator_stopped{{actuator=\"{name}\"}} {}", u8::from(reason.is_some()));
    }
    Ok(OperationAnswer::Bytes("text/plain; version=0.0.4; charset=utf-8", text.into_bytes()))
}
