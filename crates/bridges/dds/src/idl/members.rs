//! Members, types and names of IDL.

use slate_blackboard::interface::Primitive;

use super::definition::{Annotation, DefinitionParser};
use super::lexer::TokenKind;
use super::scope::IdlDefinition;
use super::{IdlError, IdlKind, IdlMember, MAX_DEPTH};

impl DefinitionParser {
    /// Adds the members of a line.
    pub fn member(&mut self, members: &mut Vec<IdlMember>) -> Result<(), IdlError> {
        let annotations = self.annotations()?;
        if let Some(own) = annotations.iter().find(|own| matches!(own.name.as_str(), "optional" | "mutable"))
        {
            return Err(self.lexer.error(format!("@{} is not supported", own.name)));
        }
        let is_key = annotations
            .iter()
            .any(|own| own.name.eq_ignore_ascii_case("key") && own.argument.as_deref() != Some("FALSE"));
        let kind = self.kind(0)?;
        loop {
            let (name, kind) = self.declarator(kind.clone())?;
            members.push(IdlMember { name, kind, is_key });
            if !self.is_next(',') {
                return self.symbol(';');
            }
        }
    }

    /// Reads a name, and the type with the arrays after it.
    pub fn declarator(&mut self, kind: IdlKind) -> Result<(String, IdlKind), IdlError> {
        let name = self.name("a member")?;
        let mut count = None;
        while self.is_next('[') {
            let own = self.bound()?;
            self.symbol(']')?;
            // Several dimensions lie one after the other.
            count = Some(count.unwrap_or(1_usize).saturating_mul(own));
        }
        let kind = match count {
            Some(count) => IdlKind::Array(Box::new(kind), count),
            None => kind,
        };
        self.check_extent(&name, kind.extent())?;
        Ok((name, kind))
    }

    /// Reads a type that is nested at this depth.
    pub fn kind(&mut self, depth: usize) -> Result<IdlKind, IdlError> {
        if depth >= MAX_DEPTH {
            return Err(self.lexer.error(format!("types stand more than {MAX_DEPTH} deep")));
        }
        if *self.lexer.peek() == TokenKind::Scope {
            return self.named_kind(None);
        }
        let word = self.word("a type")?;
        let primitive = match word.as_str() {
            "boolean" => Primitive::Bool,
            "octet" | "uint8" | "char" => Primitive::U8,
            "int8" => Primitive::I8,
            "short" | "int16" => Primitive::I16,
            "uint16" => Primitive::U16,
            "int32" => Primitive::I32,
            "uint32" => Primitive::U32,
            "int64" => Primitive::I64,
            "uint64" => Primitive::U64,
            "float" => Primitive::F32,
            "double" => Primitive::F64,
            "long" if self.is_next_word("double") => {
                return Err(self.lexer.error("`long double` is not supported"));
            }
            "long" if self.is_next_word("long") => Primitive::I64,
            "long" => Primitive::I32,
            "unsigned" => self.unsigned()?,
            "string" => return Ok(IdlKind::Text(self.text_bound()?)),
            "sequence" => return self.sequence(depth),
            "struct" | "enum" => {
                return Err(self.lexer.error(format!("define the {word} before, and write its name here")));
            }
            "wchar" | "wstring" | "any" | "fixed" | "map" | "Object" | "union" | "bitset" | "bitmask" => {
                return Err(self.lexer.error(format!("`{word}` is not supported")));
            }
            _ => return self.named_kind(Some(word)),
        };
        Ok(IdlKind::Primitive(primitive))
    }

    fn unsigned(&mut self) -> Result<Primitive, IdlError> {
        match self.word("short or long")?.as_str() {
            "short" => Ok(Primitive::U16),
            "long" if self.is_next_word("long") => Ok(Primitive::U64),
            "long" => Ok(Primitive::U32),
            other => Err(self.lexer.error(format!("expected `short` or `long`, found `{other}`"))),
        }
    }

    fn text_bound(&mut self) -> Result<Option<usize>, IdlError> {
        if !self.is_next('<') {
            return Ok(None);
        }
        let bound = self.bound()?;
        self.symbol('>').map(|()| Some(bound))
    }

    fn sequence(&mut self, depth: usize) -> Result<IdlKind, IdlError> {
        self.symbol('<')?;
        let item = self.kind(depth + 1)?;
        let bound = if self.is_next(',') { Some(self.bound()?) } else { None };
        self.symbol('>')?;
        Ok(IdlKind::Sequence(Box::new(item), bound))
    }

    fn named_kind(&mut self, first: Option<String>) -> Result<IdlKind, IdlError> {
        let name = self.scoped_name_from(first)?;
        match self.scope.find(&name) {
            Some(IdlDefinition::Type(kind)) => Ok(kind.clone()),
            Some(_) => Err(self.lexer.error(format!("`{name}` is not a type"))),
            None => Err(self.lexer.error(format!("`{name}` is not defined before"))),
        }
    }

    /// Reads a number of items or bytes, at least 1.
    pub fn bound(&mut self) -> Result<usize, IdlError> {
        let number = self.integer()?;
        let bound = u32::try_from(number).ok().filter(|bound| *bound > 0);
        let wrong = || self.lexer.error(format!("a bound is a number from 1, found {number}"));
        bound.map(|bound| bound as usize).ok_or_else(wrong)
    }

