//! Parser of declarations.

use super::lexer::{GologToken, tokens};
use super::written::*;
use crate::error::GologError;

/// Largest file, bytes.
const MOST_BYTES: usize = 1 << 20;
/// Deepest nesting of expressions and programs.
pub(super) const DEPTH: usize = 64;

/// Words that begin a declaration or a part of one.
const WORDS: [&str; 34] = [
    "mission",
    "domain",
    "table",
    "fluent",
    "condition",
    "initially",
    "define",
    "action",
    "exogenous",
    "procedure",
    "possible",
    "performs",
    "senses",
    "becomes",
    "failed",
    "if",
    "else",
    "while",
    "pick",
    "for",
    "repeat",
    "parallel",
    "interrupt",
    "search",
    "test",
    "nil",
    "and",
    "or",
    "not",
    "known",
    "exists",
    "all",
    "nothing",
    "bool",
];

/// Parses a text; `Err` has the first defect.
pub(crate) fn parse(text: &str) -> Result<Vec<WrittenDeclaration>, GologError> {
    if text.len() > MOST_BYTES {
        return Err(GologError::new(format!(
            "expected a file of at most {MOST_BYTES} bytes, found {}",
            text.len()
        )));
    }
    let mut parser = GologParser { text, tokens: tokens(text)?, at: 0 };
    let mut declarations = Vec::new();
    while *parser.token() != GologToken::End {
        parser.declarations(&mut declarations)?;
    }
    Ok(declarations)
}

pub(super) struct GologParser<'a> {
    text: &'a str,
    tokens: Vec<(GologToken, TextRange)>,
    at: usize,
}

