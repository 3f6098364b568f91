use std::path::PathBuf;

use slate_blackboard::Url;

use crate::comparison::Comparison;
use crate::source::Spanned;

/// Trigger of automatic snapshots: `[snapshot]` of the configuration.
#[derive(Clone, Debug)]
pub struct SnapshotTrigger {
    /// Time of a snapshot, at the end of the first cycle from then on, ns.
    pub at: Option<Spanned<u64>>,
    /// Condition of a snapshot, at the end of each cycle in which it becomes true.
    pub when: Option<Spanned<SnapshotCondition>>,
    /// File of the snapshot; relative to the file that names it.
    pub file: Spanned<PathBuf>,
}

/// Condition on a field that is a number or a truth value (1 or 0).
/// An example is `/r2/battery/charge < 0.2`.
#[derive(Clone, Debug, PartialEq)]
pub struct SnapshotCondition {
    /// The field.
    pub field: Url,
    /// Comparison.
    pub comparison: Comparison,
    /// Number to compare with, in the field's unit.
    pub number: f64,
}

impl SnapshotCondition {
    /// Parses `FIELD OPERATOR NUMBER`; `true` and `false` are numbers too.
    ///
    /// # Errors
    /// The error in the text.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (field, comparison, number) = Comparison::split(text).ok_or("it has none of < <= > >= == !=")?;
        let field = Url::parse(field).map_err(|error| error.to_string())?;
        let number = match number {
            "true" => 1.0,
            "false" => 0.0,
            number => number.parse().map_err(|_| format!("`{number}` is not a number"))?,
        };
        Ok(Self { field, comparison, number })
    }

    /// Returns true if the condition holds for a value of the field.
    pub fn holds(&self, value: f64) -> bool {
        self.comparison.holds(value, self.number)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test that fails panics")]
mod tests {
    use super::*;

    #[test]
    fn conditions_are_read_and_hold() {
        for (text, values) in [
            ("/r2/battery/charge < 0.2", [true, false, false]),
            ("r2/battery/charge<=0.2", [true, true, false]),
            ("slate://base/b/charge > 0.2", [false, false, true]),
            ("b/charge >= 0.2", [false, true, true]),
            ("b/charge == 0.2", [false, true, false]),
            ("b/charge != 0.2", [true, false, true]),
        ] {
            let condition = SnapshotCondition::parse(text).unwrap();
            assert_eq!([0.1, 0.2, 0.3].map(|value| condition.holds(value)), values, "{text}");
        }
        assert!(SnapshotCondition::parse("m/hit == true").unwrap().holds(1.0));
        for text in ["m/hit", "m/hit < much", "< 1", ""] {
            assert!(SnapshotCondition::parse(text).is_err(), "{text}");
        }
    }
}
