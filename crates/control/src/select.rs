//! Parts of a value: by JSON Pointer (RFC 6901) and by JSONPath (RFC 9535).
//!
//! `serde_json_path` parses and evaluates paths, but bounds neither: nested filters take exponential time to parse, and
//! `$[*,*][*,*]…` selects exponentially many values. [`Effort`] is this bound.

use serde_json::Value as Json;
use serde_json_path::JsonPath;

use crate::problem::Problem;

/// Parts of a value that a client selects.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Selection {
    /// Whole value.
    Whole,
    /// Single part that a pointer leads to.
    Pointer(String),
    /// Parts that a path selects.
    Path(Box<JsonPath>, Effort),
}

/// Maximum length of a path, bytes.
const MAX_LENGTH: usize = 1024;
/// Maximum nesting of brackets and parentheses in a path.
const MAX_DEPTH: usize = 5;
/// Maximum number of values that a path selects.
const MAX_VALUES: usize = 100_000;
/// Maximum number of values that the evaluation of a path visits.
const MAX_VISITS: f64 = 1e7;

impl Selection {
    /// Parses `pointer` and `select` of a query.
    pub fn parse(pointer: Option<&str>, path: Option<&str>) -> Result<Self, Problem> {
        match (pointer, path) {
            (None, None) => Ok(Self::Whole),
            (Some(_), Some(_)) => {
                Err(Problem::bad("expected only one of `pointer` and `select`", "give one of the two"))
            }
            (Some(""), None) => Ok(Self::Whole),
            (Some(pointer), None) if pointer.starts_with('/') => Ok(Self::Pointer(pointer.into())),
            (Some(pointer), None) => {
                let help = "a JSON Pointer begins with a slash, such as /ranges/0";
                Err(Problem::bad(format!("`{pointer}` is no JSON Pointer"), help))
            }
            (None, Some(path)) => parse(path).map_err(|reason| {
                let help = "a JSONPath is such as $.ranges[0:10], $..x or $.list[?@.range < 1]";
                Problem::bad(format!("`{path}` is no JSONPath: {reason}"), help)
            }),
        }
    }

    /// Returns the selected parts of a value; a path gives a list.
    pub fn of(&self, value: &Json) -> Result<Json, Problem> {
        match self {
            Self::Whole => Ok(value.clone()),
            Self::Pointer(pointer) => value.pointer(pointer).cloned().ok_or_else(|| {
                Problem::not_found(
                    format!("the value has nothing at `{pointer}`"),
                    "GET it without `pointer`",
                )
            }),
            Self::Path(path, effort) => {
                if effort.visits(value) > MAX_VISITS {
                    let message = "the path visits too many values";
                    return Err(Problem::unfit(message, "use fewer `..`, lists and filters"));
                }
                let found = path.query(value);
                if found.len() > MAX_VALUES {
                    let message = format!("the path leads to more than {MAX_VALUES} values");
                    return Err(Problem::unfit(message, "select less"));
                }
                Ok(found.into_iter().cloned().collect())
            }
        }
    }
}

fn parse(text: &str) -> Result<Selection, String> {
    if text.len() > MAX_LENGTH {
        return Err(format!("it is longer than {MAX_LENGTH} bytes"));
    }
    let effort = Effort::of(text)?;
    match JsonPath::parse(text) {
        Ok(path) => Ok(Selection::Path(Box::new(path), effort)),
        Err(error) => Err(error.to_string().replace("parser error", "unexpected input")),
    }
}

/// Upper bound of the work of a path, from its characters outside of quotes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Product of the number of selectors in each bracket.
    /// It bounds how often a value can be visited twice.
    repeats: u64,
    /// Number of descendant segments `..`.
    descents: u32,
    /// Number of filters that contain searches.
    searches: u32,
}

/// Bracket or parenthesis that is open.
struct OpenBracket {
    selectors: u64,
    is_filter: bool,
    searches: bool,
}

impl Effort {
    fn of(text: &str) -> Result<Self, String> {
        let mut effort = Self { repeats: 1, descents: 0, searches: 0 };
        let mut open: Vec<OpenBracket> = Vec::new();
        let mut characters = text.chars().peekable();
        while let Some(character) = characters.next() {
            match character {
                '\'' | '"' => {
                    while let Some(letter) = characters.next().filter(|letter| *letter != character) {
                        if letter == '\\' {
                            characters.next();
                        }
                    }
                }
                '[' | '(' => {
                    open.push(OpenBracket { selectors: 1, is_filter: false, searches: false });
                    if open.len() > MAX_DEPTH {
                        return Err(format!("it is nested deeper than {MAX_DEPTH} brackets"));
                    }
                }
                ']' | ')' => {
                    let closed = open.pop();
                    if let Some(OpenBracket { selectors, is_filter, searches }) = closed {
                        effort.repeats = effort.repeats.saturating_mul(selectors);
                        effort.searches += u32::from(is_filter && searches);
                    }
                }
                '*' | ':' | '?' | ',' | '.' => {
                    let descends = character == '.' && characters.next_if_eq(&'.').is_some();
                    effort.descents += u32::from(descends);
                    if character != '.' || descends {
                        open.iter_mut().for_each(|open| open.searches |= open.is_filter);
                    }
                    if let Some(last) = open.last_mut() {
                        last.selectors += u64::from(character == ',');
                        last.is_filter |= character == '?';
                    }
                }
                _ => {}
            }
        }
        Ok(effort)
    }

