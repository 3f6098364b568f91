//! Tokens of IDL, with included files in their place.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::str::Chars;

use slate_sorted::SortedSet;

use super::IdlError;

/// Largest file, bytes.
const MAX_FILE: u64 = 1 << 20;

/// Most files that include each other.
const MAX_INCLUDES: usize = 16;

/// Token and its place.
#[derive(Clone, Debug)]
pub struct Token {
    pub kind: TokenKind,
    /// Index of the file.
    file: usize,
    line: usize,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TokenKind {
    /// Identifier or a keyword.
    Word(String),
    /// Literal that begins with a digit.
    Number(String),
    /// Text or a character.
    Quoted,
    /// `::`
    Scope,
    Symbol(char),
    End,
}

/// Tokens of files, from first to last.
pub struct Lexer {
    tokens: VecDeque<Token>,
    files: Vec<String>,
    /// Files that were read, when files are included.
    read: Option<SortedSet<PathBuf>>,
    depth: usize,
    /// Place of the last token.
    last: (usize, usize),
}

impl Lexer {
    /// Tokens of files that include others.
    pub fn of_files() -> Self {
        Self { read: Some(SortedSet::new()), ..Self::of_text() }
    }

    /// Tokens of texts that include no file.
    pub fn of_text() -> Self {
        Self { tokens: VecDeque::new(), files: Vec::new(), read: None, depth: 0, last: (0, 1) }
    }

    /// Adds the tokens of a file.
    pub fn read(&mut self, path: &Path) -> Result<(), IdlError> {
        let name = path.display().to_string();
        let text = text_of(path).map_err(|reason| IdlError { file: name.clone(), line: 1, reason })?;
        if let Some(read) = &mut self.read {
            read.insert(path.canonicalize().unwrap_or_else(|_| path.into()));
        }
        self.add(&name, &text)
    }

    /// Adds the tokens of a text.
    pub fn add(&mut self, name: &str, text: &str) -> Result<(), IdlError> {
        self.files.push(name.into());
        let file = self.files.len() - 1;
        let mut scanner = Scanner { rest: text.chars(), line: 1 };
        let mut is_line_start = true;
        loop {
            let before = scanner.line;
            scanner.skip_blank().map_err(|reason| self.error_at(file, scanner.line, reason))?;
            is_line_start |= scanner.line > before;
            let line = scanner.line;
            if is_line_start && scanner.peek() == Some('#') {
                let directive = scanner.rest_of_line();
                self.directive(name, file, line, &directive)?;
                continue;
            }
            is_line_start = false;
            let kind = scanner.token().map_err(|reason| self.error_at(file, line, reason))?;
            if kind == TokenKind::End {
                self.last = (file, line);
                return Ok(());
            }
            self.tokens.push_back(Token { kind, file, line });
        }
    }

    /// Handles a line that begins with `#`.
    /// A file is included once, so guards against a second time are skipped.
    fn directive(&mut self, name: &str, file: usize, line: usize, text: &str) -> Result<(), IdlError> {
        let wrong = |lexer: &Self, reason: String| Err(lexer.error_at(file, line, reason));
        let words = text.trim_start_matches('#').trim();
        let (directive, rest) = words.split_once(char::is_whitespace).unwrap_or((words, ""));
        match (directive, rest.split_whitespace().count()) {
            ("pragma", _) if rest.trim_start().starts_with("keylist") => {
                wrong(self, "`#pragma keylist` is not supported: write @key before the members".into())
            }
            ("pragma", _) | ("ifndef" | "define", 1) | ("endif", _) => Ok(()),
            ("include", _) => {
                let quoted = rest.trim().trim_matches(|c| matches!(c, '"' | '<' | '>'));
                let Some(read) = &self.read else {
                    return wrong(self, format!("`{quoted}` can't be included here"));
                };
                let path = Path::new(name).parent().unwrap_or(Path::new("")).join(quoted);
                if path.canonicalize().is_ok_and(|path| read.contains(&path)) {
                    return Ok(());
                }
                if self.depth >= MAX_INCLUDES {
                    return wrong(self, format!("more than {MAX_INCLUDES} files include each other"));
                }
                if let Err(error) = text_of(&path) {
                    return wrong(self, format!("`{quoted}` can't be included: {error}"));
                }
                self.depth += 1;
                self.read(&path)?;
                self.depth -= 1;
                Ok(())
            }
            _ => {
                let reason =
                    format!("`#{directive}` is not supported: only includes, their guards and pragmas are");
                wrong(self, reason)
            }
        }
    }

