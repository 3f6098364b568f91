//! Names in the knowledge that a team shares.

/// Authority of URLs that address all robots of the team.
/// `slate://team/victims` is the team's knowledge about a topic.
pub const TEAM: &str = "team";

/// Returns true if a name can be that of a topic of the team's knowledge.
/// It has at most 48 lowercase letters, digits and `_`, in parts separated by `/`.
pub fn is_topic(name: &str) -> bool {
    let letter = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    let is_part = |part: &str| !part.is_empty() && part.chars().all(letter);
    name.len() <= 48 && name.split('/').all(is_part)
}
