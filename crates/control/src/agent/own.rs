//! URLs that name the agent by its address.

/// Returns the path of a URL that names the agent by its address.
/// Such as `slate://exp1-2/loop/state` of the second `exp1`, which calls itself by the name of the first; any other URL
/// unchanged.
pub(crate) fn own_url(url: &str, name: &str) -> String {
    match url.strip_prefix("slate://").and_then(|rest| rest.strip_prefix(name)) {
        // All of it, as for another agent.
        Some("") => "/**".to_owned(),
        Some(path) if path.starts_with('/') => path.to_owned(),
        _ => url.to_owned(),
    }
}
