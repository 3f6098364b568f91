//! Names that are like one that is unknown.

/// Returns the name that is most like `name`, if one is near.
pub(super) fn nearest_name<'a>(name: &str, names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let farthest = name.len() / 3 + 1;
    // Names of other lengths are farther away by that alone, and a long one takes long to compare.
    let near = names.filter(|other| other.len().abs_diff(name.len()) <= farthest);
    let scored = near.map(|other| (edit_distance(name, other), other));
    scored.filter(|(distance, _)| *distance <= farthest).min().map(|(_, other)| other)
}

/// Returns the Levenshtein distance of two names, ignoring case.
fn edit_distance(name: &str, other: &str) -> usize {
    let mut distances: Vec<usize> = (0..=other.len()).collect();
    for (row, byte) in name.bytes().enumerate() {
        let mut diagonal = std::mem::replace(&mut distances[0], row + 1);
        for (column, other) in other.bytes().enumerate() {
            let replaced = diagonal + usize::from(!byte.eq_ignore_ascii_case(&other));
            diagonal = distances[column + 1];
            distances[column + 1] = replaced.min(diagonal + 1).min(distances[column] + 1);
        }
    }
    distances[other.len()]
}
