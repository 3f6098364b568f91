//! Random theories and programs, as text of Golog and of Prolog.

use std::fmt::Write;

/// Codes of values other than numbers.
pub const FALSE: i32 = 100;
pub const TRUE: i32 = 101;
pub const SYMBOL: i32 = 200;

/// Types: numbers 0..2, symbols `p` and `q`, truth values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Number,
    Symbol,
    Truth,
}

impl Kind {
    pub fn values(self) -> &'static [i32] {
        match self {
            Self::Number => &[0, 1, 2],
            Self::Symbol => &[SYMBOL, SYMBOL + 1],
            Self::Truth => &[FALSE, TRUE],
        }
    }

    fn golog(self) -> &'static str {
        match self {
            Self::Number => "d",
            Self::Symbol => "s",
            Self::Truth => "bool",
        }
    }
}

pub fn value_text(value: i32) -> String {
    match value {
        FALSE => "false".into(),
        TRUE => "true".into(),
        200 => "p".into(),
        201 => "q".into(),
        number => number.to_string(),
    }
}

/// Fluents: name, type of the argument, type of the value.
pub const FLUENTS: [(&str, Option<Kind>, Kind); 5] = [
    ("n", None, Kind::Number),
    ("b", None, Kind::Truth),
    ("f", Some(Kind::Number), Kind::Truth),
    ("c", None, Kind::Symbol),
    ("u", None, Kind::Truth),
];

/// Actions: name and type of the argument; the last one senses `u`.
pub const ACTIONS: [(&str, Option<Kind>); 4] =
    [("go", None), ("put", Some(Kind::Number)), ("turn", Some(Kind::Symbol)), ("look", None)];

#[derive(Clone, Debug, PartialEq)]
pub enum Expr {
    Value(i32),
    Variable(u32),
    Fluent(usize, Vec<Expr>),
    Sum(Box<[Expr; 2]>),
    /// `==`, `!=`, `<` or `<=`.
    Compare(&'static str, Box<[Expr; 2]>),
    Not(Box<Expr>),
    Known(Box<Expr>),
    And(Vec<Expr>),
    Or(Vec<Expr>),
    /// Whether for all numbers.
    Quantified(bool, u32, Box<Expr>),
}

#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    Nil,
    Test(Expr),
    Act(usize, Vec<Expr>),
    /// The procedure `sub`.
    Call(Expr),
    Sequence(Vec<Step>),
    Choice(Vec<Step>),
    Pick(u32, Kind, Box<Step>),
    For(u32, Box<Step>),
    Repeat(Box<Step>),
    If(Expr, Box<[Step; 2]>),
    While(Expr, Box<Step>),
    Both(Box<[Step; 2]>),
    Priority(Box<[Step; 2]>),
    Each(Box<Step>),
    Interrupt(Expr, Box<Step>),
    Search(Box<Step>),
}

#[derive(Clone, Debug)]
pub struct Effect {
    /// Variable that it holds for all numbers of.
    pub all: Option<u32>,
    pub fluent: usize,
    pub arguments: Vec<Expr>,
    pub value: Expr,
    pub condition: Option<Expr>,
}

#[derive(Clone, Debug)]
pub struct Action {
    /// Its argument is the variable 0.
    pub possible: Option<Expr>,
    pub effects: Vec<Effect>,
}

#[derive(Clone, Debug)]
pub struct Problem {
    /// Values of `n`, `b`, `f(0)`, `f(1)`, `f(2)` and `c`; `u` is unknown.
    pub initial: [i32; 6],
    pub actions: Vec<Action>,
    /// Its argument is the variable 0, a number.
    pub sub: Step,
    pub main: Step,
}

/// Source of random numbers.
pub struct Random {
    state: u64,
    variables: u32,
}

impl Random {
    pub fn new(seed: u64) -> Self {
        Self { state: seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1, variables: 0 }
    }

    fn below(&mut self, limit: usize) -> usize {
        self.state ^= self.state << 13;
        self.state ^= self.state >> 7;
        self.state ^= self.state << 17;
        (self.state >> 33) as usize % limit
    }

