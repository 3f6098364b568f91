//! Scripts: a subset of the scripting language of BehaviorTree.CPP.

mod evaluate;
mod lexer;
mod parser;

pub(crate) use evaluate::{ScriptBoard, keep_type};
pub(crate) use parser::parse_script;

/// Parsed script, whose variables are slots of the tree's blackboards.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TreeScript {
    pub text: String,
    pub statements: Vec<Expression>,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Expression {
    Number(f64),
    Text(String),
    Entry(usize),
    Negation(Box<Expression>),
    Not(Box<Expression>),
    Complement(Box<Expression>),
    Binary(Box<[Expression; 2]>, BinaryOperator),
    /// `a < b <= c`: each with the one before.
    Comparison(Box<Expression>, Vec<(ComparisonOperator, Expression)>),
    /// Condition, value if it holds, value otherwise.
    Choice(Box<[Expression; 3]>),
    Assignment(usize, AssignmentOperator, Box<Expression>),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BinaryOperator {
    Plus,
    Minus,
    Times,
    Divide,
    Join,
    BitAnd,
    BitOr,
    BitXor,
    And,
    Or,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ComparisonOperator {
    Equal,
    Unequal,
    Less,
    Greater,
    AtMost,
    AtLeast,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AssignmentOperator {
    Create,
    Set,
    Add,
    Subtract,
    Multiply,
    Divide,
}
