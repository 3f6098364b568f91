//! Tokens of a script.

/// Signs of a script, longer ones first.
const SIGNS: [&str; 29] = [
    ":=", "+=", "-=", "*=", "/=", "==", "!=", "<=", ">=", "&&", "||", "..", "=", "+", "-", "*", "/", "<",
    ">", "!", "?", ":", ";", "(", ")", "&", "|", "^", "~",
];

#[derive(Clone, Debug, PartialEq)]
pub(super) enum ScriptToken {
    Number(f64),
    Text(String),
    Name(String),
    Sign(&'static str),
    End,
}

impl ScriptToken {
    pub fn title(&self) -> String {
        match self {
            Self::Number(number) => format!("`{number}`"),
            Self::Text(text) => format!("'{text}'"),
            Self::Name(name) => format!("`{name}`"),
            Self::Sign(sign) => format!("`{sign}`"),
            Self::End => "the end".into(),
        }
    }
}

/// Splits a script into tokens with their columns, from 1.
///
/// The last one is [`ScriptToken::End`]. An error has its column.
pub(super) fn tokens(text: &str) -> Result<Vec<(ScriptToken, usize)>, (usize, String)> {
    let mut tokens = Vec::new();
    let mut rest = text;
    loop {
        rest = rest.trim_start();
        let at = text.len() - rest.len();
        let column = text[..at].chars().count() + 1;
        let Some(first) = rest.chars().next() else {
            tokens.push((ScriptToken::End, column));
            return Ok(tokens);
        };
        let (token, length) = if first.is_ascii_digit() {
            number(rest).map_err(|reason| (column, reason))?
        } else if first == '\'' {
            let end = rest[1..].find('\'');
            let end = end.ok_or_else(|| (column, "expected a closing `'` of this text".to_owned()))?;
            (ScriptToken::Text(rest[1..=end].into()), end + 2)
        } else if first.is_alphabetic() || first == '_' || first == '@' {
            let end = rest[first.len_utf8()..].find(|sign: char| !sign.is_alphanumeric() && sign != '_');
            let length = end.map_or(rest.len(), |end| end + first.len_utf8());
            (ScriptToken::Name(rest[..length].into()), length)
        } else {
            let sign = SIGNS.into_iter().find(|sign| rest.starts_with(sign));
            let sign = sign.ok_or_else(|| (column, format!("expected an operator, found `{first}`")))?;
            (ScriptToken::Sign(sign), sign.len())
        };
        tokens.push((token, column));
        rest = &rest[length..];
    }
}

fn number(text: &str) -> Result<(ScriptToken, usize), String> {
    let bytes = text.as_bytes();
    if bytes[0] == b'0' && matches!(bytes.get(1), Some(b'x' | b'X')) {
        return hexadecimal(text);
    }
    let digits = |mut at: usize| {
        while bytes.get(at).is_some_and(u8::is_ascii_digit) {
            at += 1;
        }
        at
    };
    let mut end = digits(0);
    // `1..2` joins.
    if bytes.get(end) == Some(&b'.') && bytes.get(end + 1) != Some(&b'.') {
        end = digits(end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        end = digits(end + 1 + sign);
    }
    let is_dotted = text[end..].starts_with('.') && !text[end..].starts_with("..");
    let is_whole = !is_dotted && !text[end..].starts_with(|sign: char| sign.is_alphanumeric() || sign == '_');
    match text[..end].parse() {
        Ok(number) if is_whole && f64::is_finite(number) => Ok((ScriptToken::Number(number), end)),
        _ => {
            let end = text.find(|sign: char| !sign.is_alphanumeric() && sign != '.').unwrap_or(text.len());
            Err(format!("expected a number such as `1.5`, found `{}`", &text[..end]))
        }
    }
}

fn hexadecimal(text: &str) -> Result<(ScriptToken, usize), String> {
    let end = text.find(|sign: char| !sign.is_alphanumeric() && sign != '_').unwrap_or(text.len());
    // Eight digits are exact as a number.
    match u32::from_str_radix(&text[2..end], 16) {
        Ok(number) => Ok((ScriptToken::Number(number.into()), end)),
        Err(_) => {
            Err(format!("expected a number such as `0x1f` of at most 8 digits, found `{}`", &text[..end]))
        }
    }
}