    fn variable(&mut self) -> u32 {
        self.variables += 1;
        self.variables
    }

    pub fn problem(&mut self) -> Problem {
        let mut initial = [0; 6];
        for (at, kind) in [Kind::Number, Kind::Truth, Kind::Truth, Kind::Truth, Kind::Truth, Kind::Symbol]
            .iter()
            .enumerate()
        {
            initial[at] = kind.values()[self.below(kind.values().len())];
        }
        let actions = ACTIONS.iter().map(|(_, kind)| self.action(*kind)).collect();
        let scope = vec![(0, Kind::Number)];
        let head = self.act(&scope);
        let tail = self.step(2, &scope, true);
        let sub = Step::Sequence(vec![head, tail]);
        let main = self.step(4, &Vec::new(), true);
        Problem { initial, actions, sub, main }
    }

    fn action(&mut self, kind: Option<Kind>) -> Action {
        let scope: Vec<(u32, Kind)> = kind.iter().map(|kind| (0, *kind)).collect();
        let possible = (self.below(3) > 0).then(|| self.truth(2, &scope));
        let count = 1 + self.below(2);
        let effects = (0..count).map(|_| self.effect(&scope)).collect();
        Action { possible, effects }
    }

    fn effect(&mut self, scope: &[(u32, Kind)]) -> Effect {
        let mut scope = scope.to_vec();
        let fluent = self.below(4);
        let (_, argument, value) = FLUENTS[fluent];
        let all = (argument.is_some() && self.below(3) == 0).then(|| self.variable());
        scope.extend(all.map(|variable| (variable, Kind::Number)));
        let arguments = match all {
            Some(variable) => vec![Expr::Variable(variable)],
            None => argument.map(|kind| self.leaf(kind, &scope, false)).into_iter().collect(),
        };
        let value = self.leaf(value, &scope, true);
        let condition = (self.below(2) == 0).then(|| self.truth(1, &scope));
        Effect { all, fluent, arguments, value, condition }
    }

    /// A value of a type: a constant, a variable, or a fluent that is always known.
    fn leaf(&mut self, kind: Kind, scope: &[(u32, Kind)], with_fluents: bool) -> Expr {
        let variables: Vec<u32> = scope.iter().filter(|(_, own)| *own == kind).map(|(own, _)| *own).collect();
        if !variables.is_empty() && self.below(2) == 0 {
            return Expr::Variable(variables[self.below(variables.len())]);
        }
        if with_fluents && self.below(2) == 0 {
            let fluent = match kind {
                Kind::Number => 0,
                Kind::Symbol => 3,
                Kind::Truth => [1, 2, 4][self.below(3)],
            };
            let arguments = FLUENTS[fluent].1.map(|kind| self.leaf(kind, scope, false));
            return Expr::Fluent(fluent, arguments.into_iter().collect());
        }
        Expr::Value(kind.values()[self.below(kind.values().len())])
    }

    fn truth(&mut self, depth: usize, scope: &[(u32, Kind)]) -> Expr {
        let inner = depth.saturating_sub(1);
        match self.below(if depth == 0 { 4 } else { 10 }) {
            0 | 1 => self.leaf(Kind::Truth, scope, true),
            2 => {
                let kind = [Kind::Number, Kind::Symbol][self.below(2)];
                let sides = [self.leaf(kind, scope, true), self.leaf(kind, scope, true)];
                Expr::Compare(["==", "!="][self.below(2)], Box::new(sides))
            }
            3 => {
                let mut sides = [self.leaf(Kind::Number, scope, true), self.leaf(Kind::Number, scope, true)];
                if self.below(2) == 0 {
                    let [left, right] = sides;
                    let sum = Expr::Sum(Box::new([left, self.leaf(Kind::Number, scope, true)]));
                    sides = [sum, right];
                }
                Expr::Compare(["<", "<="][self.below(2)], Box::new(sides))
            }
            4 => Expr::Not(Box::new(self.truth(inner, scope))),
            5 => Expr::Known(Box::new(self.truth(inner, scope))),
            6 => Expr::And(vec![self.truth(inner, scope), self.truth(inner, scope)]),
            7 => Expr::Or(vec![self.truth(inner, scope), self.truth(inner, scope)]),
            other => {
                let variable = self.variable();
                let mut scope = scope.to_vec();
                scope.push((variable, Kind::Number));
                Expr::Quantified(other == 8, variable, Box::new(self.truth(inner, &scope)))
            }
        }
    }

