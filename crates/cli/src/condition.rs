//! Conditions on a value, such as `range < 0.5 and state == WORKING`.

use std::fmt;
use std::str::FromStr;

use serde_json::Value;

/// Condition in disjunctive form: one group must hold, with all its tests.
#[derive(Clone, Debug, PartialEq)]
pub struct Condition(Vec<Vec<Test>>);

/// Comparison of a field.
#[derive(Clone, Debug, PartialEq)]
struct Test {
    /// Empty for the whole value.
    path: Vec<String>,
    operator: Operator,
    operand: Operand,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Operator {
    Equal,
    Unequal,
    AtMost,
    AtLeast,
    Less,
    Greater,
}

#[derive(Clone, Debug, PartialEq)]
enum Operand {
    Number(f64),
    Text(String),
    Bool(bool),
}

/// Operators; a longer one precedes its prefix.
const OPERATORS: [(&str, Operator); 6] = [
    ("==", Operator::Equal),
    ("!=", Operator::Unequal),
    ("<=", Operator::AtMost),
    (">=", Operator::AtLeast),
    ("<", Operator::Less),
    (">", Operator::Greater),
];

const CONDITION_HELP: &str = "expected FIELD OPERATOR VALUE, such as `range < 0.5`, `state == WORKING` or `> 3`; \
                        join several by `and` and `or`";

impl FromStr for Condition {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut groups = vec![Vec::new()];
        for token in tokens(text)? {
            match &token {
                ConditionToken::Bare(bare) if bare == "or" || bare == "||" => groups.push(Vec::new()),
                ConditionToken::Bare(bare) if bare == "and" || bare == "&&" => {
                    if let Some(group) = groups.last_mut() {
                        group.push(Vec::new());
                    }
                }
                _ => {
                    let Some(group) = groups.last_mut() else { continue };
                    if group.is_empty() {
                        group.push(Vec::new());
                    }
                    if let Some(test) = group.last_mut() {
                        test.push(token);
                    }
                }
            }
        }
        let group = |tests: Vec<Vec<ConditionToken>>| match tests.is_empty() {
            true => Err(CONDITION_HELP.to_owned()),
            false => tests.into_iter().map(test).collect::<Result<Vec<_>, _>>(),
        };
        Ok(Self(groups.into_iter().map(group).collect::<Result<_, _>>()?))
    }
}

/// Token of a condition.
#[derive(Clone, Debug, PartialEq)]
enum ConditionToken {
    Bare(String),
    Quoted(String),
    Operator(Operator),
}

fn tokens(text: &str) -> Result<Vec<ConditionToken>, String> {
    let mut tokens = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        if first == '"' || first == '\'' {
            let end = rest[1..].find(first).ok_or("a quote is not closed")?;
            tokens.push(ConditionToken::Quoted(rest[1..=end].to_owned()));
            rest = &rest[end + 2..];
        } else if let Some((sign, operator)) = OPERATORS.iter().find(|(sign, _)| rest.starts_with(sign)) {
            tokens.push(ConditionToken::Operator(*operator));
            rest = &rest[sign.len()..];
        } else {
            let ends = |c: char| c.is_whitespace() || "<>=!\"'".contains(c);
            // A sign alone that is no operator.
            let end = rest.find(ends).filter(|end| *end > 0);
            let end = end.unwrap_or_else(|| if ends(first) { first.len_utf8() } else { rest.len() });
            tokens.push(ConditionToken::Bare(rest[..end].to_owned()));
            rest = &rest[end..];
        }
        rest = rest.trim_start();
    }
    Ok(tokens)
}

fn test(tokens: Vec<ConditionToken>) -> Result<Test, String> {
    let (path, operator, operand) = match &tokens[..] {
        [ConditionToken::Operator(operator), operand] => (Vec::new(), *operator, operand),
        [
            ConditionToken::Bare(path) | ConditionToken::Quoted(path),
            ConditionToken::Operator(operator),
            operand,
        ] => {
            let path = path.split(['/', '.']).filter(|name| !name.is_empty());
            (path.map(String::from).collect(), *operator, operand)
        }
        _ => return Err(CONDITION_HELP.into()),
    };
    let operand = match operand {
        ConditionToken::Quoted(text) => Operand::Text(text.clone()),
        ConditionToken::Bare(text) => match (text.parse(), text.as_str()) {
            (_, "true") => Operand::Bool(true),
            (_, "false") => Operand::Bool(false),
            (Ok(number), _) => Operand::Number(number),
            (Err(_), text) => Operand::Text(text.into()),
        },
        ConditionToken::Operator(_) => return Err(CONDITION_HELP.into()),
    };
    let is_ordered = matches!(operand, Operand::Number(_));
    if !is_ordered && !matches!(operator, Operator::Equal | Operator::Unequal) {
        return Err(format!("{operand} is not a number: expected == or !="));
    }
    Ok(Test { path, operator, operand })
}

/// Reason why a condition can't be evaluated on a value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ConditionError {
    /// The value has no such field.
    NoField(String),
    /// The field can't be compared so.
    NotComparable(String),
}

impl fmt::Display for ConditionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Self::NoField(text) | Self::NotComparable(text)) = self;
        f.write_str(text)
    }
}

