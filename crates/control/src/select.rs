//! Parts of a value: by JSON Pointer (RFC 6901), and by JSONPath (RFC 9535, without its filters and functions).

use serde_json::Value as Json;

use crate::problem::Problem;

/// Which parts of a value are meant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Selection {
    /// All of it.
    Whole,
    /// The one that a pointer leads to.
    Pointer(String),
    /// All that a path leads to.
    Path(Vec<Segment>),
}

/// A step of a path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Whether it is looked for at any depth.
    deep: bool,
    selectors: Vec<Selector>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Selector {
    Name(String),
    Any,
    Index(i64),
    Slice { start: Option<i64>, end: Option<i64>, step: i64 },
}

/// The longest path, bytes; and the most values that one gives.
const LONGEST: usize = 1024;
const MOST: usize = 100_000;

impl Selection {
    /// What `pointer` and `select` of a query say.
    pub fn parse(pointer: Option<&str>, path: Option<&str>) -> Result<Self, Problem> {
        match (pointer, path) {
            (None, None) => Ok(Self::Whole),
            (Some(_), Some(_)) => {
                Err(Problem::bad("there are both `pointer` and `select`", "give one of the two"))
            }
            (Some(""), None) => Ok(Self::Whole),
            (Some(pointer), None) if pointer.starts_with('/') => Ok(Self::Pointer(pointer.into())),
            (Some(pointer), None) => {
                let help = "a JSON Pointer begins with a slash, such as /ranges/0";
                Err(Problem::bad(format!("`{pointer}` is no JSON Pointer"), help))
            }
            (None, Some(path)) => parse(path).map(Self::Path).map_err(|reason| {
                let help =
                    "a JSONPath is such as $.ranges[0:10] or $..x; filters and functions are not known";
                Problem::bad(format!("`{path}` is no JSONPath: {reason}"), help)
            }),
        }
    }

    /// The parts of a value; a path gives a list.
    pub fn of(&self, value: &Json) -> Result<Json, Problem> {
        match self {
            Self::Whole => Ok(value.clone()),
            Self::Pointer(pointer) => value.pointer(pointer).cloned().ok_or_else(|| {
                Problem::not_found(
                    format!("the value has nothing at `{pointer}`"),
                    "GET it without `pointer`",
                )
            }),
            Self::Path(segments) => {
                let mut found = vec![value];
                for segment in segments {
                    found = segment.of(&found);
                    if found.len() > MOST {
                        let message = format!("the path leads to more than {MOST} values");
                        return Err(Problem::unfit(message, "select less"));
                    }
                }
                Ok(found.into_iter().cloned().collect())
            }
        }
    }
}

impl Segment {
    fn of<'v>(&self, values: &[&'v Json]) -> Vec<&'v Json> {
        let mut found = Vec::new();
        for value in values {
            self.visit(value, &mut found);
        }
        found
    }

    fn visit<'v>(&self, value: &'v Json, found: &mut Vec<&'v Json>) {
        if found.len() > MOST {
            return;
        }
        self.selectors.iter().for_each(|selector| selector.of(value, found));
        if self.deep {
            // A value is as deep as its interface, which was compiled.
            children(value).for_each(|child| self.visit(child, found));
        }
    }
}

fn children(value: &Json) -> Box<dyn Iterator<Item = &Json> + '_> {
    match value {
        Json::Array(items) => Box::new(items.iter()),
        Json::Object(entries) => Box::new(entries.values()),
        _ => Box::new(std::iter::empty()),
    }
}

impl Selector {
    fn of<'v>(&self, value: &'v Json, found: &mut Vec<&'v Json>) {
        match (self, value) {
            (Self::Any, value) => found.extend(children(value)),
            (Self::Name(name), Json::Object(entries)) => found.extend(entries.get(name)),
            (Self::Index(index), Json::Array(items)) => {
                let from_end = || index.checked_add(items.len() as i64);
                let index = if *index < 0 { from_end() } else { Some(*index) };
                found.extend(index.and_then(|index| items.get(usize::try_from(index).ok()?)));
            }
            (Self::Slice { start, end, step }, Json::Array(items)) => {
                slice(items, *start, *end, *step, found);
            }
            _ => {}
        }
    }
}

/// As the RFC has it.
fn slice<'v>(items: &'v [Json], start: Option<i64>, end: Option<i64>, step: i64, found: &mut Vec<&'v Json>) {
    let length = items.len() as i64;
    let normal = |index: i64| if index >= 0 { index } else { index.saturating_add(length) };
    let step_size = step.unsigned_abs() as usize;
    match step {
        0 => {}
        1.. => {
            let lower = start.map_or(0, normal).clamp(0, length);
            let upper = end.map_or(length, normal).clamp(0, length);
            if lower < upper {
                found.extend(items[lower as usize..upper as usize].iter().step_by(step_size));
            }
        }
        _ => {
            let upper = start.map_or(length - 1, normal).clamp(-1, length - 1);
            let lower = end.map_or(-1, normal).clamp(-1, length - 1);
            if lower < upper {
                found.extend(items[(lower + 1) as usize..=upper as usize].iter().rev().step_by(step_size));
            }
        }
    }
}

fn parse(text: &str) -> Result<Vec<Segment>, String> {
    if text.len() > LONGEST {
        return Err(format!("it is longer than {LONGEST} bytes"));
    }
    let rest = text.strip_prefix('$').ok_or("it does not begin with $")?;
    let mut reader = Reader { rest };
    let mut segments = Vec::new();
    while !reader.rest.is_empty() {
        segments.push(reader.segment()?);
    }
    Ok(segments)
}

