use std::borrow::Cow;
use std::path::Path;

/// Returns a path for display with its control characters escaped.
/// A terminal would obey them, such as the escape that begins a color.
///
/// ```
/// use std::path::Path;
///
/// assert_eq!(slate_configuration::printable(Path::new("maps/\u{1b}[31mred\n.toml")), "maps/\\u{1b}[31mred\\n.toml");
/// assert_eq!(slate_configuration::printable(Path::new("Küche/plan.toml")), "Küche/plan.toml");
/// ```
pub fn printable(path: &Path) -> String {
    printable_text(&path.to_string_lossy()).into_owned()
}

/// Returns a foreign text for display, escaped as by [`printable`].
/// An example is a name in a certificate.
///
/// ```
/// assert_eq!(slate_configuration::printable_text("arm\u{1b}[2J\nbase"), "arm\\u{1b}[2J\\nbase");
/// ```
pub fn printable_text(text: &str) -> Cow<'_, str> {
    if !text.contains(char::is_control) {
        return text.into();
    }
    let mut result = String::with_capacity(text.len() + 8);
    for character in text.chars() {
        if character.is_control() {
            result.extend(character.escape_default());
        } else {
            result.push(character);
        }
    }
    result.into()
}
