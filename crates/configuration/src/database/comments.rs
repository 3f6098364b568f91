//! Comments whose setting is removed, and their new places.

use toml_edit::{DocumentMut, Item, Key};

/// Returns the comments of a key's item, a line each.
pub(super) fn of_entry(key: &Key, item: Item) -> String {
    let mut document = DocumentMut::new();
    document.insert_formatted(key, item);
    of_text(&document.to_string())
}

/// Returns the comments inside of an item and around it, a line each.
pub(super) fn of_item(item: &Item) -> String {
    of_entry(&Key::new("item"), item.clone())
}

/// Returns the comments inside of a value, a line each.
pub(super) fn of_value(value: &toml_edit::Value) -> String {
    let mut value = value.clone();
    value.decor_mut().clear();
    of_text(&value.to_string())
}

/// Returns the comments of a text of TOML, a line each.
pub(super) fn of_text(text: &str) -> String {
    let mut comments = String::new();
    let mut rest = text;
    while let Some(at) = rest.find(['#', '"', '\'']) {
        rest = &rest[at..];
        let end = if rest.starts_with('#') {
            let line = rest.lines().next().unwrap_or_default();
            comments += line.trim_end();
            comments.push('\n');
            line.len()
        } else {
            end_of_string(rest)
        };
        rest = &rest[end..];
    }
    comments
}

/// Returns the length of the string at the start of a text.
fn end_of_string(text: &str) -> usize {
    let quote = &text[..1];
    let several = quote.repeat(3);
    let delimiter = if text.starts_with(&several) { several.as_str() } else { quote };
    let mut escaped = false;
    for (i, c) in text.char_indices().skip(delimiter.len()) {
        if escaped {
            escaped = false;
        } else if c == '\\' && quote == "\"" {
            escaped = true;
        } else if text[i..].starts_with(delimiter) {
            // Up to two quotes may stand before the three that end a long string.
            let end = i + delimiter.len();
            let more = text[end..].chars().take_while(|c| quote.starts_with(*c)).count();
            return if delimiter.len() == 3 { end + more.min(2) } else { end };
        }
    }
    text.len()
}
