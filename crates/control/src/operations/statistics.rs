//! How the agent fares.

use std::fmt::Write;
use std::sync::Arc;

use serde_json::{Value as Json, json};

use super::{TOKEN, shape};
use crate::Role;
use crate::answer::Answer;
use crate::context::Context;
use crate::operation::{Ask, Operation, Pace};
use crate::problem::Problem;

pub(super) const STATISTICS: Operation = Operation {
    method: "GET",
    path: "/statistics",
    name: "statistics",
    summary: "How often each module runs, how long it takes, and what it misses",
    role: Role::Viewer,
    pace: Pace::Slow,
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
    handler: statistics,
};

pub(super) const METRICS: Operation = Operation {
    method: "GET",
    path: "/metrics",
    name: "metrics",
    summary: "The same for Prometheus",
    role: Role::Viewer,
    pace: Pace::Slow,
    parameters: &[TOKEN],
    body: None,
    answer: shape::text,
    kinds: &["text/plain"],
    handler: metrics,
};

pub(super) const RECORDING: Operation = Operation {
    method: "GET",
    path: "/recording",
    name: "recording",
    summary: "What the agent records of itself",
    role: Role::Viewer,
    pace: Pace::Slow,
    parameters: &[TOKEN],
    body: None,
    answer: shape::anything,
    kinds: &[],
    handler: recording,
};

/// A value on the blackboard; null when there is none.
fn newest(context: &Context, path: &str) -> Json {
    let read = context.board().read(path).ok().flatten();
    read.and_then(|(value, _)| serde_json::to_value(value).ok()).unwrap_or_default()
}

pub(super) fn statistics(context: &Arc<Context>, _: &Ask) -> Result<Answer, Problem> {
    let modules = context.agent.composer().modules().into_iter().map(|module| {
        json!({
            "timing": newest(context, &format!("{}/timing", module.name)),
            "name": module.name,
            "condition": module.condition,
            "waiting_for": module.waiting_for,
            "ticks": module.ticks,
            "misses": module.misses,
            "panics": module.panics,
        })
    });
    Ok(Answer::json(json!({
        "time": context.now(),
        "modules": modules.collect::<Vec<_>>(),
        "loop": { "state": newest(context, "loop/state"), "histogram": newest(context, "loop/histogram") },
        "log": newest(context, "log/counts"),
    })))
}

pub(super) fn recording(context: &Arc<Context>, _: &Ask) -> Result<Answer, Problem> {
    Ok(Answer::json(newest(context, "record/state")))
}

pub(super) fn metrics(context: &Arc<Context>, _: &Ask) -> Result<Answer, Problem> {
    let mut text = String::new();
    let modules = context.agent.composer().modules();
    // Nothing is wrong with writing into a text.
    let _ = write!(
        text,
        "# TYPE slate_time_seconds gauge\nslate_time_seconds {}\n# TYPE slate_module_working gauge\n",
        context.now() as f64 / 1e9
    );
    for module in &modules {
        let working = u8::from(module.condition == "WORKING");
        let _ = writeln!(text, "slate_module_working{{module=\"{}\"}} {working}", module.name);
    }
    type Count = fn(&slate_runtime::ModuleStatus) -> u64;
    let counts: [(&str, Count); 3] = [
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
    let stopped = context.agent.composer().actuators();
    text.push_str("# TYPE slate_actuator_stopped gauge\n");
    for (name, reason) in stopped {
        let _ =
            writeln!(text, "slate_actuator_stopped{{actuator=\"{name}\"}} {}", u8::from(reason.is_some()));
    }
    Ok(Answer::Bytes("text/plain; version=0.0.4; charset=utf-8", text.into_bytes()))
}
