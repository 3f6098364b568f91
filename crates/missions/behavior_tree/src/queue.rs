//! Values of `Loop` nodes, which are between `;`.

use crate::value::BoardValue;

/// Type of the values of a queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ItemKind {
    Integer,
    Number,
    Text,
    Truth,
}

impl ItemKind {
    /// Returns the values between `;`, or the expectation for an invalid one.
    pub fn items(self, text: &str) -> impl Iterator<Item = Result<BoardValue, String>> {
        let text = text.strip_suffix(';').unwrap_or(text);
        let parts = text.split(';').filter(move |_| !text.is_empty());
        parts.map(move |part| self.item(part))
    }

    fn item(self, part: &str) -> Result<BoardValue, String> {
        let value = match self {
            Self::Integer => part.parse::<i32>().ok().map(|number| BoardValue::Number(number.into())),
            Self::Number => match BoardValue::parse(part) {
                BoardValue::Text(_) => None,
                number => Some(number),
            },
            Self::Text => Some(BoardValue::Text(part.into())),
            Self::Truth => match part {
                "true" | "1" => Some(BoardValue::Number(1.0)),
                "false" | "0" => Some(BoardValue::Number(0.0)),
                _ => None,
            },
        };
        value.ok_or_else(|| {
            let expected = match self {
                Self::Integer => "an integer",
                Self::Truth => "true or false",
                Self::Number | Self::Text => "a number",
            };
            format!("expected {expected} between `;`, found `{part}`")
        })
    }
}
