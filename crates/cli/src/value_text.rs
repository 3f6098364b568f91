//! Values of properties as text.

use serde_json::Value;

/// Appends a row of path and text for each number and text in a value.
pub fn flatten(path: String, value: &Value, rows: &mut Vec<[String; 2]>) {
    let below = |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}/{name}") };
    match value {
        Value::Object(fields) if !fields.is_empty() => {
            fields.iter().for_each(|(name, value)| flatten(below(name), value, rows));
        }
        Value::Array(items) if items.iter().any(|item| item.is_object() || item.is_array()) => {
            let items = items.iter().enumerate();
            items.for_each(|(index, value)| flatten(below(&index.to_string()), value, rows));
        }
        Value::String(text) => rows.push([path, text.clone()]),
        other => rows.push([path, other.to_string()]),
    }
}

/// Maximum number of numbers and texts in a line.
const MAX_LINE_VALUES: usize = 24;

/// Formats a value in a line, such as `x=0.3 y=1.2`.
pub fn in_a_line(value: &Value) -> String {
    let mut rows = Vec::new();
    flatten(String::new(), value, &mut rows);
    // Padding of interfaces.
    rows.retain(|[name, _]| name != "reserved" && !name.ends_with("/reserved"));
    let left = rows.len().saturating_sub(MAX_LINE_VALUES);
    let mut cells: Vec<String> = rows
        .into_iter()
        .take(MAX_LINE_VALUES)
        .map(|[name, cell]| {
            let cell = match cell.char_indices().nth(200) {
                Some((end, _)) => format!("{}…", &cell[..end]),
                None => cell,
            };
            if name.is_empty() { cell } else { format!("{name}={cell}") }
        })
        .collect();
    if left > 0 {
        cells.push(format!("… and {left} more"));
    }
    cells.join(" ")
}
