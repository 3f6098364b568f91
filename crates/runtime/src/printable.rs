use std::path::Path;

/// A path for people to read: what a terminal would obey, such as the escape that begins a colour, is written out.
///
/// ```
/// use std::path::Path;
///
/// assert_eq!(slate_runtime::printable(Path::new("maps/\u{1b}[31mred\n.toml")), "maps/\\u{1b}[31mred\\n.toml");
/// assert_eq!(slate_runtime::printable(Path::new("Küche/plan.toml")), "Küche/plan.toml");
/// ```
pub fn printable(path: &Path) -> String {
    let mut text = String::new();
    for character in path.to_string_lossy().chars() {
        if character.is_control() {
            text.extend(character.escape_default());
        } else {
            text.push(character);
        }
    }
    text
}
