//! Valid names of fields and interfaces.

/// Keywords of Rust, with the reserved ones.
pub const KEYWORDS: [&str; 53] = [
    "Self", "abstract", "as", "async", "await", "become", "box", "break", "const", "continue", "crate", "do",
    "dyn", "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if", "impl", "in", "let", "loop",
    "macro", "match", "mod", "move", "mut", "override", "priv", "pub", "ref", "return", "self", "static",
    "struct", "super", "trait", "true", "try", "type", "typeof", "unsafe", "unsized", "use", "virtual",
    "where", "while", "yield", "_",
];

/// Returns the reason why a word is not a valid Rust name, if any.
pub fn identifier_error(word: &str) -> Option<String> {
    if word.starts_with(|first: char| first.is_numeric()) {
        Some(format!("`{word}` begins with a digit, and a name with a letter"))
    } else if KEYWORDS.contains(&word) {
        Some(format!("`{word}` is a keyword of Rust"))
    } else {
        None
    }
}
