//! Selection of the recorded properties and values.

use slate_blackboard::{Pattern, nearest_paths};
use slate_runtime::configuration::RecordSelection;
use slate_runtime::{PropertyFacts, PropertyIndex};

fn is_among(patterns: &[Pattern], path: &str) -> bool {
    patterns.iter().any(|pattern| pattern.matches(path))
}

/// Returns true if values of the property are recorded.
pub fn selects(selection: &RecordSelection, path: &str) -> bool {
    is_among(&selection.select, path) && !is_among(&selection.exclude, path)
}

/// Returns true if a rule leaves out values of the property.
pub fn thins(selection: &RecordSelection, path: &str) -> bool {
    let rule = selection.rules.iter().find(|rule| is_among(&rule.select, path));
    rule.is_some_and(|rule| rule.period > 0 || rule.on_change)
}

/// Returns true if each value of each property is recorded.
pub(super) fn is_whole(selection: &RecordSelection) -> bool {
    let all = |pattern: &Pattern| pattern.to_string() == "**";
    selection.exclude.is_empty() && selection.rules.is_empty() && selection.select.iter().any(all)
}

/// Patterns of a selection that match no property, such as mistyped ones.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnmatchedPattern {
    /// The setting, such as `record.select`.
    pub setting: &'static str,
    /// The pattern, with its slash.
    pub pattern: String,
    /// Suggestion.
    pub help: String,
}

/// Returns the patterns of a selection that match none of the properties.
pub fn unmatched_patterns(selection: &RecordSelection, index: &impl PropertyIndex) -> Vec<UnmatchedPattern> {
    let properties = index.properties();
    let paths = || properties.iter().map(|property| property.path());
    let chosen = selection.select.iter().map(|pattern| ("record.select", pattern));
    let ruled = selection.rules.iter().flat_map(|rule| &rule.select);
    let named = chosen.chain(ruled.map(|pattern| ("record.rules", pattern)));
    let unmatched = named.filter(|(_, pattern)| !paths().any(|path| pattern.matches(path)));
    let described = unmatched.map(|(setting, pattern)| {
        let near = nearest_paths(&pattern.to_string(), '/', paths());
        let near: Vec<_> = near.iter().map(|path| format!("/{path}")).collect();
        let help = match &near[..] {
            [] => "`slate list` shows the properties".into(),
            near => format!("the nearest are {}", near.join(", ")),
        };
        UnmatchedPattern { setting, pattern: format!("/{pattern}"), help }
    });
    described.collect()
}

impl std::fmt::Display for UnmatchedPattern {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { setting, pattern, .. } = self;
        write!(f, "no property fits {pattern} of {setting}, so nothing is recorded for it")
    }
}

/// Filter of the recorded values of one property.
#[derive(Debug, Default)]
pub(super) struct Filter {
    /// Minimum time from one recorded value to the next, nanoseconds.
    period: u64,
    /// Time at which the next value is due.
    due: u64,
    /// The last one, where only others are recorded.
    last: Option<Vec<u8>>,
    on_change: bool,
}

impl Filter {
    /// Returns the filter of the property at a path.
    /// `None` if none of its values is recorded.
    pub fn of(selection: &RecordSelection, path: &str) -> Option<Self> {
        let rule = || selection.rules.iter().find(|rule| is_among(&rule.select, path));
        selects(selection, path).then(|| match rule() {
            Some(rule) => Self { period: rule.period, on_change: rule.on_change, ..Self::default() },
            None => Self::default(),
        })
    }

    /// Returns true if a value is recorded.
    #[inline]
    pub fn takes(&mut self, time: u64, bytes: &[u8]) -> bool {
        if self.period == 0 && !self.on_change {
            return true;
        }
        if self.period > 0 && time < self.due {
            // Time went back, as when an agent continues from a snapshot.
            if self.due - time <= self.period {
                return false;
            }
            self.due = 0;
        }
        if self.on_change {
            if self.last.as_deref() == Some(bytes) {
                return false;
            }
            let last = self.last.get_or_insert_default();
            last.clear();
            last.extend_from_slice(bytes);
        }
        // On a grid, so that what comes at another rate is not recorded at a lower one than was requested.
        let next = self.due.saturating_add(self.period);
        self.due = if next > time { next } else { time.saturating_add(self.period) };
        true
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that fails panics")]
mod tests {
    use super::*;
    use slate_runtime::configuration::RecordRule;

    fn filter(period: u64, on_change: bool) -> Filter {
        let rule = RecordRule { select: vec![Pattern::parse("/a/*").unwrap()], period, on_change };
        let selection = RecordSelection { rules: vec![rule], ..RecordSelection::default() };
        Filter::of(&selection, "a/b").unwrap()
    }

    #[test]
    fn a_rate_is_kept_on_average_for_values_at_another_rate() {
        let mut slow = filter(33, false);
        let taken = (0..1000).filter(|value| slow.takes(value * 20, &[])).count();
        assert!((600..=607).contains(&taken), "{taken} of 1000 in 20000, one in 33");
    }

    #[test]
    fn unchanged_values_are_skipped_and_changes_taken_when_due() {
        let mut changes = filter(0, true);
        let taken: Vec<_> = [1, 1, 2, 2, 1].iter().map(|value| changes.takes(0, &[*value])).collect();
        assert_eq!(taken, [true, false, true, false, true]);
        let mut both = filter(10, true);
        let values = [(0, 1), (5, 2), (10, 2), (15, 2), (20, 2), (30, 3)];
        let taken: Vec<_> = values.iter().map(|(time, value)| both.takes(*time, &[*value])).collect();
        assert_eq!(taken, [true, false, true, false, false, true]);
    }

    #[test]
    fn time_that_goes_back_begins_anew() {
        let mut slow = filter(10, false);
        assert!(slow.takes(1000, &[]) && !slow.takes(1005, &[]) && slow.takes(3, &[]) && !slow.takes(4, &[]));
    }
}
