//! Names of nodes and topics, as ROS 1 has them.

/// Returns the node of an agent; characters that ROS forbids become `_`.
pub fn node_of_agent(agent: &str) -> String {
    let name: String = agent.chars().map(|own| if own.is_ascii_alphanumeric() { own } else { '_' }).collect();
    if name.starts_with(|first: char| first.is_ascii_alphabetic()) { name } else { format!("agent_{name}") }
}

/// Checks the whole name of a topic or node, such as `/r2/scan`.
///
/// # Errors
/// ROS forbids it; the reason in words.
pub fn check_name(name: &str) -> Result<(), String> {
    let Some(parts) = name.strip_prefix('/') else { return Err("it does not begin with a slash".into()) };
    if !parts.starts_with(|first: char| first.is_ascii_alphabetic()) {
        return Err("it does not begin with a letter behind the slash".into());
    }
    if parts.split('/').any(str::is_empty) {
        return Err("a part of it is empty: single slashes separate parts, and none is at the end".into());
    }
    let is_wrong = |own: &char| !own.is_ascii_alphanumeric() && *own != '_' && *own != '/';
    match parts.chars().find(is_wrong) {
        Some(wrong) => Err(format!("it has {wrong:?}, and ROS allows letters, digits, `_` and `/`")),
        None => Ok(()),
    }
}

/// Returns the whole name of a topic or a service.
/// `scan` is beside the node, `~/scan` below it.
///
/// # Errors
/// ROS forbids it; the reason in words.
pub fn whole_name(node: &str, name: &str) -> Result<String, String> {
    let space = node.rsplit_once('/').map_or("", |(space, _)| space);
    let whole = match name.strip_prefix('~') {
        Some(private) => format!("{node}/{}", private.trim_start_matches('/')),
        None if name.starts_with('/') => name.to_owned(),
        None => format!("{space}/{name}"),
    };
    check_name(&whole)?;
    Ok(whole)
}