    /// Reads an integer, or the name of a constant.
    pub fn integer(&mut self) -> Result<i64, IdlError> {
        let sign = if self.is_next('-') { -1 } else { 1 };
        let number = match self.lexer.peek().clone() {
            TokenKind::Number(text) => {
                self.lexer.take();
                let lower = text.to_ascii_lowercase();
                let digits = match (lower.strip_prefix("0x"), lower.strip_prefix('0')) {
                    (Some(digits), _) => i64::from_str_radix(digits, 16),
                    (None, Some(digits)) if !digits.is_empty() => i64::from_str_radix(digits, 8),
                    _ => lower.parse(),
                };
                digits.map_err(|_| self.lexer.error(format!("`{text}` is no integer")))?
            }
            _ => {
                let name = self.scoped_name()?;
                match self.scope.find(&name) {
                    Some(IdlDefinition::Constant(value)) => *value,
                    _ => {
                        return Err(self
                            .lexer
                            .error(format!("`{name}` is no constant that is defined before")));
                    }
                }
            }
        };
        if matches!(self.lexer.peek(), TokenKind::Symbol('+' | '-' | '*' | '/' | '%' | '|' | '&' | '^' | '<'))
        {
            return Err(self.lexer.error("expressions are not supported: write the number"));
        }
        Ok(sign * number)
    }

    pub fn scoped_name(&mut self) -> Result<String, IdlError> {
        self.scoped_name_from(None)
    }

    fn scoped_name_from(&mut self, first: Option<String>) -> Result<String, IdlError> {
        let mut name = match first {
            Some(first) => first,
            None if self.is_scope() => format!("::{}", self.word("a name")?),
            None => self.word("a name")?,
        };
        while self.is_scope() {
            name = format!("{name}::{}", self.word("a name")?);
        }
        Ok(name)
    }

    fn is_scope(&mut self) -> bool {
        let is_scope = *self.lexer.peek() == TokenKind::Scope;
        if is_scope {
            self.lexer.take();
        }
        is_scope
    }

    pub fn annotations(&mut self) -> Result<Vec<Annotation>, IdlError> {
        let mut annotations = Vec::new();
        while self.is_next('@') {
            // One word, as the type that follows may begin with `::`.
            let name = self.word("the name of an annotation")?;
            let argument = if self.is_next('(') { Some(self.argument()?) } else { None };
            annotations.push(Annotation { name, argument });
        }
        Ok(annotations)
    }

    /// Reads the text up to the closing parenthesis.
    fn argument(&mut self) -> Result<String, IdlError> {
        let (mut text, mut open) = (String::new(), 1_usize);
        loop {
            match self.lexer.take() {
                TokenKind::End => return Err(self.lexer.error("an annotation has no end: write `)`")),
                TokenKind::Symbol('(') => open += 1,
                TokenKind::Symbol(')') if open == 1 => return Ok(text),
                TokenKind::Symbol(')') => open -= 1,
                TokenKind::Symbol(other) => text.push(other),
                TokenKind::Word(word) | TokenKind::Number(word) => text += &word,
                TokenKind::Scope | TokenKind::Quoted => {}
            }
        }
    }

    /// Reads a new name; `_` before a keyword is not part of it.
    pub fn name(&mut self, of: &str) -> Result<String, IdlError> {
        let word = self.word(&format!("the name of {of}"))?;
        let name = word.strip_prefix('_').unwrap_or(&word);
        if name.is_empty() { Err(self.lexer.error("`_` is not a name")) } else { Ok(name.into()) }
    }

    pub fn word(&mut self, expected: &str) -> Result<String, IdlError> {
        match self.lexer.take() {
            TokenKind::Word(word) => Ok(word),
            other => Err(self.lexer.error(format!("expected {expected}, found {}", shown(&other)))),
        }
    }

    pub fn symbol(&mut self, expected: char) -> Result<(), IdlError> {
        match self.lexer.take() {
            TokenKind::Symbol(found) if found == expected => Ok(()),
            other => Err(self.lexer.error(format!("expected `{expected}`, found {}", shown(&other)))),
        }
    }

    /// Takes a symbol, if it is the next token.
    pub fn is_next(&mut self, symbol: char) -> bool {
        let is_next = *self.lexer.peek() == TokenKind::Symbol(symbol);
        if is_next {
            self.lexer.take();
        }
        is_next
    }

    fn is_next_word(&mut self, word: &str) -> bool {
        let is_next = matches!(self.lexer.peek(), TokenKind::Word(next) if next == word);
        if is_next {
            self.lexer.take();
        }
        is_next
    }
}

fn shown(token: &TokenKind) -> String {
    match token {
        TokenKind::Word(word) | TokenKind::Number(word) => {
            format!("`{}`", word.chars().take(40).collect::<String>())
        }
        TokenKind::Quoted => "a text".into(),
        TokenKind::Scope => "`::`".into(),
        TokenKind::Symbol(symbol) => format!("`{symbol}`"),
        TokenKind::End => "the end of the file".into(),
    }
}
