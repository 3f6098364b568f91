//! URLs and patterns of properties on the command line.

use slate::blackboard::is_within;
use slate::control::{Client, ClientError, PropertyEntry};
use slate::runtime::ErrorCode;
use slate_sorted::SortedSet;

use crate::failure::Failure;

/// Returns the prefix of listed properties' paths.
/// It is `/`, or `slate://AGENT/` if the pattern names an agent.
pub fn root(pattern: &str) -> String {
    match agent(pattern) {
        Some(agent) => format!("slate://{agent}/"),
        None => "/".into(),
    }
}

/// Returns the agent that a URL or pattern names, if any.
pub fn agent(pattern: &str) -> Option<&str> {
    pattern.strip_prefix("slate://")?.split('/').next()
}

/// Returns the path of a URL, without agent and outer slashes.
pub fn path(url: &str) -> &str {
    let path = match url.strip_prefix("slate://") {
        Some(rest) => rest.split_once('/').map_or("", |(_, path)| path),
        None => url,
    };
    path.trim_matches('/')
}

/// Returns the pattern for a path and all below it; a pattern stays unchanged.
pub fn subtree(path: &str) -> String {
    if path.contains('*') { path.to_owned() } else { format!("{}/**", path.trim_end_matches('/')) }
}

/// Returns the properties that match a pattern, or that are at or below a path.
///
/// # Errors
/// When none matches: the error names the present ones.
pub fn matching(client: &mut Client, pattern: &str) -> Result<Vec<PropertyEntry>, Failure> {
    match client.properties(Some(&subtree(pattern))) {
        Ok(found) if !found.is_empty() => return Ok(found),
        Ok(_) => {}
        Err(ClientError::Refused(refusal)) if refusal.code.as_deref() == Some(ErrorCode::Name.code()) => {}
        Err(error) => return Err(error.into()),
    }
    let whole = match agent(pattern) {
        Some(agent) => format!("slate://{agent}/**"),
        None => "/**".into(),
    };
    let paths: Vec<_> = client.properties(Some(&whole))?.into_iter().map(|own| own.path).collect();
    // The deepest path above that exists.
    let mut parts = path(pattern).split('/').peekable();
    let mut above = String::new();
    while let Some(part) = parts.peek() {
        let next = if above.is_empty() { (*part).to_owned() } else { format!("{above}/{part}") };
        if part.is_empty() || !paths.iter().any(|path| is_within(path, &next)) {
            break;
        }
        above = next;
        parts.next();
    }
    let inside = paths.iter().filter(|path| is_within(path, &above));
    let names = inside.filter_map(|path| path[above.len()..].trim_start_matches('/').split('/').next());
    let names: SortedSet<_> = names.filter(|name| !name.is_empty()).map(str::to_owned).collect();
    Err(Failure::NothingBelow {
        pattern: pattern.into(),
        above: format!("{}{above}", root(pattern)),
        missing: parts.next().unwrap_or_default().into(),
        names: names.into_iter().collect(),
    })
}

/// Returns the error of an unknown property.
/// It lists the properties whose paths end as the URL does.
pub fn unknown(client: &mut Client, url: &str, error: ClientError) -> Failure {
    let ClientError::Refused(mut refusal) = error else { return error.into() };
    if refusal.code.as_deref() == Some(ErrorCode::Name.code()) && !url.contains('*') {
        let listed = client.properties(Some("/**")).unwrap_or_default();
        // A field stands behind its property.
        let mut own = path(url);
        let mut near: Vec<String> = Vec::new();
        while near.is_empty() && !own.is_empty() {
            let end = format!("/{own}");
            let field = &path(url)[own.len()..];
            let ends = listed.iter().filter(|property| property.path.ends_with(&end));
            near = ends.map(|property| format!("/{}{field}", property.path)).collect();
            own = own.rsplit_once('/').map_or("", |(above, _)| above);
            if !own.contains('/') {
                break;
            }
        }
        if !near.is_empty() && near.len() <= 8 {
            refusal.help = format!("did you mean {}?", near.join(" or "));
        }
    }
    ClientError::Refused(refusal).into()
}

/// Replaces patterns by the properties that match them.
/// URLs without a wildcard stay unchanged.
pub fn expand(client: &mut Client, urls: &[String]) -> Result<Vec<String>, Failure> {
    let mut all = Vec::new();
    for url in urls {
        if !url.contains('*') {
            all.push(url.clone());
            continue;
        }
        let root = root(url);
        let found = client.properties(Some(url))?.into_iter();
        let found = found.filter(|property| property.access != "messages");
        all.extend(found.map(|property| format!("{root}{}", property.path)));
    }
    match all.is_empty() {
        true => Err(Failure::NothingLike { pattern: urls.join(" ") }),
        false => Ok(all),
    }
}
