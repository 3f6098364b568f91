//! Parser of expressions.

use super::lexer::GologToken;
use super::parser::GologParser;
use super::written::*;
use crate::error::GologError;

const COMPARISONS: [(&str, WrittenOperator); 6] = [
    ("==", WrittenOperator::Equal),
    ("!=", WrittenOperator::Unequal),
    ("<=", WrittenOperator::AtMost),
    (">=", WrittenOperator::AtLeast),
    ("<", WrittenOperator::Less),
    (">", WrittenOperator::Greater),
];

impl GologParser<'_> {
    /// Parses an expression.
    /// `or` binds loosest, then `and`, `not`, comparisons, `+` and `-`.
    pub fn expression(&mut self, depth: usize) -> Result<WrittenExpression, GologError> {
        let depth = self.deeper(depth)?;
        let first = self.conjunction(depth)?;
        self.joined(first, "or", WrittenOperation::Any, |parser| parser.conjunction(depth))
    }

    fn conjunction(&mut self, depth: usize) -> Result<WrittenExpression, GologError> {
        let first = self.negation(depth)?;
        self.joined(first, "and", WrittenOperation::All, |parser| parser.negation(depth))
    }

    fn joined(
        &mut self,
        first: WrittenExpression,
        word: &str,
        join: fn(Vec<WrittenExpression>) -> WrittenOperation,
        mut part: impl FnMut(&mut Self) -> Result<WrittenExpression, GologError>,
    ) -> Result<WrittenExpression, GologError> {
        let start = first.range;
        let mut parts = vec![first];
        while self.take(word) {
            parts.push(part(self)?);
        }
        if parts.len() > 1 {
            return Ok(WrittenExpression { range: start.to(self.previous()), kind: join(parts) });
        }
        // One part is there.
        Ok(parts.swap_remove(0))
    }

    fn negation(&mut self, depth: usize) -> Result<WrittenExpression, GologError> {
        let start = self.range();
        if self.take("not") {
            let inner = self.negation(self.deeper(depth)?)?;
            return Ok(WrittenExpression {
                range: start.to(self.previous()),
                kind: WrittenOperation::Not(Box::new(inner)),
            });
        }
        let left = self.sum(depth)?;
        let Some((_, operator)) = COMPARISONS.into_iter().find(|(sign, _)| self.take(sign)) else {
            return Ok(left);
        };
        let right = self.sum(depth)?;
        Ok(WrittenExpression {
            range: start.to(self.previous()),
            kind: WrittenOperation::Binary(operator, Box::new([left, right])),
        })
    }

    fn sum(&mut self, depth: usize) -> Result<WrittenExpression, GologError> {
        let start = self.range();
        let mut left = self.operand(depth)?;
        let mut depth = depth;
        loop {
            let operator = match self.take_any(&["+", "-"]) {
                Some("+") => WrittenOperator::Plus,
                Some(_) => WrittenOperator::Minus,
                None => return Ok(left),
            };
            depth = self.deeper(depth)?;
            let right = self.operand(depth)?;
            let range = start.to(self.previous());
            left = WrittenExpression {
                range,
                kind: WrittenOperation::Binary(operator, Box::new([left, right])),
            };
        }
    }

    fn operand(&mut self, depth: usize) -> Result<WrittenExpression, GologError> {
        let start = self.range();
        let kind = match self.token().clone() {
            GologToken::Integer(number) => {
                self.take_token();
                WrittenOperation::Number(number)
            }
            GologToken::Real(number) => {
                self.take_token();
                WrittenOperation::Real(number)
            }
            _ if self.take("-") => WrittenOperation::Negative(Box::new(self.operand(self.deeper(depth)?)?)),
            _ if self.take("known") => WrittenOperation::Known(Box::new(self.operand(self.deeper(depth)?)?)),
            _ if self.take("(") => {
                let inner = self.expression(depth)?;
                self.expect(")")?;
                return Ok(inner);
            }
            GologToken::Name(word) if word == "exists" || word == "all" => {
                self.take_token();
                let variable = self.variable()?;
                self.expect("(")?;
                let inner = self.expression(depth)?;
                self.expect(")")?;
                WrittenOperation::Quantified(word == "all", variable, Box::new(inner))
            }
            GologToken::Name(_) => {
                let name = self.name("a value")?;
                let has_arguments = *self.token() == GologToken::Sign("(");
                let arguments = if has_arguments { self.arguments(depth)? } else { Vec::new() };
                WrittenOperation::Name(name, arguments)
            }
            _ => return Err(self.refuse("a value")),
        };
        Ok(WrittenExpression { range: start.to(self.previous()), kind })
    }
}
