//! JSON as settings are written, and as the blackboard has it.

use serde_json::Value as Json;

use crate::problem::Problem;

/// A value as `--set` takes it.
pub(crate) fn toml(value: &Json) -> Result<String, Problem> {
    Ok(match value {
        Json::Null => {
            return Err(Problem::unfit("no setting is null", "DELETE takes back what was set at run time"));
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

/// Text between quotation marks, which is also a key.
pub(crate) fn quoted(text: &str) -> String {
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
        /// Whatever the text, the setting that is written has it.
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