    fn act(&mut self, scope: &[(u32, Kind)]) -> Step {
        let action = self.below(ACTIONS.len());
        let arguments = ACTIONS[action].1.map(|kind| self.leaf(kind, scope, true));
        Step::Act(action, arguments.into_iter().collect())
    }

    fn step(&mut self, depth: usize, scope: &[(u32, Kind)], calls: bool) -> Step {
        let inner = depth.saturating_sub(1);
        let pair = |own: &mut Self| Box::new([own.step(inner, scope, calls), own.step(inner, scope, calls)]);
        match self.below(if depth == 0 { 4 } else { 18 }) {
            0 | 1 => self.act(scope),
            2 => Step::Test(self.truth(2, scope)),
            3 if calls && self.below(2) == 0 => Step::Call(self.leaf(Kind::Number, scope, true)),
            3 => Step::Nil,
            4..=6 => {
                let count = 2 + self.below(2);
                Step::Sequence((0..count).map(|_| self.step(inner, scope, calls)).collect())
            }
            7 | 8 => Step::Choice((0..2).map(|_| self.step(inner, scope, calls)).collect()),
            9 => {
                let (variable, kind) = (self.variable(), [Kind::Number, Kind::Symbol][self.below(2)]);
                let mut scope = scope.to_vec();
                scope.push((variable, kind));
                Step::Pick(variable, kind, Box::new(self.step(inner, &scope, calls)))
            }
            10 => {
                let variable = self.variable();
                let mut scope = scope.to_vec();
                scope.push((variable, Kind::Number));
                Step::For(variable, Box::new(self.step(inner, &scope, calls)))
            }
            11 => Step::Repeat(Box::new(self.step(inner, scope, calls))),
            12 => Step::If(self.truth(2, scope), pair(self)),
            13 => Step::While(self.truth(2, scope), Box::new(self.step(inner, scope, calls))),
            14 => Step::Both(pair(self)),
            15 => Step::Priority(pair(self)),
            16 if self.below(2) == 0 => Step::Search(Box::new(self.step(inner, scope, calls))),
            16 => Step::Each(Box::new(self.step(inner, scope, calls))),
            _ => Step::Interrupt(self.truth(2, scope), Box::new(self.step(inner, scope, calls))),
        }
    }
}

impl Expr {
    pub fn golog(&self) -> String {
        let list = |parts: &[Self], word: &str| {
            format!("({})", parts.iter().map(Self::golog).collect::<Vec<_>>().join(word))
        };
        match self {
            Self::Value(value) => value_text(*value),
            Self::Variable(variable) => format!("x{variable}"),
            Self::Fluent(fluent, arguments) if arguments.is_empty() => FLUENTS[*fluent].0.into(),
            Self::Fluent(fluent, arguments) => format!("{}{}", FLUENTS[*fluent].0, list(arguments, ", ")),
            Self::Sum(sides) => format!("{} + {}", sides[0].golog(), sides[1].golog()),
            Self::Compare(sign, sides) => format!("({} {sign} {})", sides[0].golog(), sides[1].golog()),
            Self::Not(inner) => format!("(not {})", inner.golog()),
            Self::Known(inner) => format!("known ({})", inner.golog()),
            Self::And(parts) => list(parts, " and "),
            Self::Or(parts) => list(parts, " or "),
            Self::Quantified(is_all, variable, inner) => {
                format!("{} x{variable}: d ({})", if *is_all { "all" } else { "exists" }, inner.golog())
            }
        }
    }