    fn error_at(&self, file: usize, line: usize, reason: String) -> IdlError {
        IdlError { file: self.files.get(file).cloned().unwrap_or_default(), line, reason }
    }

    /// Creates an error at the token that was taken last.
    pub fn error(&self, reason: impl Into<String>) -> IdlError {
        self.error_at(self.last.0, self.last.1, reason.into())
    }

    /// Returns the file and line of the token that was taken last.
    pub fn place(&self) -> String {
        let (file, line) = self.last;
        format!("{}:{line}", self.files.get(file).map_or("", String::as_str))
    }

    pub fn peek(&self) -> &TokenKind {
        self.tokens.front().map_or(&TokenKind::End, |token| &token.kind)
    }

    pub fn take(&mut self) -> TokenKind {
        let Some(token) = self.tokens.pop_front() else { return TokenKind::End };
        self.last = (token.file, token.line);
        token.kind
    }
}

fn text_of(path: &Path) -> Result<String, String> {
    let found = std::fs::metadata(path).map_err(|error| error.to_string())?;
    if found.len() > MAX_FILE {
        return Err(format!("it has {} bytes, more than {MAX_FILE}", found.len()));
    }
    std::fs::read_to_string(path).map_err(|error| error.to_string())
}

/// Splits a text into tokens.
struct Scanner<'a> {
    rest: Chars<'a>,
    line: usize,
}

impl Scanner<'_> {
    fn peek(&self) -> Option<char> {
        self.rest.clone().next()
    }

    fn take(&mut self) -> Option<char> {
        let taken = self.rest.next();
        self.line += usize::from(taken == Some('\n'));
        taken
    }

    /// Skips white space and comments.
    fn skip_blank(&mut self) -> Result<(), String> {
        loop {
            let text = self.rest.as_str();
            if text.starts_with("//") {
                self.rest_of_line();
            } else if let Some(inside) = text.strip_prefix("/*") {
                let (comment, rest) = inside.split_once("*/").ok_or("a comment has no end: write */")?;
                self.line += comment.matches('\n').count();
                self.rest = rest.chars();
            } else if self.peek().is_some_and(char::is_whitespace) {
                self.take();
            } else {
                return Ok(());
            }
        }
    }

    /// Returns the rest of the line, without its end.
    fn rest_of_line(&mut self) -> String {
        let text = self.rest.as_str();
        let (line, rest) = text.split_at(text.find('\n').unwrap_or(text.len()));
        self.rest = rest.chars();
        line.into()
    }

    fn take_while(&mut self, holds: impl Fn(char) -> bool) -> String {
        let text = self.rest.as_str();
        let (taken, rest) = text.split_at(text.find(|c| !holds(c)).unwrap_or(text.len()));
        self.rest = rest.chars();
        taken.into()
    }

    fn token(&mut self) -> Result<TokenKind, String> {
        let Some(first) = self.peek() else { return Ok(TokenKind::End) };
        if first.is_ascii_alphabetic() || first == '_' {
            return Ok(TokenKind::Word(self.take_while(|c| c.is_ascii_alphanumeric() || c == '_')));
        }
        if first.is_ascii_digit() {
            return Ok(TokenKind::Number(self.take_while(|c| c.is_ascii_alphanumeric() || c == '.')));
        }
        if matches!(first, '"' | '\'') {
            return self.quoted(first);
        }
        self.take();
        match first {
            ':' if self.peek() == Some(':') => {
                self.take();
                Ok(TokenKind::Scope)
            }
            '{' | '}' | '(' | ')' | '[' | ']' | '<' | '>' | ',' | ';' | ':' | '=' | '@' | '-' | '+' | '*'
            | '/' | '|' | '&' | '^' | '~' | '%' | '.' => Ok(TokenKind::Symbol(first)),
            other => Err(format!("{other:?} does not belong to IDL")),
        }
    }

    fn quoted(&mut self, quote: char) -> Result<TokenKind, String> {
        self.take();
        loop {
            match self.take() {
                Some('\\') => drop(self.take()),
                Some(other) if other == quote => return Ok(TokenKind::Quoted),
                Some(_) => {}
                None => return Err(format!("a text has no end: write {quote}")),
            }
        }
    }
}