    /// Returns the maximum number of values visited in `value`.
    fn visits(self, value: &Json) -> f64 {
        let (mut nodes, mut depth) = (0.0, 0);
        count_nodes(value, 1, &mut nodes, &mut depth);
        let descents = (0..self.descents).fold(1.0, |product, _| product * f64::from(depth));
        // A filter that searches visits up to all values for each value that it tests.
        (0..self.searches).fold(nodes * self.repeats as f64 * descents, |product, _| product * nodes)
    }
}

/// Counts the values in a value, and its depth.
/// The depth is that of its interface, which the compiler has bounded.
fn count_nodes(value: &Json, level: u32, nodes: &mut f64, depth: &mut u32) {
    *nodes += 1.0;
    *depth = level.max(*depth);
    match value {
        Json::Array(items) => items.iter().for_each(|item| count_nodes(item, level + 1, nodes, depth)),
        Json::Object(entries) => {
            entries.values().for_each(|entry| count_nodes(entry, level + 1, nodes, depth))
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use proptest::prelude::*;
    use serde_json::json;

    use super::*;

    fn select(path: &str) -> Json {
        let value = json!({
            "ranges": [0, 1, 2, 3, 4, 5, 6],
            "pose": { "x": 1.5, "y": null, "a b": true },
            "poses": [{ "x": 1 }, { "x": 2 }],
        });
        Selection::parse(None, Some(path)).unwrap().of(&value).unwrap()
    }

    #[test]
    fn a_path_gives_what_the_rfc_says() {
        assert_eq!(select("$.ranges[0]"), json!([0]));
        assert_eq!(select("$.ranges[-1]"), json!([6]));
        assert_eq!(select("$.ranges[7]"), json!([]));
        assert_eq!(select("$.ranges[1:3]"), json!([1, 2]));
        assert_eq!(select("$.ranges[5:]"), json!([5, 6]));
        assert_eq!(select("$.ranges[1:5:2]"), json!([1, 3]));
        assert_eq!(select("$.ranges[5:1:-2]"), json!([5, 3]));
        assert_eq!(select("$.ranges[::-1]"), json!([6, 5, 4, 3, 2, 1, 0]));
        assert_eq!(select("$.ranges[::0]"), json!([]));
        assert_eq!(select("$['pose']['a b']"), json!([true]));
        assert_eq!(select("$.pose.y"), json!([null]));
        assert_eq!(select("$.poses[*].x"), json!([1, 2]));
        assert_eq!(select("$..x"), json!([1.5, 1, 2]));
        assert_eq!(select("$.ranges[0, 2]"), json!([0, 2]));
        assert_eq!(select("$.ranges[?@ > 4]"), json!([5, 6]));
        assert_eq!(select("$.poses[?@.x == 2].x"), json!([2]));
        assert_eq!(select("$[?length(@) > 3][0]"), json!([0]));
    }

    #[test]
    fn invalid_path_is_refused_in_words() {
        for path in [
            "",
            "x",
            "$x",
            "$.",
            "$.1a",
            "$[",
            "$[1",
            "$['a",
            "$[?@.x =~ 1]",
            "$[?unknown(@.x)]",
            "$[01]",
            "$[-0]",
            "$[9007199254740992]",
        ] {
            assert!(Selection::parse(None, Some(path)).is_err(), "{path}");
        }
    }

    #[test]
    fn a_path_that_takes_too_long_is_refused() {
        let value = json!({ "a": vec![vec![1; 100]; 100] });
        let nested = format!("${}{}", "[?@".repeat(200), "]".repeat(200));
        assert!(Selection::parse(None, Some(&nested)).is_err());
        for path in [
            "$.a".to_owned() + &"[*,*]".repeat(100),
            "$".to_owned() + &"..*".repeat(100),
            "$..[?$..[?$..a]]".to_owned(),
            "$.a[?@[?$..*]]".to_owned(),
        ] {
            assert!(Selection::parse(None, Some(&path)).unwrap().of(&value).is_err(), "{path}");
        }
        // Signs in quotes cost nothing.
        let quoted = format!("$['{}']", "[*,*]..".repeat(100));
        assert_eq!(Selection::parse(None, Some(&quoted)).unwrap().of(&value).unwrap(), json!([]));
    }

    proptest! {
        /// Property: any path is read or refused, and a read one selects a list.
        #[test]
        fn any_path_is_read_or_refused(path in "\\$[$.\\[\\]'\"a-c0-9:,*?@()!<&| -]{0,20}") {
            if let Ok(selection) = Selection::parse(None, Some(&path)) {
                let found = selection.of(&json!({ "a": [1, [2], { "b": 3 }], "c": "x" })).unwrap();
                prop_assert!(found.is_array());
            }
        }

        /// Property: a slice selects the same items as counting.
        #[test]
        fn a_slice_is_what_counting_gives(length in 0usize..8, start in -10i64..10, end in -10i64..10, step in 1i64..4) {
            let items: Vec<Json> = (0..length).map(Json::from).collect();
            let path = format!("$[{start}:{end}:{step}]").replace("-0", "0");
            let found = Selection::parse(None, Some(&path)).unwrap().of(&Json::Array(items)).unwrap();
            let place = |index: i64| if index < 0 { index + length as i64 } else { index };
            let (start, end) = (place(start).max(0), place(end).min(length as i64));
            let mut expected = Vec::new();
            let mut at = start;
            while at < end {
                expected.push(Json::from(at));
                at += step;
            }
            prop_assert_eq!(found, Json::Array(expected));
        }
    }
}
