//! Guards of transitions.

use std::fmt;

/// Deepest nesting of a guard.
const DEPTH: usize = 64;

/// Boolean expression over conditions.
/// An atom, `and a b`, `or a b`, `not a`, with brackets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum NetGuard {
    /// Condition that the host answers.
    Condition(usize),
    /// Property of an action of the net, such as `goto_1_2.finished`.
    Action(usize, ActionQuery),
    /// Conjunction.
    And(Vec<NetGuard>),
    /// Disjunction.
    Or(Vec<NetGuard>),
    /// Negation.
    Not(Box<NetGuard>),
}

/// Property of an action that a guard reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ActionQuery {
    /// The action has succeeded.
    Finished,
    /// The action has failed.
    Failed,
    /// The action was preempted by the robot.
    Preempted,
    /// The action runs.
    Running,
}

impl ActionQuery {
    pub(crate) fn parse(word: &str) -> Option<Self> {
        Some(match word {
            "finished" => Self::Finished,
            "failed" => Self::Failed,
            "preempted" => Self::Preempted,
            "running" => Self::Running,
            _ => return None,
        })
    }

    /// Returns the word in guards.
    pub fn word(self) -> &'static str {
        match self {
            Self::Finished => "finished",
            Self::Failed => "failed",
            Self::Preempted => "preempted",
            Self::Running => "running",
        }
    }
}

impl NetGuard {
    /// Evaluates the guard; `None` is unknown.
    /// A conjunction with a false operand is false in spite of an unknown one.
    pub fn evaluate(&self, value: &mut impl FnMut(&NetGuard) -> Option<bool>) -> Option<bool> {
        match self {
            Self::Condition(_) | Self::Action(..) => value(self),
            Self::Not(operand) => operand.evaluate(value).map(|value| !value),
            Self::And(operands) => all(operands, value, false),
            Self::Or(operands) => all(operands, value, true),
        }
    }

    /// Calls `visit` for each atom.
    pub fn atoms(&self, visit: &mut impl FnMut(&NetGuard)) {
        match self {
            Self::Condition(_) | Self::Action(..) => visit(self),
            Self::Not(operand) => operand.atoms(visit),
            Self::And(operands) | Self::Or(operands) => {
                operands.iter().for_each(|operand| operand.atoms(visit));
            }
        }
    }
}

/// Returns Kleene's conjunction, or disjunction if `decisive` is true.
fn all(
    operands: &[NetGuard],
    value: &mut impl FnMut(&NetGuard) -> Option<bool>,
    decisive: bool,
) -> Option<bool> {
    let mut result = Some(!decisive);
    for operand in operands {
        match operand.evaluate(value) {
            Some(value) if value == decisive => return Some(decisive),
            Some(_) => {}
            None => result = None,
        }
    }
    result
}

/// Parses a guard without its square brackets.
/// `atom` converts a word to an atom.
pub(crate) fn parse_guard(
    text: &str,
    mut atom: impl FnMut(&str) -> Result<NetGuard, String>,
) -> Result<NetGuard, String> {
    let words = words(text);
    let mut parser = Parser { words: &words, at: 0, atom: &mut atom };
    let guard = parser.expression(0)?;
    match parser.words.get(parser.at) {
        None => Ok(guard),
        Some(word) => Err(format!(
            "expected the end of the guard `{}`, found `{word}`; operators stand before their operands, such as `and a b`",
            text.trim()
        )),
    }
}

/// Splits at white space and brackets.
fn words(text: &str) -> Vec<&str> {
    let mut words = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        let is_end = |sign: char| sign.is_whitespace() || sign == '(' || sign == ')';
        let length = match first {
            '(' | ')' => 1,
            _ => rest.find(is_end).unwrap_or(rest.len()),
        };
        words.push(&rest[..length]);
        rest = rest[length..].trim_start();
    }
    words
}

struct Parser<'a, A> {
    words: &'a [&'a str],
    at: usize,
    atom: &'a mut A,
}

impl<A: FnMut(&str) -> Result<NetGuard, String>> Parser<'_, A> {
    fn expression(&mut self, depth: usize) -> Result<NetGuard, String> {
        if depth > DEPTH {
            return Err(format!("expected a guard of at most {DEPTH} levels, found a deeper one"));
        }
        let word = self.words.get(self.at).ok_or("expected a condition, found the end of the guard")?;
        self.at += 1;
        match *word {
            "(" => {
                let inner = self.expression(depth + 1)?;
                match self.words.get(self.at) {
                    Some(&")") => self.at += 1,
                    Some(word) => return Err(format!("expected `)` in the guard, found `{word}`")),
                    None => return Err("expected `)`, found the end of the guard".into()),
                }
                Ok(inner)
            }
            ")" => Err("expected a condition, found `)`".into()),
            "not" => Ok(NetGuard::Not(Box::new(self.expression(depth + 1)?))),
            "and" => Ok(NetGuard::And(self.operands(depth + 1)?)),
            "or" => Ok(NetGuard::Or(self.operands(depth + 1)?)),
            word => (self.atom)(word),
        }
    }

    /// Operands up to a closing bracket or the end, at least one.
    fn operands(&mut self, depth: usize) -> Result<Vec<NetGuard>, String> {
        let mut operands = vec![self.expression(depth)?];
        while self.words.get(self.at).is_some_and(|word| *word != ")") {
            operands.push(self.expression(depth)?);
        }
        Ok(operands)
    }
}

/// Writes a guard; made by [`PetriNet::guard_text`](crate::PetriNet::guard_text).
pub(crate) struct GuardText<'a> {
    pub guard: &'a NetGuard,
    pub conditions: &'a [String],
    pub actions: &'a [String],
}

impl<'a> GuardText<'a> {
    fn of(&self, guard: &'a NetGuard) -> Self {
        Self { guard, conditions: self.conditions, actions: self.actions }
    }

    fn operands(
        &self,
        formatter: &mut fmt::Formatter<'_>,
        word: &str,
        operands: &'a [NetGuard],
    ) -> fmt::Result {
        write!(formatter, "({word}")?;
        operands.iter().try_for_each(|operand| write!(formatter, " {}", self.of(operand)))?;
        write!(formatter, ")")
    }
}

impl fmt::Display for GuardText<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.guard {
            NetGuard::Condition(index) => write!(formatter, "{}", self.conditions[*index]),
            NetGuard::Action(index, query) => write!(formatter, "{}.{}", self.actions[*index], query.word()),
            NetGuard::And(inner) => self.operands(formatter, "and", inner),
            NetGuard::Or(inner) => self.operands(formatter, "or", inner),
            NetGuard::Not(inner) => write!(formatter, "(not {})", self.of(inner)),
        }
    }
}
