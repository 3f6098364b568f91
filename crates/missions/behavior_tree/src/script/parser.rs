//! Parser of scripts.

use super::lexer::{ScriptToken, tokens};
use super::{AssignmentOperator, BinaryOperator, ComparisonOperator, Expression, TreeScript};

/// Greatest length of a script, bytes.
const MOST_BYTES: usize = 10_000;
/// Deepest nesting of an expression.
const DEPTH: usize = 64;

/// Parses a script; `names` resolves a name to its entry or number.
pub(crate) fn parse_script(
    text: &str,
    names: &mut dyn FnMut(&str) -> Expression,
) -> Result<TreeScript, String> {
    if text.len() > MOST_BYTES {
        return Err(format!("expected a script of at most {MOST_BYTES} bytes, found {}", text.len()));
    }
    let refused = |(column, reason): (usize, String)| format!("script `{text}`, column {column}: {reason}");
    let tokens = tokens(text).map_err(refused)?;
    let mut parser = ScriptParser { tokens, at: 0, names };
    let statements = parser.statements().map_err(refused)?;
    Ok(TreeScript { text: text.into(), statements })
}

struct ScriptParser<'a> {
    tokens: Vec<(ScriptToken, usize)>,
    at: usize,
    names: &'a mut dyn FnMut(&str) -> Expression,
}

/// Column and reason.
type ScriptError = (usize, String);

