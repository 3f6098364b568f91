//! Evaluation of scripts.

use super::{AssignmentOperator, BinaryOperator, ComparisonOperator, Expression, TreeScript};
use crate::value::{BoardValue, is_same_number};

/// Longest text that a script makes, bytes.
const MOST_TEXT: usize = 64 << 10;

impl TreeScript {
    /// Evaluates the statements and returns the value of the last one.
    ///
    /// An error names the script.
    pub fn evaluate(
        &self,
        values: &mut [Option<BoardValue>],
        names: &[String],
    ) -> Result<BoardValue, String> {
        let mut result = BoardValue::Number(0.0);
        for statement in &self.statements {
            result = evaluate(statement, values, names)
                .map_err(|reason| format!("script `{}`: {reason}", self.text))?;
        }
        Ok(result)
    }

    /// Evaluates a condition.
    pub fn holds(&self, values: &mut [Option<BoardValue>], names: &[String]) -> Result<bool, String> {
        let value = self.evaluate(values, names)?;
        value.truth().ok_or_else(|| {
            format!("script `{}`: expected a condition such as `x > 1`, found the text '{value}'", self.text)
        })
    }
}

fn evaluate(
    expression: &Expression,
    values: &mut [Option<BoardValue>],
    names: &[String],
) -> Result<BoardValue, String> {
    Ok(match expression {
        Expression::Number(number) => BoardValue::Number(*number),
        Expression::Text(text) => BoardValue::Text(text.clone()),
        Expression::Entry(slot) => values[*slot].clone().ok_or_else(|| {
            format!("the entry `{}` has no value yet; set it before, such as by `:=`", names[*slot])
        })?,
        Expression::Negation(inner) => BoardValue::Number(-number(&evaluate(inner, values, names)?, "-")?),
        Expression::Not(inner) => truth(!is_true(&evaluate(inner, values, names)?, "!")?),
        Expression::Binary(parts, operator) => {
            let left = evaluate(&parts[0], values, names)?;
            let right = evaluate(&parts[1], values, names)?;
            binary(left, *operator, right)?
        }
        Expression::Comparison(first, others) => {
            let mut left = evaluate(first, values, names)?;
            for (operator, right) in others {
                let right = evaluate(right, values, names)?;
                if !compare(&left, *operator, &right)? {
                    return Ok(truth(false));
                }
                left = right;
            }
            truth(true)
        }
        Expression::Choice(parts) => {
            let holds = is_true(&evaluate(&parts[0], values, names)?, "?")?;
            evaluate(&parts[if holds { 1 } else { 2 }], values, names)?
        }
        Expression::Assignment(slot, operator, value) => {
            let value = evaluate(value, values, names)?;
            assign(*slot, *operator, value, values, names)?
        }
    })
}

fn binary(left: BoardValue, operator: BinaryOperator, right: BoardValue) -> Result<BoardValue, String> {
    use BoardValue::{Number, Text};
    match (&left, operator, &right) {
        (_, BinaryOperator::Join, _) | (Text(_), BinaryOperator::Plus, Text(_)) => {
            return join(&left, &right);
        }
        (_, BinaryOperator::And, _) => return Ok(truth(is_true(&left, "&&")? & is_true(&right, "&&")?)),
        (_, BinaryOperator::Or, _) => return Ok(truth(is_true(&left, "||")? | is_true(&right, "||")?)),
        _ => {}
    }
    let sign = match operator {
        BinaryOperator::Plus => "+",
        BinaryOperator::Minus => "-",
        BinaryOperator::Times => "*",
        _ => "/",
    };
    let (left, right) = (number(&left, sign)?, number(&right, sign)?);
    finite(match operator {
        BinaryOperator::Plus => left + right,
        BinaryOperator::Minus => left - right,
        BinaryOperator::Times => left * right,
        _ => left / right,
    })
    .map(Number)
}

fn compare(left: &BoardValue, operator: ComparisonOperator, right: &BoardValue) -> Result<bool, String> {
    use ComparisonOperator::{AtLeast, AtMost, Equal, Greater, Less, Unequal};
    if let (BoardValue::Text(left), BoardValue::Text(right)) = (left, right) {
        return Ok(match operator {
            Equal => left == right,
            Unequal => left != right,
            Less => left < right,
            Greater => left > right,
            AtMost => left <= right,
            AtLeast => left >= right,
        });
    }
    let number = |value: &BoardValue| {
        value.number().ok_or_else(|| format!("expected a number to compare with, found the text '{value}'"))
    };
    let (left, right) = (number(left)?, number(right)?);
    Ok(match operator {
        Equal => is_same_number(left, right),
        Unequal => !is_same_number(left, right),
        Less => left < right,
        Greater => left > right,
        AtMost => left <= right,
        AtLeast => left >= right,
    })
}

fn assign(
    slot: usize,
    operator: AssignmentOperator,
    value: BoardValue,
    values: &mut [Option<BoardValue>],
    names: &[String],
) -> Result<BoardValue, String> {
    let name = &names[slot];
    let operator = match operator {
        AssignmentOperator::Create => None,
        _ if values[slot].is_none() => {
            return Err(format!("the entry `{name}` doesn't exist; use `:=` to make it"));
        }
        AssignmentOperator::Set => None,
        AssignmentOperator::Add => Some(BinaryOperator::Plus),
        AssignmentOperator::Subtract => Some(BinaryOperator::Minus),
        AssignmentOperator::Multiply => Some(BinaryOperator::Times),
        AssignmentOperator::Divide => Some(BinaryOperator::Divide),
    };
    let value = match (operator, &values[slot]) {
        (Some(operator), Some(old)) => binary(old.clone(), operator, value)?,
        _ => value,
    };
    let value = keep_type(values[slot].as_ref(), value)
        .map_err(|value| format!("the entry `{name}` is a number, expected one, found the text '{value}'"))?;
    values[slot] = Some(value.clone());
    Ok(value)
}

/// An entry keeps the type of its first value; returns a text that is no number.
pub(crate) fn keep_type(old: Option<&BoardValue>, value: BoardValue) -> Result<BoardValue, BoardValue> {
    match (old, value) {
        (Some(BoardValue::Number(_)), value @ BoardValue::Text(_)) => match value.number() {
            Some(number) => Ok(BoardValue::Number(number)),
            None => Err(value),
        },
        (Some(BoardValue::Text(_)), BoardValue::Number(number)) => Ok(BoardValue::Text(number.to_string())),
        (_, value) => Ok(value),
    }
}

fn join(left: &BoardValue, right: &BoardValue) -> Result<BoardValue, String> {
    let text = format!("{left}{right}");
    match text.len() <= MOST_TEXT {
        true => Ok(BoardValue::Text(text)),
        false => Err(format!("expected a text of at most {MOST_TEXT} bytes")),
    }
}

fn number(value: &BoardValue, sign: &str) -> Result<f64, String> {
    match value {
        BoardValue::Number(number) => Ok(*number),
        BoardValue::Text(text) => Err(format!("expected a number for `{sign}`, found the text '{text}'")),
    }
}

fn is_true(value: &BoardValue, sign: &str) -> Result<bool, String> {
    Ok(number(value, sign)? != 0.0)
}

fn truth(holds: bool) -> BoardValue {
    BoardValue::Number(f64::from(u8::from(holds)))
}

fn finite(number: f64) -> Result<f64, String> {
    match number.is_finite() {
        true => Ok(number),
        false => Err("expected a finite result; check for a division by zero".into()),
    }
}
