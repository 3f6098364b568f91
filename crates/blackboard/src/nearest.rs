//! Suggestions for unknown names.

mod renamed;

use std::collections::BTreeSet;

use renamed::renamed;

/// Maximum number of suggestions.
const MAX_SUGGESTIONS: usize = 3;

/// Maximum number of names in a path of an agent.
const MAX_PATH_DEPTH: usize = 16;

/// Returns the names most similar to `name`, at most three, best first.
/// The new name of a renamed parameter or port is the only one.
pub fn nearest_names<'a>(name: &str, names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let names: Vec<_> = names.collect();
    if let Some(present) = renamed(name, &names) {
        return vec![present];
    }
    let (farthest, length) = (name.len() / 3 + 1, name.chars().count());
    // Names of other lengths are farther away by that alone, and to compare takes long.
    let near = names.into_iter().filter(|other| other.chars().count().abs_diff(length) <= farthest);
    let mut scored: Vec<_> = near
        .map(|other| (strsim::damerau_levenshtein(name, other), other))
        .filter(|(distance, _)| *distance <= farthest)
        .collect();
    scored.sort();
    scored.into_iter().take(MAX_SUGGESTIONS).map(|(_, name)| name.into()).collect()
}

/// Returns the paths most similar to `path`, at most three, best first.
/// If the beginning of `path` is equal or more similar to that of other paths, it returns some of those.
///
/// ```
/// use slate_blackboard::nearest_paths;
///
/// let paths = ["referee/state", "referee/verdict", "simulator/state"];
/// let near = |path| nearest_paths(path, '/', paths.into_iter());
/// assert_eq!(near("referee/stat"), ["referee/state"]);
/// assert_eq!(near("refere"), ["referee/state", "referee/verdict"]);
/// assert_eq!(near("simulator/states/condition"), ["simulator/state"]);
/// ```
pub fn nearest_paths<'a>(
    path: &str,
    separator: char,
    paths: impl Iterator<Item = &'a str> + Clone,
) -> Vec<String> {
    // Of a path that is longer than any, the beginnings alone.
    let ends: Vec<_> =
        path.match_indices(separator).map(|(end, _)| end).chain([path.len()]).take(MAX_PATH_DEPTH).collect();
    for (index, end) in ends.into_iter().enumerate().rev() {
        let (begin, count) = (&path[..end], index + 1);
        let mut like: BTreeSet<_> =
            paths.clone().filter_map(|other| beginning(other, separator, count)).collect();
        if end == path.len() {
            like.extend(paths.clone());
        }
        let near = nearest_names(begin, like.into_iter());
        let is_whole = |name: &String| paths.clone().any(|other| other == name);
        if end == path.len() && near.first().is_some_and(is_whole) {
            return near.into_iter().filter(is_whole).collect();
        }
        let below = |nearest: &String| {
            let nearest = nearest.clone();
            paths.clone().filter(move |other| beginning(other, separator, count) == Some(&nearest))
        };
        if !near.is_empty() {
            return near.iter().flat_map(below).take(MAX_SUGGESTIONS).map(Into::into).collect();
        }
    }
    Vec::new()
}

/// Returns the first `count` names of a path that has as many.
fn beginning(path: &str, separator: char, count: usize) -> Option<&str> {
    match path.match_indices(separator).nth(count - 1) {
        Some((end, _)) => Some(&path[..end]),
        None => (path.split(separator).count() == count).then_some(path),
    }
}
