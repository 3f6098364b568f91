//! Sensors that stopped or never measured, as the RobotModels of a run list them.

use std::sync::Arc;

use slate_blackboard::interface::{Descriptor, Interface, Kind, Value};
use slate_blackboard::{Access, Board, Property, is_within};
use slate_mapek::RobotModel;

use crate::observation::value;

/// Age from which a RobotModel is no longer updated, ns: its robot does not know its pose.
const OLD: u64 = 1_000_000_000;

/// Describes the sensors of all robots that do not measure at a time, ns, such as "r2: the sensor `sonar` stopped at 2.48 s"; none if
/// all measure.
pub fn describe(board: &Board, now: u64) -> Option<String> {
    let mut stopped = Vec::new();
    for property in board.properties() {
        let Some(field) = robot_model_of(property.descriptor()) else { continue };
        let robot = property.path().trim_start_matches('/').split('/').next().unwrap_or_default();
        let Ok(Some((whole, stamp))) = board.read(property.path()) else {
            if property.access() == Access::Output && property.has_writer() {
                stopped.push(format!("{robot}: never a pose{}", degraded_modules(board, robot)));
            }
            continue;
        };
        let model = if field.is_empty() { Some(&whole) } else { whole.get(field) };
        let Some(Value::List(sensors)) = model.and_then(|model| model.get("sensors")) else { continue };
        if now.saturating_sub(stamp.time) > OLD {
            let since = stamp.time as f64 * 1e-9;
            stopped.push(format!("{robot}: no pose since {since:.2} s{}", degraded_modules(board, robot)));
            continue;
        }
        for sensor in sensors {
            let text = |name: &str| sensor.get(name).and_then(Value::as_str).unwrap_or_default();
            let since = || sensor.get("measured").and_then(Value::as_f64).unwrap_or_default() * 1e-9;
            let condition = match text("health") {
                "SILENT" => format!("stopped at {:.2} s", since()),
                "UNKNOWN" => "never measured".into(),
                _ => continue,
            };
            stopped.push(format!("{robot}: the sensor `{}` {condition}", text("name")));
        }
    }
    stopped.sort();
    (!stopped.is_empty()).then(|| stopped.join("; "))
}

/// Modules of a robot that are degraded, in brackets; nothing without one.
fn degraded_modules(board: &Board, robot: &str) -> String {
    let is_degraded = |property: &Arc<Property>| {
        let state = value(property);
        state.is_some_and(|state| state.get("condition").and_then(Value::as_str) == Some("DEGRADED"))
    };
    let of_robot = board.properties().into_iter().filter(|property| is_within(property.path(), robot));
    let paths = of_robot
        .filter(is_degraded)
        .filter_map(|property| property.path().strip_suffix("/state").map(str::to_owned));
    let modules: Vec<_> = paths.map(|path| format!("{path} is degraded")).collect();
    if modules.is_empty() { String::new() } else { format!(" ({})", modules.join(", ")) }
}

/// The field of an interface that is a RobotModel; empty for a RobotModel itself.
fn robot_model_of(descriptor: &Descriptor) -> Option<&'static str> {
    let model = RobotModel::DESCRIPTOR.hash;
    if descriptor.hash == model {
        return Some("");
    }
    let is_model = |kind: &Kind| matches!(kind, Kind::Nested(nested) if nested.hash == model);
    descriptor.fields.iter().find(|field| is_model(&field.kind)).map(|field| field.name)
}
