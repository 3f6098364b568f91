//! Metering of scripts: they count their operations.
//!
//! Each body of a loop or a function begins with a call that takes the number of its tokens from the budget of the
//! tick, and so does each `goto`. Lua's own hook would make every instruction slower, and the steps of skills twice as
//! long.

/// Name of the function that consumes the budget.
const METER: &str = "_METER_";

/// Block that is open.
enum LuaBlock {
    /// `while` or `for` before its `do`.
    LoopHead,
    /// Block whose tokens belong to the one around it.
    Plain,
    /// Body of a loop or a function, with its place in the list of calls.
    Counted(usize),
}

/// Adds metering calls to a Lua text of correct syntax.
/// Returns the text of a function that takes the metering function and returns the script. Lines keep their numbers.
///
/// # Errors
/// If a name in the text is reserved, or its blocks do not fit together.
pub fn metered(text: &str) -> Result<String, String> {
    let mut calls: Vec<(usize, u64)> = Vec::new();
    let mut blocks: Vec<LuaBlock> = Vec::new();
    // A function whose parameters have not ended.
    let mut awaits_parameters = false;
    let mut tokens = LuaTokens { text, at: 0 };
    while let Some((start, token)) = tokens.next_token() {
        if let Some(index) = blocks.iter().rev().find_map(|block| match block {
            LuaBlock::Counted(index) => Some(*index),
            _ => None,
        }) {
            calls[index].1 += 1;
        }
        let mut count_body = |blocks: &mut Vec<LuaBlock>, at| {
            blocks.push(LuaBlock::Counted(calls.len()));
            calls.push((at, 1));
        };
        match token {
            METER => return Err(format!("the name `{METER}` is reserved")),
            "function" => awaits_parameters = true,
            ")" if awaits_parameters => {
                awaits_parameters = false;
                count_body(&mut blocks, tokens.at);
            }
            "while" | "for" => blocks.push(LuaBlock::LoopHead),
            "do" if matches!(blocks.last(), Some(LuaBlock::LoopHead)) => {
                blocks.pop();
                count_body(&mut blocks, tokens.at);
            }
            "repeat" => count_body(&mut blocks, tokens.at),
            "if" | "do" => blocks.push(LuaBlock::Plain),
            "end" | "until" => {
                blocks.pop().ok_or("a block ends that has not begun")?;
            }
            "goto" => calls.push((start, 1)),
            _ => {}
        }
    }
    if !blocks.is_empty() {
        return Err("a block does not end".into());
    }
    Ok(with_calls(text, &calls))
}

fn with_calls(text: &str, calls: &[(usize, u64)]) -> String {
    let mut metered = format!("local {METER} = ... return function(...) ");
    let mut from = 0;
    for (at, weight) in calls {
        metered.push_str(&text[from..*at]);
        metered.push_str(&format!(" {METER}({weight}); "));
        from = *at;
    }
    metered.push_str(&text[from..]);
    // A comment may be last.
    metered.push_str("\nend");
    metered
}

/// LuaTokens of Lua, without comments.
struct LuaTokens<'a> {
    text: &'a str,
    at: usize,
}

impl<'a> LuaTokens<'a> {
    /// Returns the next token and where it starts. Numbers may come in several parts.
    fn next_token(&mut self) -> Option<(usize, &'a str)> {
        loop {
            let rest = &self.text[self.at..];
            let first = rest.chars().next()?;
            let start = self.at;
            if let Some(comment) = rest.strip_prefix("--") {
                self.at +=
                    2 + long_bracket(comment).unwrap_or_else(|| comment.find('\n').unwrap_or(comment.len()));
                continue;
            }
            if first.is_whitespace() {
                self.at += first.len_utf8();
                continue;
            }
            self.at += match first {
                '"' | '\'' => quoted(rest, first),
                '[' => long_bracket(rest).unwrap_or(1),
                _ if first.is_ascii_alphanumeric() || first == '_' => {
                    rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len())
                }
                _ => first.len_utf8(),
            };
            return Some((start, &self.text[start..self.at]));
        }
    }
}

/// Returns the length of a text in quotes.
fn quoted(text: &str, quote: char) -> usize {
    let mut is_escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            _ if is_escaped => is_escaped = false,
            '\\' => is_escaped = true,
            _ if c == quote => return at + 1,
            _ => {}
        }
    }
    text.len()
}

/// Returns the length of a text in long brackets such as `[==[ ]==]`.
/// `None` if none begins here.
fn long_bracket(text: &str) -> Option<usize> {
    let rest = text.strip_prefix('[')?;
    let level = rest.chars().take_while(|c| *c == '=').count();
    let body = rest[level..].strip_prefix('[')?;
    let end = format!("]{}]", "=".repeat(level));
    let length = body.find(&end).map_or(body.len(), |at| at + end.len());
    Some(level + 2 + length)
}
