//! Values on the command line: JSON, or TOML as in a configuration.

use serde::Deserialize as _;
use serde_json::Value;
use slate::control::{Client, ClientError};
use slate::runtime::Mistake;
use toml_edit::de::ValueDeserializer;

use crate::failure::Failure;

/// Reads JSON, or an inline table or array of TOML; `None` for any other text.
pub fn parse(text: &str) -> Option<Value> {
    if let Ok(value) = serde_json::from_str(text) {
        return Some(value);
    }
    let text = text.trim();
    if !text.starts_with(['{', '[']) {
        return None;
    }
    Value::deserialize(text.parse::<ValueDeserializer>().ok()?).ok()
}

/// Returns the error of a refused value, with an example of a valid one.
pub fn refused(client: &mut Client, verb: &str, url: &str, error: ClientError) -> Failure {
    let ClientError::Refused(mut refusal) = error else { return error.into() };
    if refusal.code.as_deref() == Some(Mistake::Value.code()) && refusal.help.starts_with("GET ") {
        let present = client.read(url).ok().flatten().map(|reading| reading.value);
        let example = match present.filter(Value::is_object) {
            Some(value) => toml(&value),
            None => "{ x = 1.0, y = 0.0 }".into(),
        };
        refusal.help = format!(
            "expected an inline table of TOML, or JSON, such as `slate {verb} {url} '{example}'`; `slate get {url}` prints \
             the fields"
        );
    }
    ClientError::Refused(refusal).into()
}

/// Returns a value as TOML in a line.
fn toml(value: &Value) -> String {
    match value {
        Value::Object(fields) => {
            let fields = fields.iter().filter(|(name, _)| *name != "reserved");
            let fields: Vec<_> = fields
                .map(|(name, value)| {
                    format!("{} = {}", toml_edit::Key::new(name).display_repr(), toml(value))
                })
                .collect();
            format!("{{ {} }}", fields.join(", "))
        }
        Value::Array(items) => format!("[{}]", items.iter().map(toml).collect::<Vec<_>>().join(", ")),
        other => other.to_string(),
    }
}