struct Reader<'t> {
    rest: &'t str,
}

impl Reader<'_> {
    fn takes(&mut self, prefix: &str) -> bool {
        let rest = self.rest.strip_prefix(prefix);
        self.rest = rest.unwrap_or(self.rest);
        rest.is_some()
    }

    /// Says what stands at this place in no path.
    fn expected(&self, what: &str) -> String {
        match self.rest {
            "" => format!("{what} is expected at its end"),
            rest => format!("{what} is expected at `{rest}`"),
        }
    }

    fn blanks(&mut self) {
        self.rest = self.rest.trim_start_matches([' ', '\t', '\n', '\r']);
    }

    fn segment(&mut self) -> Result<Segment, String> {
        let deep = self.takes("..");
        if !deep && !self.takes(".") {
            return match self.takes("[") {
                true => Ok(Segment { deep: false, selectors: self.selectors()? }),
                false => Err(self.expected("`.` or `[`")),
            };
        }
        if deep && self.takes("[") {
            return Ok(Segment { deep, selectors: self.selectors()? });
        }
        let selector = if self.takes("*") { Selector::Any } else { Selector::Name(self.name()?) };
        Ok(Segment { deep, selectors: vec![selector] })
    }

    fn name(&mut self) -> Result<String, String> {
        let is_name = |c: char| c.is_ascii_alphanumeric() || c == '_' || !c.is_ascii();
        let end = self.rest.find(|c| !is_name(c)).unwrap_or(self.rest.len());
        let (name, rest) = self.rest.split_at(end);
        if name.is_empty() || name.starts_with(|c: char| c.is_ascii_digit()) {
            return Err(self.expected("a name"));
        }
        self.rest = rest;
        Ok(name.into())
    }

    fn selectors(&mut self) -> Result<Vec<Selector>, String> {
        let mut selectors = Vec::new();
        loop {
            self.blanks();
            selectors.push(self.selector()?);
            self.blanks();
            if self.takes("]") {
                return Ok(selectors);
            }
            if !self.takes(",") {
                return Err(self.expected("`]` or `,`"));
            }
        }
    }

    fn selector(&mut self) -> Result<Selector, String> {
        if self.takes("*") {
            return Ok(Selector::Any);
        }
        for quote in ['\'', '"'] {
            if self.takes(quote.encode_utf8(&mut [0; 4])) {
                return self.quoted(quote).map(Selector::Name);
            }
        }
        let start = self.number()?;
        self.blanks();
        if !self.takes(":") {
            return start.map(Selector::Index).ok_or_else(|| self.expected("a name or an index"));
        }
        self.blanks();
        let end = self.number()?;
        self.blanks();
        let step = if self.takes(":") {
            self.blanks();
            self.number()?
        } else {
            None
        };
        Ok(Selector::Slice { start, end, step: step.unwrap_or(1) })
    }

    fn number(&mut self) -> Result<Option<i64>, String> {
        let end = self.rest.find(|c: char| !c.is_ascii_digit() && c != '-').unwrap_or(self.rest.len());
        let (number, rest) = self.rest.split_at(end);
        if number.is_empty() {
            return Ok(None);
        }
        let digits = number.strip_prefix('-').unwrap_or(number);
        if (digits.starts_with('0') && number != "0") || digits.is_empty() {
            return Err(format!("`{number}` is no index"));
        }
        // What JavaScript counts exactly, says the RFC.
        let limit = 1 << 53;
        let parsed = number.parse::<i64>().ok().filter(|parsed| (1 - limit..limit).contains(parsed));
        self.rest = rest;
        parsed.map(Some).ok_or(format!("`{number}` is no index"))
    }

    fn quoted(&mut self, quote: char) -> Result<String, String> {
        let mut text = String::new();
        let mut letters = self.rest.char_indices();
        while let Some((at, letter)) = letters.next() {
            match letter {
                _ if letter == quote => {
                    self.rest = &self.rest[at + letter.len_utf8()..];
                    return Ok(text);
                }
                '\\' => match letters.next() {
                    Some((_, escaped)) if escaped == quote || escaped == '\\' || escaped == '/' => {
                        text.push(escaped)
                    }
                    _ => return Err("of escapes, only those of quotes and backslashes are known".into()),
                },
                _ => text.push(letter),
            }
        }
        Err("a text has no end".into())
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
    }

    #[test]
    fn what_is_no_path_is_refused_in_words() {
        for path in [
            "",
            "x",
            "$x",
            "$.",
            "$.1a",
            "$[",
            "$[1",
            "$['a",
            "$[?(@.x)]",
            "$[01]",
            "$[-0]",
            "$[9007199254740992]",
        ] {
            assert!(Selection::parse(None, Some(path)).is_err(), "{path}");
        }
    }

    proptest! {
        /// Whatever comes, it is read or refused, and what is read gives a list.
        #[test]
        fn any_path_is_read_or_refused(path in "\\$[$.\\[\\]'\"a-c0-9:,*? -]{0,20}") {
            if let Ok(selection) = Selection::parse(None, Some(&path)) {
                let found = selection.of(&json!({ "a": [1, [2], { "b": 3 }], "c": "x" })).unwrap();
                prop_assert!(found.is_array());
            }
        }

        /// A slice is what counting gives.
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
