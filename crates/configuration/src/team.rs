//! The names of what a team shares.

/// The authority of URLs that mean all robots of the team: `slate://team/victims` is what is known about a topic.
pub const TEAM: &str = "team";

/// Whether a name may be that of a topic of the team's knowledge: at most 48 small letters, digits and `_`, in parts
/// that `/` separates.
pub fn is_topic(name: &str) -> bool {
    let letter = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    let is_part = |part: &str| !part.is_empty() && part.chars().all(letter);
    name.len() <= 48 && name.split('/').all(is_part)
}