    pub fn prolog(&self) -> String {
        match self {
            Self::Value(value) => value_text(*value),
            Self::Variable(variable) => format!("X{variable}"),
            Self::Fluent(fluent, arguments) => {
                format!("fl({}, {})", FLUENTS[*fluent].0, prolog_list(arguments))
            }
            Self::Sum(sides) => format!("sum({}, {})", sides[0].prolog(), sides[1].prolog()),
            Self::Compare(sign, sides) => {
                let name = match *sign {
                    "==" => "equal",
                    "!=" => "unequal",
                    "<" => "less",
                    _ => "at_most",
                };
                format!("{name}({}, {})", sides[0].prolog(), sides[1].prolog())
            }
            Self::Not(inner) => format!("neg({})", inner.prolog()),
            Self::Known(inner) => format!("known({})", inner.prolog()),
            Self::And(parts) => format!("conj({})", prolog_list(parts)),
            Self::Or(parts) => format!("disj({})", prolog_list(parts)),
            Self::Quantified(is_all, variable, inner) => {
                format!("{}(X{variable}, {})", if *is_all { "forall_d" } else { "exists_d" }, inner.prolog())
            }
        }
    }
}

fn prolog_list(parts: &[Expr]) -> String {
    format!("[{}]", parts.iter().map(Expr::prolog).collect::<Vec<_>>().join(", "))
}

impl Step {
    pub fn golog(&self) -> String {
        let call = |name: &str, arguments: &[Expr]| match arguments {
            [] => name.to_owned(),
            _ => format!("{name}({})", arguments.iter().map(Expr::golog).collect::<Vec<_>>().join(", ")),
        };
        let both = |sides: &[Self; 2], sign: &str| {
            format!("{{ {{ {} }} {sign} {{ {} }} }}", sides[0].golog(), sides[1].golog())
        };
        match self {
            Self::Nil => "nil".into(),
            Self::Test(formula) => format!("test {}", formula.golog()),
            Self::Act(action, arguments) => call(ACTIONS[*action].0, arguments),
            Self::Call(argument) => format!("sub({})", argument.golog()),
            Self::Sequence(steps) => {
                format!("{{ {} }}", steps.iter().map(Self::golog).collect::<Vec<_>>().join("; "))
            }
            Self::Choice(branches) => {
                let branches: Vec<String> =
                    branches.iter().map(|branch| format!("{{ {} }}", branch.golog())).collect();
                format!("{{ {} }}", branches.join(" | "))
            }
            Self::Pick(variable, kind, body) => {
                format!("pick x{variable}: {} {{ {} }}", kind.golog(), body.golog())
            }
            Self::For(variable, body) => format!("for x{variable}: d {{ {} }}", body.golog()),
            Self::Repeat(body) => format!("repeat {{ {} }}", body.golog()),
            Self::If(condition, sides) => {
                format!("if {} {{ {} }} else {{ {} }}", condition.golog(), sides[0].golog(), sides[1].golog())
            }
            Self::While(condition, body) => format!("while {} {{ {} }}", condition.golog(), body.golog()),
            Self::Both(sides) => both(sides, "||"),
            Self::Priority(sides) => both(sides, ">>"),
            Self::Each(body) => format!("parallel repeat {{ {} }}", body.golog()),
            Self::Interrupt(condition, body) => {
                format!("interrupt {} {{ {} }}", condition.golog(), body.golog())
            }
            Self::Search(body) => format!("search {{ {} }}", body.golog()),
        }
    }

