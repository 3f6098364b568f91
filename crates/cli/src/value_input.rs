//! Values on the command line: JSON, or TOML as in a configuration.

use serde::Deserialize as _;
use serde_json::Value;
use slate::blackboard::nearest_names;
use slate::control::{Client, ClientError};
use slate::runtime::ErrorCode;
use toml_edit::de::ValueDeserializer;

use crate::failure::Failure;
use crate::urls;

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
    if refusal.code.as_deref() == Some(ErrorCode::Name.code()) && refusal.help.starts_with("GET ") {
        refusal.help = known_names(client, url);
        return urls::unknown(client, url, ClientError::Refused(refusal));
    }
    if refusal.code.as_deref() == Some(ErrorCode::Value.code()) && refusal.help.starts_with("GET ") {
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

/// Returns help about an unknown name.
/// It is the nearest field of the value above, or the command that lists the names.
fn known_names(client: &mut Client, url: &str) -> String {
    let (above, name) = url.trim_end_matches('/').rsplit_once('/').unwrap_or_default();
    let value = client.read(above).ok().flatten().map(|reading| reading.value);
    match value.as_ref().and_then(Value::as_object) {
        Some(fields) => match nearest_names(name, fields.keys().map(String::as_str)).first() {
            Some(near) => format!("did you mean {above}/{near}?"),
            None => format!("`slate get {above}` prints the fields"),
        },
        None => {
            "`slate list` lists the properties, and `slate tree '/**/params' --values` the parameters".into()
        }
    }
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
