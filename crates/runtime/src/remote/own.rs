//! URLs that name the agent as it is reached.

use super::protocol::Call;

/// Makes paths of the URLs that name the agent by the name under which it is reached, such as `slate://exp1-2/loop/state` of
/// the second `exp1`, which calls itself by the name of the first.
pub(super) fn make_own(call: &mut Call, name: &str) {
    let own = |url: &mut String| {
        let rest = url.strip_prefix("slate://").and_then(|rest| rest.strip_prefix(name));
        let path = match rest {
            // All of it, as for another agent.
            Some("") => "/**".to_owned(),
            Some(path) if path.starts_with('/') => path.to_owned(),
            _ => return,
        };
        *url = path;
    };
    match call {
        Call::PropertyList { pattern } => pattern.iter_mut().for_each(own),
        Call::Read { url } | Call::ReadHistory { url } | Call::PropertySet { url, .. } => own(url),
        Call::Watch { of, .. } => of.iter_mut().for_each(|watched| own(&mut watched.url)),
        Call::Measure { urls, .. } => urls.iter_mut().for_each(own),
        Call::Link { to, from, .. } => [to, from].into_iter().for_each(own),
        Call::Unlink { to, .. } => own(to),
        _ => {}
    }
}
