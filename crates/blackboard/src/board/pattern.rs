use std::fmt;

/// Pattern of paths: names separated by slashes.
/// `*` stands for any one name and `**` for any number of them, also none.
///
/// ```
/// use slate_blackboard::Pattern;
///
/// let timings = Pattern::parse("/**/timing")?;
/// assert!(timings.matches("planner/timing") && timings.matches("r2/planner/timing"));
/// assert!(!Pattern::parse("*/timing")?.matches("r2/planner/timing"));
/// # Ok::<(), slate_blackboard::PatternError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pattern {
    parts: Vec<PatternPart>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum PatternPart {
    Name(String),
    Any,
    Several,
}

/// Error of a text that is not a pattern.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{text}` is not a pattern of paths: between slashes stand names (letters, digits, _ and -), `*` or `**`"
)]
pub struct PatternError {
    /// The given text.
    pub text: String,
}

impl Pattern {
    /// Reads a pattern; a leading slash changes nothing.
    ///
    /// # Errors
    /// When a part is empty, or is neither a name nor one or two stars.
    pub fn parse(text: &str) -> Result<Self, PatternError> {
        let part = |part: &str| match part {
            "*" => Some(PatternPart::Any),
            "**" => Some(PatternPart::Several),
            name if crate::url::is_name(name) => Some(PatternPart::Name(name.into())),
            _ => None,
        };
        let parts: Option<_> = text.strip_prefix('/').unwrap_or(text).split('/').map(part).collect();
        parts.map(|parts| Self { parts }).ok_or_else(|| PatternError { text: text.into() })
    }

    /// Returns true if the pattern matches a path, which has no leading slash.
    pub fn matches(&self, path: &str) -> bool {
        let mut rest = Some(path);
        let mut part = 0;
        // The last `**`, and what is left of the path when that takes one name more. An earlier one never needs to
        // take more, as the last takes whatever is there.
        let mut several = None;
        loop {
            match (self.parts.get(part), rest.map(split)) {
                (Some(PatternPart::Several), _) => {
                    several = rest.map(|rest| (part, rest));
                    part += 1;
                    continue;
                }
                (Some(PatternPart::Any), Some((_, after))) => {
                    (rest, part) = (after, part + 1);
                    continue;
                }
                (Some(PatternPart::Name(name)), Some((first, after))) if name == first => {
                    (rest, part) = (after, part + 1);
                    continue;
                }
                (None, None) => return true,
                _ => {}
            }
            let Some((at, taken)) = several else { return false };
            rest = split(taken).1;
            part = at + 1;
            several = rest.map(|rest| (at, rest));
        }
    }
}

/// Returns the first name of a path, and those after it.
fn split(path: &str) -> (&str, Option<&str>) {
    path.split_once('/').map_or((path, None), |(first, after)| (first, Some(after)))
}

impl fmt::Display for Pattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, part) in self.parts.iter().enumerate() {
            let slash = if index == 0 { "" } else { "/" };
            let text = match part {
                PatternPart::Name(name) => name,
                PatternPart::Any => "*",
                PatternPart::Several => "**",
            };
            write!(f, "{slash}{text}")?;
        }
        Ok(())
    }
}