impl Condition {
    /// Returns whether the condition holds for a value.
    ///
    /// # Errors
    /// When it has no such field, or one that can't be compared so.
    pub fn holds(&self, value: &Value) -> Result<bool, ConditionError> {
        let mut holds = false;
        for group in &self.0 {
            let mut all = true;
            for test in group {
                all &= test.holds(value)?;
            }
            holds |= all;
        }
        Ok(holds)
    }
}

impl Test {
    fn holds(&self, value: &Value) -> Result<bool, ConditionError> {
        let mut found = value;
        for name in &self.path {
            let next = match found {
                Value::Array(items) => name.parse().ok().and_then(|index: usize| items.get(index)),
                // A wrapped value, such as `enabled`, counts as its content.
                other => other.get(name),
            };
            found = next.ok_or_else(|| {
                let names: Vec<_> = found.as_object().into_iter().flat_map(|fields| fields.keys()).collect();
                let names: Vec<&str> = names.iter().map(|name| name.as_str()).collect();
                let known = if names.is_empty() { "no fields".into() } else { names.join(", ") };
                ConditionError::NoField(format!("unknown field `{}`; it has {known}", self.path.join("/")))
            })?;
        }
        // A wrapped value, such as `enabled`, counts as its content.
        if let (true, Some(inner)) =
            (found.as_object().is_some_and(|fields| fields.len() == 1), found.get("value"))
        {
            found = inner;
        }
        let order = match (&self.operand, found) {
            (Operand::Number(operand), Value::Number(number)) => {
                number.as_f64().and_then(|number| number.partial_cmp(operand))
            }
            // NaN is unequal to all.
            (Operand::Number(_), Value::Null | Value::String(_)) => None,
            (Operand::Text(operand), Value::String(text)) => Some(text.as_str().cmp(operand)),
            (Operand::Bool(operand), Value::Bool(found)) => Some(found.cmp(operand)),
            (operand, found) => {
                let place = if self.path.is_empty() {
                    "the value".into()
                } else {
                    format!("`{}`", self.path.join("/"))
                };
                let mut found = found.to_string();
                if found.chars().count() > 60 {
                    found = format!("{}…", found.chars().take(60).collect::<String>());
                }
                let text = format!("{place} is {found}, which can't be compared with {operand}");
                return Err(ConditionError::NotComparable(text));
            }
        };
        Ok(match self.operator {
            Operator::Equal => order.is_some_and(|order| order.is_eq()),
            Operator::Unequal => !order.is_some_and(|order| order.is_eq()),
            Operator::AtMost => order.is_some_and(|order| order.is_le()),
            Operator::AtLeast => order.is_some_and(|order| order.is_ge()),
            Operator::Less => order.is_some_and(|order| order.is_lt()),
            Operator::Greater => order.is_some_and(|order| order.is_gt()),
        })
    }
}

impl fmt::Display for Operand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Text(text) => write!(f, "`{text}`"),
            Self::Bool(on) => write!(f, "{on}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::json;

    use super::*;

    fn holds(condition: &str, value: &Value) -> Result<bool, String> {
        condition.parse::<Condition>()?.holds(value).map_err(|unfit| unfit.to_string())
    }

    #[test]
    fn fields_are_compared_with_numbers_texts_and_truth_values() {
        let value =
            json!({"x": 1.5, "state": "WORKING", "on": true, "pose": {"theta": -2}, "ranges": [0.2, 3]});
        for condition in [
            "x > 1",
            "x>=1.5",
            "x != 2",
            "state == WORKING",
            "state == \"WORKING\"",
            "on == true",
            "pose/theta < 0",
            "pose.theta == -2",
            "ranges/0 < 0.5",
            "x < 0 or state == WORKING",
            "x < 0 and x > 0 or on != false",
        ] {
            assert_eq!(holds(condition, &value), Ok(true), "{condition}");
        }
        for condition in ["x > 2", "state != WORKING", "x > 1 and x > 2", "x > 1 && on == false"] {
            assert_eq!(holds(condition, &value), Ok(false), "{condition}");
        }
        assert_eq!(holds("> 3", &json!(4)), Ok(true));
        assert_eq!(holds("== true", &json!({"value": true})), Ok(true));
    }

    #[test]
    fn incomparable_interfaces_are_reported() {
        let value = json!({"x": 1.5, "pose": {"theta": 2}});
        assert!(holds("y > 1", &value).unwrap_err().contains("it has pose, x"));
        assert!(holds("pose > 1", &value).unwrap_err().contains("can't be compared with 1"));
        for condition in
            ["", "x", "x >", "> > 1", "x 1", "x > 1 and", "or", "x = 1", "state < WORKING", "x == 'a"]
        {
            assert!(condition.parse::<Condition>().is_err(), "{condition}");
        }
    }

    proptest! {
        #[test]
        fn no_text_makes_it_fall(text in ".{0,40}", value in -10.0..10.0f64) {
            if let Ok(condition) = text.parse::<Condition>() {
                let _ = condition.holds(&json!({"x": value, "y": [value]}));
            }
        }

        #[test]
        fn a_number_is_compared_as_numbers_are(found in -100.0..100.0f64, operand in -100.0..100.0f64) {
            let value = json!({ "x": found });
            prop_assert_eq!(holds(&format!("x < {operand}"), &value), Ok(found < operand));
            prop_assert_eq!(holds(&format!("x >= {operand}"), &value), Ok(found >= operand));
            prop_assert_eq!(holds(&format!("x<{operand} or x>={operand}"), &value), Ok(true));
        }
    }
}
