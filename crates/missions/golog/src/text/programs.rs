//! Parser of programs.

use super::lexer::GologToken;
use super::parser::GologParser;
use super::written::*;
use crate::error::GologError;

/// Maximum number of steps of a block.
const MOST_STEPS: usize = 200;

impl GologParser<'_> {
    /// Steps in braces, between `;`.
    pub fn block(&mut self, depth: usize) -> Result<WrittenProgram, GologError> {
        let depth = self.deeper(depth)?;
        let start = self.range();
        self.expect("{")?;
        let mut steps = Vec::new();
        while !self.take("}") {
            if steps.len() == MOST_STEPS {
                let reason = format!("expected at most {MOST_STEPS} steps in a block: use procedures");
                return Err(self.error(self.range(), reason));
            }
            steps.push(self.prioritised(depth)?);
            let is_block = self.previous_closes();
            if !self.take(";") && !is_block && *self.token() != GologToken::Sign("}") {
                return Err(self.refuse("`;`, `|`, `||`, `>>` or `}`"));
            }
        }
        let range = start.to(self.previous());
        let kind = match steps.len() {
            0 => WrittenStep::Nil,
            1 => return Ok(steps.swap_remove(0)),
            _ => WrittenStep::Sequence(steps),
        };
        Ok(WrittenProgram { range, kind })
    }

    /// Parses `a >> b`: b runs only while a can't.
    fn prioritised(&mut self, depth: usize) -> Result<WrittenProgram, GologError> {
        let left = self.concurrent(depth)?;
        if !self.take(">>") {
            return Ok(left);
        }
        let right = self.prioritised(self.deeper(depth)?)?;
        let range = left.range.to(self.previous());
        Ok(WrittenProgram { range, kind: WrittenStep::Priority(Box::new([left, right])) })
    }

    fn concurrent(&mut self, depth: usize) -> Result<WrittenProgram, GologError> {
        let left = self.choice(depth)?;
        if !self.take("||") {
            return Ok(left);
        }
        let right = self.concurrent(self.deeper(depth)?)?;
        let range = left.range.to(self.previous());
        Ok(WrittenProgram { range, kind: WrittenStep::Concurrent(Box::new([left, right])) })
    }

    fn choice(&mut self, depth: usize) -> Result<WrittenProgram, GologError> {
        let first = self.step(depth)?;
        if *self.token() != GologToken::Sign("|") {
            return Ok(first);
        }
        let start = first.range;
        let mut branches = vec![first];
        while self.take("|") {
            branches.push(self.step(depth)?);
        }
        Ok(WrittenProgram { range: start.to(self.previous()), kind: WrittenStep::Choice(branches) })
    }

    fn step(&mut self, depth: usize) -> Result<WrittenProgram, GologError> {
        let start = self.range();
        let depth = self.deeper(depth)?;
        if *self.token() == GologToken::Sign("{") {
            return self.block(depth);
        }
        let words =
            ["nil", "test", "pick", "for", "repeat", "if", "while", "parallel", "interrupt", "search"];
        let kind = match self.take_any(&words) {
            Some("nil") => WrittenStep::Nil,
            Some("test") => WrittenStep::Test(self.expression(depth)?),
            Some("pick") => WrittenStep::Pick(self.variable()?, Box::new(self.block(depth)?)),
            Some("for") => WrittenStep::For(self.variable()?, Box::new(self.block(depth)?)),
            Some("repeat") => WrittenStep::Repeat(Box::new(self.block(depth)?)),
            Some("if") => return self.conditional(start, depth),
            Some("while") => WrittenStep::While(self.expression(depth)?, Box::new(self.block(depth)?)),
            Some("parallel") => {
                self.expect("repeat")?;
                WrittenStep::ParallelRepeat(Box::new(self.block(depth)?))
            }
            Some("interrupt") => {
                WrittenStep::Interrupt(self.expression(depth)?, Box::new(self.block(depth)?))
            }
            Some(_) => WrittenStep::Search(Box::new(self.block(depth)?)),
            None => {
                let name =
                    self.name("a step: an action, a procedure, or `test`, `pick`, `if`, `while`, ...")?;
                let has_arguments = *self.token() == GologToken::Sign("(");
                let arguments = if has_arguments { self.arguments(depth)? } else { Vec::new() };
                WrittenStep::Call(name, arguments)
            }
        };
        Ok(WrittenProgram { range: start.to(self.previous()), kind })
    }

    fn conditional(&mut self, start: TextRange, depth: usize) -> Result<WrittenProgram, GologError> {
        let condition = self.expression(depth)?;
        let then = self.block(depth)?;
        let nil = WrittenProgram { range: self.previous(), kind: WrittenStep::Nil };
        let otherwise = match self.take("else") {
            false => nil,
            true => {
                let inner = self.range();
                match self.take("if") {
                    true => self.conditional(inner, self.deeper(depth)?)?,
                    false => self.block(depth)?,
                }
            }
        };
        let kind = WrittenStep::If(condition, Box::new([then, otherwise]));
        Ok(WrittenProgram { range: start.to(self.previous()), kind })
    }
}
