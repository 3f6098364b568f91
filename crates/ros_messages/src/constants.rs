//! Names of the constants of Slate's own messages.

use slate_sorted::SortedMap;

use super::names::{Constants, constant_prefix};
use super::schema::{Item, Schema};
use super::value::{Map, Value};

/// Returns the constants of each message of a definition, by field.
/// The definition is one that [`definition`](super::definition()) has made.
pub(super) fn constants(text: &str) -> Vec<SortedMap<String, Constants>> {
    let mut messages = vec![SortedMap::new()];
    // Those of the next field, each with its name.
    let mut own: Vec<(i128, &str)> = Vec::new();
    for line in text.lines() {
        if line.starts_with("MSG:") {
            messages.push(SortedMap::new());
        }
        if line.starts_with(['#', '=']) || line.starts_with("MSG:") {
            continue;
        }
        let Some((_, rest)) = line.split_once(' ') else { continue };
        if let Some((name, value)) = rest.split_once('=') {
            own.extend(value.parse().ok().map(|value| (value, name)));
            continue;
        }
        let prefix = constant_prefix(rest);
        let named =
            own.drain(..).filter_map(|(value, name)| Some((value, name.strip_prefix(&prefix)?.to_owned())));
        let named: Constants = named.collect();
        if let (Some(message), false) = (messages.last_mut(), named.is_empty()) {
            message.insert(rest.to_owned(), named);
        }
    }
    messages
}

impl Schema {
    /// Replaces numbers of enumerations by the names of their constants.
    pub fn name_constants(&self, value: &mut Value) {
        if let Value::Map(map) = value {
            self.name_in(0, map);
        }
    }

    fn name_in(&self, index: usize, map: &mut Map) {
        let Some(record) = self.records().get(index) else { return };
        for (name, value) in map.iter_mut() {
            let Some(index) = record.names.iter().position(|own| own == name) else { continue };
            match (record.types[index].item, record.constants.get(name)) {
                (Item::Record(inner), _) => match value {
                    Value::Map(map) => self.name_in(inner, map),
                    Value::List(items) => items.iter_mut().for_each(|item| {
                        if let Value::Map(map) = item {
                            self.name_in(inner, map);
                        }
                    }),
                    _ => {}
                },
                (Item::Primitive(_), Some(constants)) => rename(constants, value),
                _ => {}
            }
        }
    }
}

/// Replaces a number, or the numbers of a list, by their names where they have one.
fn rename(constants: &Constants, value: &mut Value) {
    let number = match value {
        Value::Unsigned(number) => i128::from(*number),
        Value::Signed(number) => i128::from(*number),
        Value::Numbers(numbers) => {
            let mut items: Vec<_> = numbers.iter().collect();
            items.iter_mut().for_each(|item| rename(constants, item));
            *value = Value::List(items);
            return;
        }
        _ => return,
    };
    if let Some(name) = constants.get(&number) {
        *value = Value::Text(name.as_str().into());
    }
}