    pub fn prolog(&self) -> String {
        let list = |steps: &[Self]| steps.iter().map(Self::prolog).collect::<Vec<_>>().join(", ");
        match self {
            Self::Nil => "nil".into(),
            Self::Test(formula) => format!("test({})", formula.prolog()),
            Self::Act(action, arguments) => {
                format!("act({}, {})", ACTIONS[*action].0, prolog_list(arguments))
            }
            Self::Call(argument) => format!("call({})", argument.prolog()),
            Self::Sequence(steps) => format!("seq([{}])", list(steps)),
            Self::Choice(branches) => format!("choice([{}])", list(branches)),
            Self::Pick(variable, kind, body) => {
                let values: Vec<String> = kind.values().iter().map(|value| value_text(*value)).collect();
                format!("pick(X{variable}, [{}], {})", values.join(", "), body.prolog())
            }
            Self::For(variable, body) => format!("for(X{variable}, [0, 1, 2], {})", body.prolog()),
            Self::Repeat(body) => format!("star({})", body.prolog()),
            Self::If(condition, sides) => {
                format!("if({}, {}, {})", condition.prolog(), sides[0].prolog(), sides[1].prolog())
            }
            Self::While(condition, body) => format!("while({}, {})", condition.prolog(), body.prolog()),
            Self::Both(sides) => format!("both({}, {})", sides[0].prolog(), sides[1].prolog()),
            Self::Priority(sides) => format!("prior({}, {})", sides[0].prolog(), sides[1].prolog()),
            Self::Each(body) => format!("each({})", body.prolog()),
            Self::Interrupt(condition, body) => {
                format!("interrupt({}, {})", condition.prolog(), body.prolog())
            }
            Self::Search(body) => format!("search({})", body.prolog()),
        }
    }
}

impl Problem {
    pub fn golog(&self) -> String {
        let value = |at: usize| value_text(self.initial[at]);
        let mut text = format!(
            "domain d = 0..2\ndomain s = p, q\nfluent n: d = {}\nfluent b = {}\nfluent f(d)\ninitially f(0) = {}, \
             f(1) = {}, f(2) = {}\nfluent c: s = {}\nfluent u\n",
            value(0),
            value(1),
            value(2),
            value(3),
            value(4),
            value(5)
        );
        for ((name, kind), action) in ACTIONS.iter().zip(&self.actions) {
            let parameter = kind.map_or(String::new(), |kind| format!("(x0: {})", kind.golog()));
            let _ = writeln!(text, "action {name}{parameter}");
            if let Some(possible) = &action.possible {
                let _ = writeln!(text, "  possible if {}", possible.golog());
            }
            if *name == "look" {
                text.push_str("  senses u\n");
            }
            for effect in &action.effects {
                let all = effect.all.map_or(String::new(), |variable| format!("all x{variable}: d: "));
                let target = Expr::Fluent(effect.fluent, effect.arguments.clone()).golog();
                let condition = effect
                    .condition
                    .as_ref()
                    .map_or(String::new(), |condition| format!(" if {}", condition.golog()));
                let _ = writeln!(text, "  {all}{target} becomes {}{condition}", effect.value.golog());
            }
        }
        let (sub, main) = (self.sub.golog(), self.main.golog());
        let _ = write!(text, "procedure sub(x0: d) {{ {sub} }}\nprocedure main {{ {main} }}\n");
        text
    }

    /// The problem as a fact `problem(Number, Initial, Actions, Procedure, Main)`.
    pub fn prolog(&self, number: usize) -> String {
        let initial = ["n-[]", "b-[]", "f-[0]", "f-[1]", "f-[2]", "c-[]"].iter().zip(self.initial);
        let mut initial: Vec<String> =
            initial.map(|(name, value)| format!("({name})={}", value_text(value))).collect();
        initial.push("(u-[])=unknown".into());
        let actions = ACTIONS.iter().zip(&self.actions).map(|((name, kind), action)| {
            let parameters = if kind.is_some() { "[X0]" } else { "[]" };
            let possible = action.possible.as_ref().map_or("true".into(), Expr::prolog);
            let effects = action.effects.iter().map(|effect| {
                let all = effect.all.map_or("none".into(), |variable| format!("all(X{variable})"));
                let condition = effect.condition.as_ref().map_or("true".into(), Expr::prolog);
                format!(
                    "effect({all}, {}, {}, {}, {condition})",
                    FLUENTS[effect.fluent].0,
                    prolog_list(&effect.arguments),
                    effect.value.prolog()
                )
            });
            let effects: Vec<String> = effects.collect();
            format!("action({name}, {parameters}, {possible}, [{}])", effects.join(", "))
        });
        let actions: Vec<String> = actions.collect();
        format!(
            "problem({number}, [{}], [{}], sub(X0, {}), {}).\n",
            initial.join(", "),
            actions.join(", "),
            self.sub.prolog(),
            self.main.prolog()
        )
    }
}
