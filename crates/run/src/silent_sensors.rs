//! Sensors that stopped or never measured, as the RobotModels of a run list them.

use slate_blackboard::Board;
use slate_blackboard::interface::{Descriptor, Interface, Kind, Value};
use slate_mapek::RobotModel;

use crate::observation::value;

/// Describes the sensors of all robots that do not measure, such as "r2: the sensor `sonar` stopped at 2.48 s"; none if all measure.
pub fn describe(board: &Board) -> Option<String> {
    let mut stopped = Vec::new();
    for property in board.properties() {
        let Some(field) = robot_model_of(property.descriptor()) else { continue };
        let Some(whole) = value(&property) else { continue };
        let model = if field.is_empty() { Some(&whole) } else { whole.get(field) };
        let Some(Value::List(sensors)) = model.and_then(|model| model.get("sensors")) else { continue };
        let robot = property.path().trim_start_matches('/').split('/').next().unwrap_or_default();
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

/// The field of an interface that is a RobotModel; empty for a RobotModel itself.
fn robot_model_of(descriptor: &Descriptor) -> Option<&'static str> {
    let model = RobotModel::DESCRIPTOR.hash;
    if descriptor.hash == model {
        return Some("");
    }
    let is_model = |kind: &Kind| matches!(kind, Kind::Nested(nested) if nested.hash == model);
    descriptor.fields.iter().find(|field| is_model(&field.kind)).map(|field| field.name)
}
