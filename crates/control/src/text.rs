//! JSON as settings are written, and as the blackboard has it.

use serde::Deserialize;
use serde_json::{Map, Value as Json, json};

use crate::problem::Problem;

/// Names and values: an object of JSON values, or text pairs as in `--set`.
#[derive(Deserialize)]
#[serde(untagged)]
pub enum Texts {
    /// Values as JSON has them.
    Values(Map<String, Json>),
    /// Values as configurations have them.
    Pairs(Vec<(String, String)>),
}

impl Default for Texts {
    fn default() -> Self {
        Self::Pairs(Vec::new())
    }
}

impl Texts {
    /// Returns the pairs of texts.
    pub fn texts(self) -> Result<Vec<(String, String)>, Problem> {
        match self {
            Self::Values(values) => {
                values.iter().map(|(name, value)| Ok((name.clone(), toml(value)?))).collect()
            }
            Self::Pairs(pairs) => Ok(pairs),
        }
    }
}

/// Returns the schema of [`Texts`].
pub fn texts(doc: &str) -> Json {
    let pair = json!({ "type": "array", "items": { "type": "string" }, "minItems": 2, "maxItems": 2 });
    let pairs = json!({
        "type": "array",
        "items": pair,
        "description": "Pairs of a name and a value as a configuration has it.",
    });
    json!({ "anyOf": [{ "type": "object" }, pairs], "description": doc })
}

/// Returns a value as `--set` takes it.
pub fn toml(value: &Json) -> Result<String, Problem> {
    Ok(match value {
        Json::Null => {
            return Err(Problem::unfit("no setting is null", "DELETE reverts changes made at run time"));
        }
        Json::Bool(value) => value.to_string(),
        Json::Number(number) => number.to_string(),
        Json::String(text) => quoted(text),
        Json::Array(items) => {
            let items = items.iter().map(toml).collect::<Result<Vec<_>, _>>()?;
            format!("[{}]", items.join(", "))
        }
        Json::Object(entries) => {
            let entries =
                entries.iter().map(|(name, value)| Ok(format!("{} = {}", quoted(name), toml(value)?)));
            format!("{{ {} }}", entries.collect::<Result<Vec<_>, Problem>>()?.join(", "))
        }
    })
}

/// Quotes a text, which is then also valid as a key.
pub fn quoted(text: &str) -> String {
    // JSON escapes as TOML does, but for this one.
    Json::from(text).to_string().replace('\u{7f}', "\\u007F")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use proptest::prelude::*;
    use slate_runtime::configuration::{Configuration, Options};

    use super::*;

    proptest! {
        /// Property: any text survives the setting that it is written to.
        #[test]
        fn text_comes_through_a_setting_as_it_is(text in "\\PC{0,20}|.{0,20}") {
            let options = Options {
                sets: vec![format!("world.name={}", toml(&Json::from(text.as_str())).unwrap())],
                extra_tables: vec!["world".into()],
                ..Options::default()
            };
            let configuration = Configuration::from_text("a.toml", "", &options).unwrap();
            let found = configuration.value("world.name").and_then(|value| value.as_str());
            prop_assert_eq!(found, Some(text.as_str()));
        }
    }
}
