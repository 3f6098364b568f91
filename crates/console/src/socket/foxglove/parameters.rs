//! Parameters of modules, by their paths.

use serde_json::{Value as Json, json};
use slate_blackboard::Access;
use slate_blackboard::interface::{Kind, Value};

use super::{FoxgloveSession, OutgoingMessage, status};

impl FoxgloveSession {
    /// Returns the current values of all parameters, or of the named ones.
    fn values(&self, names: &[String]) -> Vec<(String, Json)> {
        let mut values = Vec::new();
        for property in self.surface.board().properties() {
            if property.access() != Access::Setting || !property.path().ends_with("/params") {
                continue;
            }
            let Ok(Some((value, _))) = self.surface.board().read(property.path()) else { continue };
            for field in property.descriptor().fields {
                let name = format!("/{}/{}", property.path(), field.name);
                let of_field = value.get(field.name).filter(|_| !matches!(field.kind, Kind::Tail(_)));
                if let Some(value) = of_field.filter(|_| names.is_empty() || names.contains(&name)) {
                    values.push((name, parameter_value(value)));
                }
            }
        }
        values
    }

    pub(super) fn parameters(&self, names: &[String], id: Option<&str>) -> OutgoingMessage {
        message(self.values(names), id)
    }

    /// Sets parameters as a developer does over HTTP.
    /// The answer has their values afterwards.
    pub(super) fn set_parameters(
        &mut self,
        values: &[(String, Json)],
        id: Option<&str>,
    ) -> Vec<OutgoingMessage> {
        let mut out = Vec::new();
        for (name, value) in values {
            let path = name.trim_start_matches('/');
            let set = self.dispatcher.carry_out(&self.caller, "write", &[("path", path)], value.clone());
            if let Err(problem) = set {
                out.push(status(2, &format!("{name} is not set: {problem}"), None));
            }
        }
        let names: Vec<_> = values.iter().map(|(name, _)| name.clone()).collect();
        out.push(self.parameters(&names, id));
        out.extend(self.parameters_changed());
        out
    }

    pub(super) fn watch_parameters(&mut self, names: &[String]) {
        self.watched.extend(self.values(names));
    }

    /// Returns the watched parameters that differ from the values sent last.
    pub(super) fn parameters_changed(&mut self) -> Vec<OutgoingMessage> {
        if self.watched.is_empty() {
            return Vec::new();
        }
        let names: Vec<_> = self.watched.keys().cloned().collect();
        let mut changed = self.values(&names);
        changed.retain(|(name, value)| self.watched.get(name) != Some(value));
        self.watched.extend(changed.iter().cloned());
        if changed.is_empty() { Vec::new() } else { vec![message(changed, None)] }
    }
}

/// Converts a value for clients: numbers that are not finite become text.
fn parameter_value(value: &Value) -> Json {
    match value {
        Value::Float(number) if !number.is_finite() => json!(number.to_string()),
        value => serde_json::to_value(value).unwrap_or_default(),
    }
}

fn message(values: Vec<(String, Json)>, id: Option<&str>) -> OutgoingMessage {
    let parameters: Vec<_> = values
        .into_iter()
        .map(|(name, value)| {
            // A whole number may be meant as another one, and only this says so.
            let is_float = value.is_f64();
            let mut parameter = json!({ "name": name, "value": value });
            if is_float {
                parameter["type"] = json!("float64");
            }
            parameter
        })
        .collect();
    let mut message = json!({ "op": "parameterValues", "parameters": parameters });
    if let Some(id) = id {
        message["id"] = json!(id);
    }
    OutgoingMessage::Text(message.to_string())
}
