//! Query strings and percent-encoding of paths.

use slate_sorted::SortedMap;

use crate::problem::Problem;

/// Names and values, decoded.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Query(SortedMap<String, String>);

impl Query {
    /// Reads a query string.
    pub fn parse(text: &str) -> Result<Self, Problem> {
        let mut entries = SortedMap::new();
        for pair in text.split('&').filter(|pair| !pair.is_empty()) {
            let (name, value) = pair.split_once('=').unwrap_or((pair, ""));
            let (name, value) = (decode(&name.replace('+', " "))?, decode(&value.replace('+', " "))?);
            if entries.contains_key(&name) {
                return Err(Problem::bad(format!("`{name}` is given twice"), "give it once"));
            }
            entries.insert(name, value);
        }
        Ok(Self(entries))
    }

    /// Reads a query leniently, such as that of a stop, which must not be refused.
    /// Text that can't be decoded stays unchanged, and the first value of a name counts.
    pub fn parse_leniently(text: &str) -> Self {
        let decoded = |text: &str| decode(&text.replace('+', " ")).unwrap_or_else(|_| text.to_owned());
        let mut entries = SortedMap::new();
        for pair in text.split('&').filter(|pair| !pair.is_empty()) {
            let (name, value) = pair.split_once('=').unwrap_or((pair, ""));
            entries.entry(decoded(name)).or_insert_with(|| decoded(value));
        }
        Self(entries)
    }

    /// Returns the value of a name.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.0.get(name).map(String::as_str)
    }

    /// Returns the names.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    /// Takes a value out, so that it is in no log.
    pub fn take(&mut self, name: &str) -> Option<String> {
        self.0.remove(name)
    }

    /// Returns whether a flag is set: `?name`, `?name=true` or `?name=1`.
    pub fn flag(&self, name: &str) -> Result<bool, Problem> {
        match self.get(name) {
            None | Some("false" | "0") => Ok(false),
            Some("" | "true" | "1") => Ok(true),
            Some(other) => Err(Problem::bad(
                format!("`{name}` is `{other}`"),
                format!("write {name}=true or {name}=false"),
            )),
        }
    }

    /// Returns a number within an interval.
    pub fn number(&self, name: &str, low: f64, high: f64) -> Result<Option<f64>, Problem> {
        let Some(text) = self.get(name) else { return Ok(None) };
        match text.parse::<f64>() {
            Ok(number) if (low..=high).contains(&number) => Ok(Some(number)),
            _ => Err(Problem::bad(
                format!("`{name}` is `{text}`"),
                format!("it is a number from {low} to {high}"),
            )),
        }
    }

    /// Returns a whole number up to a limit.
    pub fn count(&self, name: &str, most: u64) -> Result<Option<u64>, Problem> {
        let Some(text) = self.get(name) else { return Ok(None) };
        // A count has no sign.
        match text.parse::<u64>() {
            Ok(number) if number <= most && text.bytes().all(|byte| byte.is_ascii_digit()) => {
                Ok(Some(number))
            }
            _ => Err(Problem::bad(
                format!("`{name}` is `{text}`"),
                format!("it is a whole number from 0 to {most}"),
            )),
        }
    }
}

/// Decodes percent-encoded text.
/// Own, as it refuses a `%` without two hexadecimal digits, which the crate `percent-encoding` keeps as text.
pub fn decode(text: &str) -> Result<String, Problem> {
    let wrong = || {
        Problem::bad(format!("`{text}` can't be decoded"), "% is followed by two hexadecimal digits of UTF-8")
    };
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((first, after)) = rest.split_first() {
        if *first == b'%' {
            let digits = after.first_chunk::<2>().filter(|digits| digits.iter().all(u8::is_ascii_hexdigit));
            let digits = digits.and_then(|digits| std::str::from_utf8(digits).ok()).ok_or_else(wrong)?;
            bytes.push(u8::from_str_radix(digits, 16).map_err(|_| wrong())?);
            rest = &after[2..];
        } else {
            bytes.push(*first);
            rest = after;
        }
    }
    String::from_utf8(bytes).map_err(|_| wrong())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test that fails panics")]

    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Property: any text that is encoded byte by byte decodes to itself.
        #[test]
        fn encoding_round_trips(text in ".{0,40}") {
            let encoded: String = text.bytes().map(|byte| format!("%{byte:02X}")).collect();
            prop_assert_eq!(decode(&encoded).unwrap(), text.clone());
            let query = Query::parse(&format!("a={encoded}&b")).unwrap();
            prop_assert_eq!(query.get("a"), Some(text.as_str()));
            prop_assert_eq!(query.flag("b").unwrap(), true);
        }

        /// Property: no text makes it panic.
        #[test]
        fn any_text_is_read_or_refused(text in ".{0,60}") {
            let _ = Query::parse(&text);
            let _ = Query::parse_leniently(&text);
            let _ = decode(&text);
        }
    }
}
