//! Routes: the paths of operations, with variable parts in braces.
//! A variable part at the end takes the rest of a path, with its slashes.

use hyper::StatusCode;

use crate::problem::Problem;

/// Values of the variable parts of a path, by name.
pub type PathParts = Vec<(&'static str, String)>;

/// Name of the part that is the agent itself unless a caller gives it.
const AGENT_PART: &str = "agent";

/// Returns the name of a variable part; `None` for a fixed one.
fn name_of(part: &str) -> Option<&str> {
    part.strip_prefix('{')?.strip_suffix('}')
}

/// Returns the names of the variable parts of a route, in order.
pub(crate) fn part_names(route: &'static str) -> impl Iterator<Item = &'static str> {
    route.split('/').filter_map(name_of)
}

/// Returns the parts of a route, as a caller without a path names them.
/// The part `agent` is `agent` unless given.
///
/// # Errors
/// When a part is missing or empty, or the route has no part of a given name.
pub(crate) fn capture(
    route: &'static str,
    agent: &str,
    given: &[(&str, &str)],
) -> Result<PathParts, Problem> {
    let help = || match part_names(route).collect::<Vec<_>>() {
        names if names.is_empty() => "it has none".to_owned(),
        names => format!("its parts: {}", names.join(", ")),
    };
    if let Some((other, _)) = given.iter().find(|(name, _)| part_names(route).all(|own| own != *name)) {
        return Err(Problem::bad(format!("{route} has no part `{other}`"), help()));
    }
    let part = |name: &'static str| {
        let value = given_value(name, agent, given).filter(|value| !value.is_empty());
        let missing = || Problem::bad(format!("the part `{name}` of {route} is missing"), help());
        Ok((name, value.ok_or_else(missing)?.to_owned()))
    };
    part_names(route).map(part).collect()
}

/// Returns a route with these parts; a missing one keeps its name in braces.
pub(crate) fn filled(route: &'static str, agent: &str, given: &[(&str, &str)]) -> String {
    let part = |part| name_of(part).and_then(|name| given_value(name, agent, given)).unwrap_or(part);
    route.split('/').map(part).collect::<Vec<_>>().join("/")
}

fn given_value<'g>(name: &str, agent: &'g str, given: &[(&str, &'g str)]) -> Option<&'g str> {
    let value = given.iter().find(|(own, _)| *own == name).map(|(_, value)| *value);
    value.or((name == AGENT_PART).then_some(agent))
}

/// Returns the value of a variable part.
///
/// # Errors
/// When the route has no such part, which is a defect of the table of operations.
pub(crate) fn value_of<'p>(parts: &'p [(&'static str, String)], name: &str) -> Result<&'p str, Problem> {
    let found = parts.iter().find(|(own, _)| *own == name);
    found.map(|(_, value)| value.as_str()).ok_or_else(|| {
        let message = format!("the route of this operation has no part `{name}`");
        let help = "this is a defect of Slate's table of operations; report it";
        Problem::new(StatusCode::INTERNAL_SERVER_ERROR, message, help)
    })
}

/// Returns the parts of a route in a path; `None` for a path of another route.
pub(crate) fn fits(route: &'static str, parts: &[String]) -> Option<PathParts> {
    let names: Vec<&'static str> = route.split('/').skip(1).collect();
    let mut captured = Vec::new();
    for (place, name) in names.iter().enumerate() {
        let part = parts.get(place)?;
        match name_of(name) {
            Some(name) if place + 1 == names.len() => {
                // A path of a property may begin with a slash.
                let is_slash = parts[place].is_empty() && place + 1 < parts.len();
                let rest = &parts[place + usize::from(is_slash)..];
                captured.push((name, rest.join("/")));
                return rest.iter().all(|part| !part.is_empty()).then_some(captured);
            }
            Some(name) => captured.push((name, part.clone())),
            None if name == part => {}
            None => return None,
        }
    }
    (names.len() == parts.len()).then_some(captured)
}
