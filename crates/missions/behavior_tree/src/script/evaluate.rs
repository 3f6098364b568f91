//! Evaluation of scripts.

use super::{AssignmentOperator, BinaryOperator, ComparisonOperator, Expression, TreeScript};
use crate::entries::EntryValues;
use crate::model::Enumerations;
use crate::value::{BoardValue, is_same_number};

/// Maximum length of a script's text, bytes.
const MOST_TEXT: usize = 64 << 10;
/// Greatest whole number up to which a float has all of them.
const MOST_EXACT: f64 = 9_007_199_254_740_992.0;

/// Blackboard access of scripts.
pub(crate) struct ScriptBoard<'a> {
    pub values: &'a mut EntryValues,
    pub names: &'a [String],
    pub enumerations: &'a Enumerations,
}

impl TreeScript {
    /// Evaluates the statements and returns the value of the last one.
    ///
    /// An error names the script.
    pub fn evaluate(&self, board: &mut ScriptBoard<'_>) -> Result<BoardValue, String> {
        let mut result = BoardValue::Number(0.0);
        for statement in &self.statements {
            result =
                evaluate(statement, board).map_err(|reason| format!("script `{}`: {reason}", self.text))?;
        }
        Ok(result)
    }

    /// Evaluates a condition.
    pub fn holds(&self, board: &mut ScriptBoard<'_>) -> Result<bool, String> {
        let value = self.evaluate(board)?;
        value.truth().ok_or_else(|| {
            format!("script `{}`: expected a condition such as `x > 1`, found the text '{value}'", self.text)
        })
    }
}

fn evaluate(expression: &Expression, board: &mut ScriptBoard<'_>) -> Result<BoardValue, String> {
    Ok(match expression {
        Expression::Number(number) => BoardValue::Number(*number),
        Expression::Text(text) => BoardValue::Text(text.clone()),
        Expression::Entry(slot) => board.values.get(*slot).cloned().ok_or_else(|| {
            format!("the entry `{}` has no value yet; set it before, such as by `:=`", board.names[*slot])
        })?,
        Expression::Negation(inner) => BoardValue::Number(-number(&evaluate(inner, board)?, "-")?),
        Expression::Complement(inner) => bits(!integer(&evaluate(inner, board)?, "~")?),
        Expression::Not(inner) => truth(!is_true(&evaluate(inner, board)?, "!")?),
        Expression::Binary(parts, operator) => {
            let left = evaluate(&parts[0], board)?;
            let right = evaluate(&parts[1], board)?;
            binary(left, *operator, right)?
        }
        Expression::Comparison(first, others) => {
            let mut left = evaluate(first, board)?;
            for (operator, right) in others {
                let right = evaluate(right, board)?;
                if !compare(&left, *operator, &right, board.enumerations)? {
                    return Ok(truth(false));
                }
                left = right;
            }
            truth(true)
        }
        Expression::Choice(parts) => {
            let holds = is_true(&evaluate(&parts[0], board)?, "?")?;
            evaluate(&parts[if holds { 1 } else { 2 }], board)?
        }
        Expression::Assignment(slot, operator, value) => {
            let value = evaluate(value, board)?;
            assign(*slot, *operator, value, board)?
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
        BinaryOperator::BitAnd => return Ok(bits(integer(&left, "&")? & integer(&right, "&")?)),
        BinaryOperator::BitOr => return Ok(bits(integer(&left, "|")? | integer(&right, "|")?)),
        BinaryOperator::BitXor => return Ok(bits(integer(&left, "^")? ^ integer(&right, "^")?)),
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

fn compare(
    left: &BoardValue,
    operator: ComparisonOperator,
    right: &BoardValue,
    enumerations: &Enumerations,
) -> Result<bool, String> {
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
        value
            .number_in(enumerations)
            .ok_or_else(|| format!("expected a number to compare with, found the text '{value}'"))
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
    board: &mut ScriptBoard<'_>,
) -> Result<BoardValue, String> {
    let name = &board.names[slot];
    let old = board.values.get(slot);
    let operator = match operator {
        AssignmentOperator::Create => None,
        _ if old.is_none() => {
            return Err(format!("the entry `{name}` doesn't exist; use `:=` to make it"));
        }
        AssignmentOperator::Set => None,
        AssignmentOperator::Add => Some(BinaryOperator::Plus),
        AssignmentOperator::Subtract => Some(BinaryOperator::Minus),
        AssignmentOperator::Multiply => Some(BinaryOperator::Times),
        AssignmentOperator::Divide => Some(BinaryOperator::Divide),
    };
    let value = match (operator, old) {
        (Some(operator), Some(old)) => binary(old.clone(), operator, value)?,
        _ => value,
    };
    let value = keep_type(old, value, board.enumerations)
        .map_err(|value| format!("the entry `{name}` is a number, expected one, found the text '{value}'"))?;
    board.values.set(slot, value.clone());
    Ok(value)
}

/// Converts a value to the type of an entry's first value.
/// Returns a text that is not a number as the error.
pub(crate) fn keep_type(
    old: Option<&BoardValue>,
    value: BoardValue,
    enumerations: &Enumerations,
) -> Result<BoardValue, BoardValue> {
    match (old, value) {
        (Some(BoardValue::Number(_)), value @ BoardValue::Text(_)) => match value.number_in(enumerations) {
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

/// Operators of bits need whole numbers.
fn integer(value: &BoardValue, sign: &str) -> Result<i64, String> {
    let number = number(value, sign)?;
    // Greater ones are not all whole numbers of 64 bits, and have lost their last bits.
    match number == (number as i64) as f64 && number.abs() <= MOST_EXACT {
        true => Ok(number as i64),
        false => Err(format!("expected a whole number for `{sign}`, found {number}")),
    }
}

fn bits(number: i64) -> BoardValue {
    BoardValue::Number(number as f64)
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