impl GologParser<'_> {
    fn declarations(&mut self, declarations: &mut Vec<WrittenDeclaration>) -> Result<(), GologError> {
        let Some(word) = self.take_any(&WORDS[..10]) else {
            let words = "a declaration: `domain`, `table`, `fluent`, `condition`, `initially`, `define`, `action`, \
                         `exogenous` or `procedure`";
            return Err(self.refuse(words));
        };
        if word == "initially" {
            loop {
                let (name, arguments) = self.head(0)?;
                self.expect("=")?;
                let value = self.expression(0)?;
                declarations.push(WrittenDeclaration {
                    name,
                    content: WrittenContent::Initially { arguments, value },
                });
                if !self.take(",") {
                    return Ok(());
                }
            }
        }
        let name = self.name("a name")?;
        let content = match word {
            "mission" => WrittenContent::Mission,
            "domain" => self.domain()?,
            "table" => self.table()?,
            "fluent" => {
                let domains = self.domains()?;
                let value_type = if self.take(":") { Some(self.value_type()?) } else { None };
                let initial = if self.take("=") { Some(self.expression(0)?) } else { None };
                WrittenContent::Fluent { domains, value_type, initial }
            }
            "condition" => {
                let domains = self.domains()?;
                let initial = if self.take("=") { Some(self.expression(0)?) } else { None };
                WrittenContent::Condition { domains, initial }
            }
            "define" => {
                let variables = self.variables()?;
                self.expect("=")?;
                WrittenContent::Define { variables, formula: self.expression(0)? }
            }
            "procedure" => {
                let variables = self.variables()?;
                WrittenContent::Procedure { variables, body: self.block(0)? }
            }
            _ => {
                let variables = self.variables()?;
                WrittenContent::Action { variables, action: Box::new(self.action(word == "exogenous")?) }
            }
        };
        declarations.push(WrittenDeclaration { name, content });
        Ok(())
    }

    fn domain(&mut self) -> Result<WrittenContent, GologError> {
        self.expect("=")?;
        if matches!(self.token(), GologToken::Integer(_) | GologToken::Sign("-")) {
            let (low, high, _) = self.number_range()?;
            return Ok(WrittenContent::Range(low, high));
        }
        let mut symbols = vec![self.name("a value such as `kitchen`, or a range such as `1..5`")?];
        while self.take(",") {
            symbols.push(self.name("a value such as `kitchen`")?);
        }
        Ok(WrittenContent::Symbols(symbols))
    }

    fn number_range(&mut self) -> Result<(i32, i32, TextRange), GologError> {
        let start = self.range();
        let low = self.integer()?;
        self.expect("..")?;
        let high = self.integer()?;
        let range = start.to(self.previous());
        if low > high {
            let reason =
                format!("expected a range from its least value to its greatest, found {low}..{high}");
            return Err(self.error(range, reason));
        }
        Ok((low, high, range))
    }

    fn table(&mut self) -> Result<WrittenContent, GologError> {
        let domains = self.domains()?;
        self.expect("=")?;
        let mut entries = Vec::new();
        loop {
            let keys = if domains.len() == 1 { vec![self.expression(0)?] } else { self.arguments(0)? };
            self.expect(":")?;
            entries.push((keys, self.real()?));
            if !self.take(",") {
                return Ok(WrittenContent::Table { domains, entries });
            }
        }
    }

    fn action(&mut self, is_exogenous: bool) -> Result<WrittenAction, GologError> {
        let mut action = WrittenAction { is_exogenous, ..WrittenAction::default() };
        loop {
            if self.take("possible") {
                self.expect("if")?;
                self.once(action.possible.is_some(), "precondition; join them with `and`")?;
                action.possible = Some(self.expression(0)?);
            } else if self.take("performs") {
                self.once(action.performs.is_some(), "action of the robot")?;
                action.performs = Some(match self.take("nothing") {
                    true => (None, Vec::new()),
                    false => self.head(0).map(|(name, arguments)| (Some(name), arguments))?,
                });
            } else if self.take("senses") {
                self.once(action.senses.is_some(), "sensed fluent")?;
                action.senses = Some(self.head(0)?);
            } else if *self.token() == GologToken::Name("if".into()) && self.follows("failed") {
                self.at += 2;
                self.expect(":")?;
                action.handles_failure = true;
                if !self.take("nothing") {
                    let effect = self.effect()?;
                    action.failure_effects.push(effect);
                }
            } else if self.begins_effect() {
                let is_failure = action.handles_failure;
                let effect = self.effect()?;
                match is_failure {
                    true => action.failure_effects.push(effect),
                    false => action.effects.push(effect),
                }
            } else {
                return Ok(action);
            }
        }
    }

    fn once(&self, is_second: bool, what: &str) -> Result<(), GologError> {
        match is_second {
            true => Err(self.error(self.previous(), format!("expected one {what}"))),
            false => Ok(()),
        }
    }

    /// Returns true at an effect, which begins with its fluent, or with `all`.
    fn begins_effect(&self) -> bool {
        match self.token() {
            GologToken::Name(name) => name == "all" || !WORDS.contains(&name.as_str()),
            _ => false,
        }
    }

    fn effect(&mut self) -> Result<WrittenEffect, GologError> {
        let mut variables = Vec::new();
        while self.take("all") {
            variables.push(self.variable()?);
            self.expect(":")?;
        }
        let (fluent, arguments) = self.head(0)?;
        self.expect("becomes")?;
        let value = self.expression(0)?;
        let has_condition = *self.token() == GologToken::Name("if".into()) && !self.follows("failed");
        let condition = if has_condition {
            self.at += 1;
            Some(self.expression(0)?)
        } else {
            None
        };
        Ok(WrittenEffect { variables, fluent, arguments, value, condition })
    }

    /// Returns a name with arguments.
    pub fn head(&mut self, depth: usize) -> Result<(WrittenName, Vec<WrittenExpression>), GologError> {
        let name = self.name("a name")?;
        let arguments =
            if *self.token() == GologToken::Sign("(") { self.arguments(depth)? } else { Vec::new() };
        Ok((name, arguments))
    }

    pub fn arguments(&mut self, depth: usize) -> Result<Vec<WrittenExpression>, GologError> {
        self.list(|parser| parser.expression(depth))
    }

    /// Types of a fluent's arguments.
    fn domains(&mut self) -> Result<Vec<WrittenType>, GologError> {
        match self.token() {
            GologToken::Sign("(") => self.list(Self::value_type),
            _ => Ok(Vec::new()),
        }
    }

    fn variables(&mut self) -> Result<Vec<WrittenVariable>, GologError> {
        match self.token() {
            GologToken::Sign("(") => self.list(Self::variable),
            _ => Ok(Vec::new()),
        }
    }

    /// Returns a list in parentheses, which may be empty.
    fn list<T>(
        &mut self,
        mut item: impl FnMut(&mut Self) -> Result<T, GologError>,
    ) -> Result<Vec<T>, GologError> {
        self.expect("(")?;
        let mut items = Vec::new();
        if self.take(")") {
            return Ok(items);
        }
        loop {
            items.push(item(self)?);
            if !self.take(",") {
                self.expect(")")?;
                return Ok(items);
            }
        }
    }

    pub fn variable(&mut self) -> Result<WrittenVariable, GologError> {
        let name = self.name("a variable such as `p: place`")?;
        self.expect(":")?;
        Ok(WrittenVariable { name, domain: self.value_type()? })
    }

    fn value_type(&mut self) -> Result<WrittenType, GologError> {
        if matches!(self.token(), GologToken::Integer(_) | GologToken::Sign("-")) {
            let (low, high, range) = self.number_range()?;
            return Ok(WrittenType::Range(low, high, range));
        }
        let range = self.range();
        if self.take("bool") {
            return Ok(WrittenType::Named(WrittenName { text: "bool".into(), range }));
        }
        Ok(WrittenType::Named(self.name("a domain, or a range such as `1..5`")?))
    }

    pub fn name(&mut self, expected: &str) -> Result<WrittenName, GologError> {
        match self.token().clone() {
            GologToken::Name(text) if !WORDS.contains(&text.as_str()) => {
                self.at += 1;
                Ok(WrittenName { text, range: self.previous() })
            }
            _ => Err(self.refuse(expected)),
        }
    }

    fn integer(&mut self) -> Result<i32, GologError> {
        let is_negative = self.take("-");
        match *self.token() {
            GologToken::Integer(number) => {
                self.at += 1;
                Ok(if is_negative { -number } else { number })
            }
            _ => Err(self.refuse("a whole number")),
        }
    }

    fn real(&mut self) -> Result<f64, GologError> {
        let is_negative = self.take("-");
        let number = match *self.token() {
            GologToken::Integer(number) => f64::from(number),
            GologToken::Real(number) => number,
            _ => return Err(self.refuse("a number")),
        };
        self.at += 1;
        Ok(if is_negative { -number } else { number })
    }

    pub fn token(&self) -> &GologToken {
        &self.tokens[self.at].0
    }

    /// Returns the range of the next token.
    pub fn range(&self) -> TextRange {
        self.tokens[self.at].1
    }

    /// Returns the range of the newest consumed token.
    pub fn previous(&self) -> TextRange {
        self.tokens[self.at.saturating_sub(1)].1
    }

    /// Returns true if the newest token is a closing brace.
    pub fn previous_closes(&self) -> bool {
        self.at > 0 && self.tokens[self.at - 1].0 == GologToken::Sign("}")
    }

    /// Advances to the next token.
    pub fn take_token(&mut self) {
        self.at += usize::from(self.at + 1 < self.tokens.len());
    }

    fn follows(&self, word: &str) -> bool {
        matches!(self.tokens.get(self.at + 1), Some((GologToken::Name(name), _)) if name == word)
    }

    /// Consumes a sign or a word; returns false for another token.
    pub fn take(&mut self, sign: &str) -> bool {
        self.take_any(&[sign]).is_some()
    }

    pub fn take_any<'w>(&mut self, signs: &[&'w str]) -> Option<&'w str> {
        let found = match self.token() {
            GologToken::Sign(own) => signs.iter().find(|sign| *sign == own),
            GologToken::Name(own) => signs.iter().find(|sign| *sign == own),
            _ => None,
        };
        self.at += usize::from(found.is_some());
        found.copied()
    }

    pub fn expect(&mut self, sign: &str) -> Result<(), GologError> {
        match self.take(sign) {
            true => Ok(()),
            false => Err(self.refuse(&format!("`{sign}`"))),
        }
    }

    pub fn deeper(&self, depth: usize) -> Result<usize, GologError> {
        match depth < DEPTH {
            true => Ok(depth + 1),
            false => Err(self.error(
                self.range(),
                format!("expected at most {DEPTH} nested parts: use procedures and defined fluents"),
            )),
        }
    }

    pub fn error(&self, range: TextRange, reason: impl Into<String>) -> GologError {
        GologError::at(self.text, range.start, range.end, reason)
    }

    pub fn refuse(&self, expected: &str) -> GologError {
        let help = match self.token() {
            GologToken::Sign("=") => Some("`==` compares".into()),
            GologToken::Sign("&") => Some("use `and`".into()),
            GologToken::Sign("!") => Some("use `not`".into()),
            GologToken::Sign("?") => Some("a test is written `test FORMULA`".into()),
            GologToken::Name(name) if WORDS.contains(&name.as_str()) => {
                Some(format!("`{name}` is a word of the language"))
            }
            _ => None,
        };
        self.error(self.range(), format!("expected {expected}, found {}", self.token().title()))
            .with_help(help)
    }
}
