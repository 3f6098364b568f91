//! Syntax tree of declarations, expressions and programs.

/// Range of bytes in the text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TextRange {
    pub start: usize,
    pub end: usize,
}

impl TextRange {
    /// Returns the range from this one to the end of another.
    pub fn to(self, other: Self) -> Self {
        Self { start: self.start, end: other.end.max(self.start) }
    }
}

#[derive(Clone, Debug)]
pub(crate) struct WrittenName {
    pub text: String,
    pub range: TextRange,
}

/// Type in a declaration.
#[derive(Clone, Debug)]
pub(crate) enum WrittenType {
    /// Name of a domain, or `bool`.
    Named(WrittenName),
    Range(i32, i32, TextRange),
}

/// Variable with its type.
#[derive(Clone, Debug)]
pub(crate) struct WrittenVariable {
    pub name: WrittenName,
    pub domain: WrittenType,
}

#[derive(Clone, Debug)]
pub(crate) struct WrittenExpression {
    pub range: TextRange,
    pub kind: WrittenOperation,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WrittenOperator {
    Equal,
    Unequal,
    Less,
    AtMost,
    Greater,
    AtLeast,
    Plus,
    Minus,
}

#[derive(Clone, Debug)]
pub(crate) enum WrittenOperation {
    Number(i32),
    /// Number with a decimal point, an argument of the robot's action.
    Real(f64),
    /// Symbol, variable, fluent or defined fluent, with arguments.
    Name(WrittenName, Vec<WrittenExpression>),
    Not(Box<WrittenExpression>),
    Known(Box<WrittenExpression>),
    Negative(Box<WrittenExpression>),
    All(Vec<WrittenExpression>),
    Any(Vec<WrittenExpression>),
    Binary(WrittenOperator, Box<[WrittenExpression; 2]>),
    /// Quantifier: true for "for all", the variable, and the formula.
    Quantified(bool, WrittenVariable, Box<WrittenExpression>),
}

#[derive(Clone, Debug)]
pub(crate) struct WrittenProgram {
    pub range: TextRange,
    pub kind: WrittenStep,
}

#[derive(Clone, Debug)]
pub(crate) enum WrittenStep {
    Nil,
    Test(WrittenExpression),
    /// Action or procedure.
    Call(WrittenName, Vec<WrittenExpression>),
    Sequence(Vec<WrittenProgram>),
    Choice(Vec<WrittenProgram>),
    Pick(WrittenVariable, Box<WrittenProgram>),
    For(WrittenVariable, Box<WrittenProgram>),
    Repeat(Box<WrittenProgram>),
    If(WrittenExpression, Box<[WrittenProgram; 2]>),
    While(WrittenExpression, Box<WrittenProgram>),
    Concurrent(Box<[WrittenProgram; 2]>),
    Priority(Box<[WrittenProgram; 2]>),
    ParallelRepeat(Box<WrittenProgram>),
    Interrupt(WrittenExpression, Box<WrittenProgram>),
    Search(Box<WrittenProgram>),
}

/// `target becomes value if condition`, for all values of variables.
#[derive(Clone, Debug)]
pub(crate) struct WrittenEffect {
    pub variables: Vec<WrittenVariable>,
    pub fluent: WrittenName,
    pub arguments: Vec<WrittenExpression>,
    pub value: WrittenExpression,
    pub condition: Option<WrittenExpression>,
}

#[derive(Clone, Debug, Default)]
pub(crate) struct WrittenAction {
    pub is_exogenous: bool,
    pub possible: Option<WrittenExpression>,
    /// Action of the robot, with its arguments.
    /// One without a name is not an action of the robot.
    pub performs: Option<(Option<WrittenName>, Vec<WrittenExpression>)>,
    pub senses: Option<(WrittenName, Vec<WrittenExpression>)>,
    pub effects: Vec<WrittenEffect>,
    pub failure_effects: Vec<WrittenEffect>,
    /// True if a failure has effects, or is declared to have no effects.
    pub handles_failure: bool,
}

#[derive(Clone, Debug)]
pub(crate) enum WrittenContent {
    Mission,
    Symbols(Vec<WrittenName>),
    Range(i32, i32),
    Table { domains: Vec<WrittenType>, entries: Vec<(Vec<WrittenExpression>, f64)> },
    Fluent { domains: Vec<WrittenType>, value_type: Option<WrittenType>, initial: Option<WrittenExpression> },
    Condition { domains: Vec<WrittenType>, initial: Option<WrittenExpression> },
    Initially { arguments: Vec<WrittenExpression>, value: WrittenExpression },
    Define { variables: Vec<WrittenVariable>, formula: WrittenExpression },
    Action { variables: Vec<WrittenVariable>, action: Box<WrittenAction> },
    Procedure { variables: Vec<WrittenVariable>, body: WrittenProgram },
}

/// Declaration of the theory, with the name that it declares.
#[derive(Clone, Debug)]
pub(crate) struct WrittenDeclaration {
    pub name: WrittenName,
    pub content: WrittenContent,
}
