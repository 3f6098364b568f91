use slate_sorted::{SortedMap, SortedSet};

/// Returns a field's name in ROS's form.
/// It is lower case, with letters, digits and single underscores, a letter first.
pub(super) fn field_name(name: &str, taken: &mut SortedSet<String>) -> String {
    unique(words(name, "field").to_ascii_lowercase(), taken)
}

/// Returns a constant's name in ROS's form.
pub(super) fn constant_name(field: &str, name: &str, taken: &mut SortedSet<String>) -> String {
    unique(words(&format!("{field}_{name}"), "C").to_ascii_uppercase(), taken)
}

/// The names of a field's constants, by value.
pub(super) type Constants = SortedMap<i128, String>;

/// Returns the prefix of the names of a field's constants.
pub(super) fn constant_prefix(field: &str) -> String {
    format!("{}_", words(field, "C").to_ascii_uppercase())
}

/// Returns a message's name in ROS's form: letters and digits, a capital first.
pub(super) fn message_name(name: &str) -> String {
    let mut result = String::new();
    for word in words(name, "Message").split('_') {
        let mut letters = word.chars();
        result.extend(letters.next().map(|first| first.to_ascii_uppercase()));
        result.extend(letters);
    }
    result
}

/// Returns true if a field exists for the layout alone, by its name.
/// These are numbers `reserved`, `reserved2`, or `padding_12`.
pub(super) fn is_padding(name: &str) -> bool {
    let number = name.strip_prefix("reserved").or_else(|| name.strip_prefix("padding_"));
    number.is_some_and(|number| number.bytes().all(|letter| letter.is_ascii_digit()))
}

/// Joins the words of a name by single underscores.
/// `start` precedes a name that does not begin with a letter.
fn words(name: &str, start: &str) -> String {
    let words: Vec<_> =
        name.split(|c: char| !c.is_ascii_alphanumeric()).filter(|word| !word.is_empty()).collect();
    let joined = words.join("_");
    if joined.starts_with(|c: char| c.is_ascii_alphabetic()) {
        return joined;
    }
    if joined.is_empty() { start.into() } else { format!("{start}_{joined}") }
}

/// Returns a unique name; a taken one gets a number.
pub(super) fn unique(name: String, taken: &mut SortedSet<String>) -> String {
    let mut result = name.clone();
    let mut number = 2_usize;
    while !taken.insert(result.clone()) {
        result = format!("{name}{number}");
        number += 1;
    }
    result
}

/// The frame that all robots share.
pub(super) const MAP: &str = "map";

/// Returns the parts of a frame's full name from a module's own name of it.
/// The map is the same for all, and a name that contains its robot stays unchanged.
pub(super) fn own_frame<'a>(robot: &'a str, name: &'a str) -> [&'a str; 3] {
    let is_whole = robot.is_empty() || name == MAP || name.contains('/') || name.is_empty();
    if is_whole { ["", "", name] } else { [robot, "/", name] }
}
