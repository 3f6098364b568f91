//! Quoted scalars of YAML.

use std::fmt::Write as _;

/// Returns a text as a scalar, in double quotes if it is not a plain word.
pub(crate) fn quoted(text: &str) -> String {
    let is_plain = |sign: char| sign.is_ascii_alphanumeric() || matches!(sign, '.' | '_' | '/' | '-');
    if !text.is_empty() && !text.starts_with('-') && text.chars().all(is_plain) {
        return text.to_owned();
    }
    let mut scalar = String::from('"');
    for sign in text.chars() {
        match sign {
            '"' | '\\' => scalar.extend(['\\', sign]),
            // Writing to a text does not fail.
            _ if sign.is_control() => _ = write!(scalar, "\\x{:02x}", u32::from(sign)),
            _ => scalar.push(sign),
        }
    }
    scalar.push('"');
    scalar
}

/// Returns the length of the quoted scalar that a text starts with.
/// Bytes, with its quotes.
pub(crate) fn quoted_length(text: &str) -> Option<usize> {
    let quote = text.chars().next().filter(|sign| matches!(sign, '"' | '\''))?;
    let mut signs = text.char_indices().skip(1).peekable();
    while let Some((at, sign)) = signs.next() {
        if sign == '\\' && quote == '"' {
            signs.next();
        } else if sign == quote {
            let is_doubled = quote == '\'' && signs.next_if(|(_, next)| *next == quote).is_some();
            if !is_doubled {
                return Some(at + 1);
            }
        }
    }
    None
}

/// Returns the text of a scalar, quoted or plain.
/// `None` if its quotes do not match.
pub(crate) fn unquoted(scalar: &str) -> Option<String> {
    let Some(quote) = scalar.chars().next().filter(|sign| matches!(sign, '"' | '\'')) else {
        return Some(scalar.to_owned());
    };
    if quoted_length(scalar)? != scalar.len() {
        return None;
    }
    let inner = &scalar[1..scalar.len() - 1];
    if quote == '\'' {
        return Some(inner.replace("''", "'"));
    }
    let (mut text, mut signs) = (String::new(), inner.chars());
    while let Some(sign) = signs.next() {
        match sign {
            '\\' => text.push(escaped(&mut signs)?),
            _ => text.push(sign),
        }
    }
    Some(text)
}

/// Returns the character of an escape, after its backslash.
/// `None` for an escape that names of files do not need.
fn escaped(signs: &mut std::str::Chars) -> Option<char> {
    match signs.next()? {
        sign @ ('"' | '\\' | '/' | ' ') => Some(sign),
        't' => Some('\t'),
        'n' => Some('\n'),
        'x' => {
            let digits = [signs.next()?.to_digit(16)?, signs.next()?.to_digit(16)?];
            char::from_u32(16 * digits[0] + digits[1])
        }
        _ => None,
    }
}