impl ScriptParser<'_> {
    fn statements(&mut self) -> Result<Vec<Expression>, ScriptError> {
        let mut statements = Vec::new();
        while self.take_sign(&[";"]).is_some() {}
        while self.token() != &ScriptToken::End {
            statements.push(self.statement(0)?);
            if self.token() != &ScriptToken::End && self.take_sign(&[";"]).is_none() {
                return Err(self.refuse("an operator or `;`"));
            }
            while self.take_sign(&[";"]).is_some() {}
        }
        match statements.is_empty() {
            true => Err(self.refuse("a statement such as `count := 1`")),
            false => Ok(statements),
        }
    }

    /// Returns an assignment, or an expression.
    fn statement(&mut self, depth: usize) -> Result<Expression, ScriptError> {
        let start = self.column();
        let target = self.choice(depth)?;
        let operator = match self.take_sign(&[":=", "=", "+=", "-=", "*=", "/="]) {
            None => return Ok(target),
            Some(":=") => AssignmentOperator::Create,
            Some("=") => AssignmentOperator::Set,
            Some("+=") => AssignmentOperator::Add,
            Some("-=") => AssignmentOperator::Subtract,
            Some("*=") => AssignmentOperator::Multiply,
            Some(_) => AssignmentOperator::Divide,
        };
        let Expression::Entry(slot) = target else {
            return Err((start, "expected the name of an entry before the assignment".into()));
        };
        Ok(Expression::Assignment(slot, operator, Box::new(self.statement(self.deeper(depth)?)?)))
    }

    fn choice(&mut self, depth: usize) -> Result<Expression, ScriptError> {
        let condition = self.logic(depth, true)?;
        if self.take_sign(&["?"]).is_none() {
            return Ok(condition);
        }
        let depth = self.deeper(depth)?;
        let then = self.statement(depth)?;
        if self.take_sign(&[":"]).is_none() {
            return Err(self.refuse("`:` and the value otherwise"));
        }
        Ok(Expression::Choice(Box::new([condition, then, self.choice(depth)?])))
    }

    fn logic(&mut self, depth: usize, is_or: bool) -> Result<Expression, ScriptError> {
        let (sign, operator) = if is_or { ("||", BinaryOperator::Or) } else { ("&&", BinaryOperator::And) };
        let part = |parser: &mut Self, depth| match is_or {
            true => parser.logic(depth, false),
            false => parser.comparison(depth),
        };
        let mut left = part(self, depth)?;
        let mut depth = depth;
        while self.take_sign(&[sign]).is_some() {
            depth = self.deeper(depth)?;
            left = Expression::Binary(Box::new([left, part(self, depth)?]), operator);
        }
        Ok(left)
    }

    fn comparison(&mut self, depth: usize) -> Result<Expression, ScriptError> {
        let first = self.bits(depth, true)?;
        let mut others = Vec::new();
        while let Some(sign) = self.take_sign(&["==", "!=", "<=", ">=", "<", ">"]) {
            let operator = match sign {
                "==" => ComparisonOperator::Equal,
                "!=" => ComparisonOperator::Unequal,
                "<=" => ComparisonOperator::AtMost,
                ">=" => ComparisonOperator::AtLeast,
                "<" => ComparisonOperator::Less,
                _ => ComparisonOperator::Greater,
            };
            others.push((operator, self.bits(depth, true)?));
        }
        Ok(if others.is_empty() { first } else { Expression::Comparison(Box::new(first), others) })
    }

    fn bits(&mut self, depth: usize, is_or: bool) -> Result<Expression, ScriptError> {
        let signs: &[&str] = if is_or { &["|", "^"] } else { &["&"] };
        let part = |parser: &mut Self, depth| match is_or {
            true => parser.bits(depth, false),
            false => parser.sum(depth),
        };
        let mut left = part(self, depth)?;
        let mut depth = depth;
        while let Some(sign) = self.take_sign(signs) {
            let operator = match sign {
                "|" => BinaryOperator::BitOr,
                "^" => BinaryOperator::BitXor,
                _ => BinaryOperator::BitAnd,
            };
            depth = self.deeper(depth)?;
            left = Expression::Binary(Box::new([left, part(self, depth)?]), operator);
        }
        Ok(left)
    }

    fn sum(&mut self, depth: usize) -> Result<Expression, ScriptError> {
        let mut left = self.product(depth)?;
        let mut depth = depth;
        while let Some(sign) = self.take_sign(&["+", "-", ".."]) {
            let operator = match sign {
                "+" => BinaryOperator::Plus,
                "-" => BinaryOperator::Minus,
                _ => BinaryOperator::Join,
            };
            depth = self.deeper(depth)?;
            left = Expression::Binary(Box::new([left, self.product(depth)?]), operator);
        }
        Ok(left)
    }

    fn product(&mut self, depth: usize) -> Result<Expression, ScriptError> {
        let mut left = self.operand(depth)?;
        let mut depth = depth;
        while let Some(sign) = self.take_sign(&["*", "/"]) {
            let operator = if sign == "*" { BinaryOperator::Times } else { BinaryOperator::Divide };
            depth = self.deeper(depth)?;
            left = Expression::Binary(Box::new([left, self.operand(depth)?]), operator);
        }
        Ok(left)
    }

    fn operand(&mut self, depth: usize) -> Result<Expression, ScriptError> {
        let depth = self.deeper(depth)?;
        if let Some(sign) = self.take_sign(&["-", "!", "~", "("]) {
            return match sign {
                "-" => Ok(Expression::Negation(Box::new(self.operand(depth)?))),
                "!" => Ok(Expression::Not(Box::new(self.operand(depth)?))),
                "~" => Ok(Expression::Complement(Box::new(self.operand(depth)?))),
                _ => {
                    let inner = self.statement(depth)?;
                    match self.take_sign(&[")"]) {
                        Some(_) => Ok(inner),
                        None => Err(self.refuse("`)`")),
                    }
                }
            };
        }
        let value = match self.token().clone() {
            ScriptToken::Number(number) => Expression::Number(number),
            ScriptToken::Text(text) => Expression::Text(text),
            ScriptToken::Name(name) => match name.as_str() {
                "true" => Expression::Number(1.0),
                "false" => Expression::Number(0.0),
                _ => (self.names)(&name),
            },
            ScriptToken::Sign(_) | ScriptToken::End => return Err(self.refuse("a value")),
        };
        self.at += 1;
        Ok(value)
    }

    /// Increments the depth of an expression, that of its longest chain.
    /// Its evaluation is as deep.
    fn deeper(&self, depth: usize) -> Result<usize, ScriptError> {
        match depth < DEPTH {
            true => Ok(depth + 1),
            false => Err((
                self.column(),
                format!("expected at most {DEPTH} nested operators: use several statements"),
            )),
        }
    }

    fn token(&self) -> &ScriptToken {
        &self.tokens[self.at].0
    }

    fn column(&self) -> usize {
        self.tokens[self.at].1
    }

    fn take_sign(&mut self, signs: &[&str]) -> Option<&'static str> {
        match *self.token() {
            ScriptToken::Sign(sign) if signs.contains(&sign) => {
                self.at += 1;
                Some(sign)
            }
            _ => None,
        }
    }

    fn refuse(&self, expected: &str) -> ScriptError {
        (self.column(), format!("expected {expected}, found {}", self.token().title()))
    }
}
