//! Words and signs of a source file of Rust.
//!
//! Own code: of an unbalanced bracket or an open text, `proc-macro2` says only "cannot parse string into token stream", where a newcomer needs
//! the line of its begin; and `syn` would be compiled a second time for the command.

use super::syntax_error::SyntaxError;

/// Token of the source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SourceToken {
    Word(String),
    /// Contents of a string literal.
    Text(String),
    Doc(String),
    Sign(char),
}

/// Returns the tokens with their lines, if each bracket is closed.
pub fn tokens(source: &str) -> Result<Vec<(usize, SourceToken)>, SyntaxError> {
    let mut tokens = Vec::new();
    let (mut rest, mut line) = (source, 1);
    while let Some(first) = rest.chars().next() {
        let unclosed = |what: &str, end: &str| SyntaxError {
            line,
            message: format!(
                "{what} begins here and is not closed: expected `{end}` before the end of the file"
            ),
        };
        let length = if let Some(comment) = rest.strip_prefix("//") {
            let end = comment.find('\n').unwrap_or(comment.len());
            if let Some(doc) = comment[..end].strip_prefix('/') {
                tokens.push((line, SourceToken::Doc(doc.trim().to_owned())));
            }
            end + 2
        } else if rest.starts_with("/*") {
            comment(rest).ok_or_else(|| unclosed("a comment", "*/"))?
        } else if let Some(end) = raw_text(rest) {
            end.ok_or_else(|| unclosed("a raw text", "\""))?
        } else if first == '"' {
            let mut end = 1;
            let bytes = rest.as_bytes();
            while end < bytes.len() && bytes[end] != b'"' {
                end += if bytes[end] == b'\\' { 2 } else { 1 };
            }
            if end >= bytes.len() {
                return Err(unclosed("a text", "\""));
            }
            tokens.push((line, SourceToken::Text(rest[1..end].to_owned())));
            end + 1
        } else if first.is_alphanumeric() || first == '_' {
            let is_end = |c: char| !(c.is_alphanumeric() || c == '_');
            // A raw name such as `r#type`.
            let begin =
                if rest.strip_prefix("r#").is_some_and(|name| !name.starts_with(is_end)) { 2 } else { 0 };
            let end = rest[begin..].find(is_end).map_or(rest.len(), |end| begin + end);
            tokens.push((line, SourceToken::Word(rest[..end].to_owned())));
            end
        } else if first == '\'' {
            // Otherwise it is a lifetime, which is skipped.
            character(rest).unwrap_or(1)
        } else {
            if !first.is_whitespace() {
                tokens.push((line, SourceToken::Sign(first)));
            }
            first.len_utf8()
        };
        line += rest[..length].matches('\n').count();
        rest = &rest[length..];
    }
    balanced(&tokens)?;
    Ok(tokens)
}

/// Returns the end of a comment, which may be nested.
fn comment(text: &str) -> Option<usize> {
    let (mut depth, mut at) = (0_usize, 0);
    loop {
        let next = text.get(at..)?;
        let step = if next.starts_with("/*") {
            depth += 1;
            2
        } else if next.starts_with("*/") {
            depth -= 1;
            2
        } else {
            next.chars().next()?.len_utf8()
        };
        at += step;
        if depth == 0 {
            return Some(at);
        }
    }
}

/// Returns the end of a raw text such as `r#"…"#`, if one begins here.
/// The inner `None` means that it does not end.
fn raw_text(text: &str) -> Option<Option<usize>> {
    let rest = ["r", "br", "cr"].iter().find_map(|prefix| text.strip_prefix(prefix))?;
    let inside = rest.trim_start_matches('#');
    let signs = rest.len() - inside.len();
    let inside = inside.strip_prefix('"')?;
    let end = format!("\"{}", "#".repeat(signs));
    let begin = text.len() - inside.len();
    Some(inside.find(&end).map(|place| begin + place + end.len()))
}

/// Returns the end of a character in quotes, if one begins here.
fn character(text: &str) -> Option<usize> {
    let inside = text.strip_prefix('\'')?;
    let mut chars = inside.char_indices();
    let (_, first) = chars.next()?;
    if first == '\\' {
        // An escaped character may be a quote.
        let (escaped, c) = chars.next()?;
        let behind = escaped + c.len_utf8();
        let end = inside.get(behind..)?.find('\'')?;
        return Some(1 + behind + end + 1);
    }
    let (end, quote) = chars.next()?;
    (quote == '\'').then_some(1 + end + 1)
}

/// Checks that each bracket is closed by its own kind.
fn balanced(tokens: &[(usize, SourceToken)]) -> Result<(), SyntaxError> {
    let mut open: Vec<(usize, char, char)> = Vec::new();
    for (line, token) in tokens {
        let SourceToken::Sign(sign) = token else { continue };
        match sign {
            '(' => open.push((*line, '(', ')')),
            '[' => open.push((*line, '[', ']')),
            '{' => open.push((*line, '{', '}')),
            ')' | ']' | '}' => match open.pop() {
                Some((_, _, wanted)) if wanted == *sign => {}
                Some((begin, opened, wanted)) => {
                    let message =
                        format!("expected `{wanted}` for the `{opened}` of line {begin}, not `{sign}`");
                    return Err(SyntaxError { line: *line, message });
                }
                None => {
                    let message = format!("`{sign}` closes nothing: expected an item");
                    return Err(SyntaxError { line: *line, message });
                }
            },
            _ => {}
        }
    }
    match open.pop() {
        Some((line, opened, wanted)) => {
            let message = format!("`{opened}` is not closed: expected `{wanted}` before the end of the file");
            Err(SyntaxError { line, message })
        }
        None => Ok(()),
    }
}
