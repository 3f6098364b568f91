//! Comparisons of numbers in the conditions of links and snapshots.

/// Comparison of two numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Comparison {
    /// `<`
    Less,
    /// `<=`
    AtMost,
    /// `>`
    Greater,
    /// `>=`
    AtLeast,
    /// `==`
    Equal,
    /// `!=`
    Unequal,
}

/// Signs of the comparisons.
/// Those of two characters come first, as they begin with others.
const SIGNS: [(&str, Comparison); 6] = [
    ("<=", Comparison::AtMost),
    (">=", Comparison::AtLeast),
    ("==", Comparison::Equal),
    ("!=", Comparison::Unequal),
    ("<", Comparison::Less),
    (">", Comparison::Greater),
];

impl Comparison {
    /// Splits a text such as `range < 0.5` at its sign; `None` without a sign.
    pub fn split(text: &str) -> Option<(&str, Self, &str)> {
        SIGNS.iter().find_map(|(sign, comparison)| {
            let (before, behind) = text.split_once(sign)?;
            Some((before.trim(), *comparison, behind.trim()))
        })
    }

    /// Returns true if the comparison holds.
    pub fn holds(self, one: f64, other: f64) -> bool {
        match self {
            Self::Less => one < other,
            Self::AtMost => one <= other,
            Self::Greater => one > other,
            Self::AtLeast => one >= other,
            Self::Equal => one == other,
            Self::Unequal => one != other,
        }
    }
}
