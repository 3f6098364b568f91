//! Tokens of a theory.

use super::written::TextRange;
use crate::error::GologError;

/// Signs, longer ones first.
const SIGNS: [&str; 23] = [
    "||", ">>", "==", "!=", "<=", ">=", "..", "{", "}", "(", ")", ",", ";", ":", "|", "<", ">", "=", "+",
    "-", "?", "&", "!",
];

#[derive(Clone, Debug, PartialEq)]
pub(super) enum GologToken {
    Integer(i32),
    Real(f64),
    Name(String),
    Sign(&'static str),
    End,
}

impl GologToken {
    pub fn title(&self) -> String {
        match self {
            Self::Integer(number) => format!("`{number}`"),
            Self::Real(number) => format!("`{number}`"),
            Self::Name(name) => format!("`{name}`"),
            Self::Sign(sign) => format!("`{sign}`"),
            Self::End => "the end of the file".into(),
        }
    }
}

/// Splits a text into tokens; the last one is [`GologToken::End`].
pub(super) fn tokens(text: &str) -> Result<Vec<(GologToken, TextRange)>, GologError> {
    let mut tokens = Vec::new();
    let mut at = 0;
    loop {
        let rest = &text[at..];
        let Some(first) = rest.chars().next() else {
            tokens.push((GologToken::End, TextRange { start: at, end: at }));
            return Ok(tokens);
        };
        if first.is_whitespace() {
            at += first.len_utf8();
            continue;
        }
        if first == '#' {
            at += rest.find('\n').unwrap_or(rest.len());
            continue;
        }
        let (token, length) = token(text, at, first)?;
        tokens.push((token, TextRange { start: at, end: at + length }));
        at += length;
    }
}

fn token(text: &str, at: usize, first: char) -> Result<(GologToken, usize), GologError> {
    let rest = &text[at..];
    let is_part = |sign: char| sign.is_alphanumeric() || sign == '_';
    if first.is_ascii_digit() {
        return number(text, at);
    }
    if first.is_alphabetic() || first == '_' {
        let length = rest.find(|sign: char| !is_part(sign)).unwrap_or(rest.len());
        return Ok((GologToken::Name(rest[..length].into()), length));
    }
    match SIGNS.into_iter().find(|sign| rest.starts_with(sign)) {
        Some(sign) => Ok((GologToken::Sign(sign), sign.len())),
        None => {
            let reason = format!("expected a name, a number or a sign, found `{first}`");
            Err(GologError::at(text, at, at + first.len_utf8(), reason))
        }
    }
}

fn number(text: &str, at: usize) -> Result<(GologToken, usize), GologError> {
    let rest = &text[at..];
    let digits = |from: usize| {
        rest[from..].find(|sign: char| !sign.is_ascii_digit()).map_or(rest.len(), |length| from + length)
    };
    let whole = digits(0);
    let is_real = rest[whole..].starts_with('.') && !rest[whole..].starts_with("..");
    let end = if is_real { digits(whole + 1) } else { whole };
    let is_closed = !rest[end..].starts_with(|sign: char| sign.is_alphanumeric() || sign == '_');
    let token = match is_real {
        true => rest[..end].parse().ok().filter(|value: &f64| value.is_finite()).map(GologToken::Real),
        false => rest[..end].parse().ok().map(GologToken::Integer),
    };
    match token.filter(|_| is_closed) {
        Some(token) => Ok((token, end)),
        None => {
            let end = rest.find(|sign: char| !sign.is_alphanumeric() && sign != '.').unwrap_or(rest.len());
            let reason = format!("expected a number such as `12` or `1.5`, found `{}`", &rest[..end]);
            Err(GologError::at(text, at, at + end, reason))
        }
    }
}
