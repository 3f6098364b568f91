//! Messages as ROS's own tools print them.

use serde_json::Value as Json;

/// Items of a list of numbers that are printed.
const MAX_NUMBERS: usize = 128;

/// Returns the lines of a message, with its fields below each other.
pub fn lines(message: &Json) -> Vec<String> {
    let mut lines = Vec::new();
    fields(message, "", &mut lines);
    lines
}

fn fields(message: &Json, indent: &str, lines: &mut Vec<String>) {
    let deeper = format!("{indent}  ");
    for (name, value) in message.as_object().into_iter().flatten() {
        match value {
            Json::Object(_) => {
                lines.push(format!("{indent}{name}:"));
                fields(value, &deeper, lines);
            }
            Json::Array(items) if items.iter().any(Json::is_object) => {
                lines.push(format!("{indent}{name}:"));
                for item in items {
                    let mut own = Vec::new();
                    fields(item, "", &mut own);
                    let heads = ["- "].into_iter().chain(std::iter::repeat("  "));
                    lines.extend(heads.zip(own).map(|(head, line)| format!("{indent}{head}{line}")));
                }
            }
            Json::Array(items) if items.len() > MAX_NUMBERS => {
                let shown: Vec<_> = items[..MAX_NUMBERS].iter().map(Json::to_string).collect();
                lines.push(format!("{indent}{name}: [{}, ...] # {} items", shown.join(", "), items.len()));
            }
            // Numbers that JSON does not have.
            Json::Null => lines.push(format!("{indent}{name}: .nan")),
            value => lines.push(format!("{indent}{name}: {value}")),
        }
    }
}
