use std::fmt;
use std::panic::Location;

/// All errors of a robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RobotErrors(pub Vec<RobotError>);

/// An error of a robot, with the line of the program that causes it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RobotError {
    /// Name of the robot.
    pub robot: String,
    /// Problem.
    pub problem: RobotProblem,
    /// Line of the program.
    pub place: &'static Location<'static>,
}

/// Problem of a robot.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RobotProblem {
    /// Second Plan, Execute or Knowledge of a robot, which has one of each.
    #[error("a robot has one {part}, and `{first}` in line {line} is it; remove `{second}`")]
    Second {
        /// Block that a robot has once.
        part: &'static str,
        /// The first one.
        first: String,
        /// Line of the first one.
        line: u32,
        /// The other one.
        second: String,
    },
    /// Two robots, modules or gates have the same name.
    #[error("the name `{name}` is taken by line {line}; choose another one")]
    SameName {
        /// The name.
        name: String,
        /// Line of the first one.
        line: u32,
    },
    /// Name that can't be part of a URL.
    #[error("`{name}` is not a name: expected letters, digits and `_`, such as `range_monitor`")]
    Name {
        /// The name.
        name: String,
    },
    /// Two kinds of modules have the same name.
    #[error("`{name}` and `{other}` have different code and the same kind `{kind}`; rename one kind")]
    SameKind {
        /// A module.
        name: String,
        /// Another module.
        other: String,
        /// Name of both kinds.
        kind: String,
    },
    /// Second source of an input, which reads one property.
    #[error("`{port}` reads `{first}` by line {line} and can't read `{second}` too")]
    TwoSources {
        /// The input.
        port: String,
        /// Present source.
        first: String,
        /// Line of the present source.
        line: u32,
        /// Second source.
        second: String,
    },
    /// Plan or ReactiveModel without an Execute.
    #[error("it has no Execute, which `{block}` needs; add one: .execute::<Actions>(\"execute\")")]
    NoExecute {
        /// Block that sends actions.
        block: String,
    },
    /// The robot has no block of that name.
    #[error("it has no module `{name}`{}", did_you_mean(.near))]
    UnknownModule {
        /// The name.
        name: String,
        /// Similar names.
        near: Vec<String>,
    },
    /// The block of that name is of another kind.
    #[error("`{name}` has the kind `{found}`, expected `{expected}`")]
    OtherKind {
        /// The name.
        name: String,
        /// Kind of the block.
        found: String,
        /// Kind that was named with it.
        expected: &'static str,
    },
    /// The block has no such port.
    #[error("`{module}` has no port `{port}`{}", did_you_mean(.near))]
    UnknownPort {
        /// The module.
        module: String,
        /// The port.
        port: String,
        /// Similar names, or all.
        near: Vec<String>,
    },
    /// Value of an input with another interface.
    #[error("the input `{port}` expects {expected}, found {found}")]
    InputType {
        /// The input.
        port: String,
        /// Interface of the input.
        expected: &'static str,
        /// Interface of the value.
        found: &'static str,
    },
    /// A parameter is out of its range.
    #[error("the parameter `{parameter}` of `{module}` must be from {low} to {high}, found {value}")]
    Parameter {
        /// The module.
        module: String,
        /// The parameter.
        parameter: String,
        /// Value of the parameter.
        value: String,
        /// Least value.
        low: String,
        /// Greatest value.
        high: String,
    },
    /// A duration can't be read.
    #[error("expected a duration such as \"200ms\", found \"{text}\"")]
    Duration {
        /// The text.
        text: String,
    },
    /// The commander of a gate has no port, or several, for its command.
    #[error("`{module}` has {count} ports that command {interface}, and the gate `{gate}` needs one")]
    Commands {
        /// The gate.
        gate: String,
        /// The commander.
        module: String,
        /// Number of ports.
        count: usize,
        /// Interface of the command.
        interface: &'static str,
    },
    /// The command of a gate has no such field.
    #[error("the command {interface} of the gate `{gate}` has no field `{field}`{}", did_you_mean(.near))]
    Field {
        /// The gate.
        gate: String,
        /// Interface of the command.
        interface: &'static str,
        /// The field.
        field: String,
        /// Similar names, or all.
        near: Vec<String>,
    },
    /// The limits of a field permit nothing, or not the safe command.
    #[error(
        "the limits of `{field}` at the gate `{gate}`, {low} to {high}, must contain the safe value {safe}"
    )]
    Limits {
        /// The gate.
        gate: String,
        /// The field.
        field: String,
        /// Least value.
        low: String,
        /// Greatest value.
        high: String,
        /// Value of the safe command.
        safe: String,
    },
    /// A rate limit permits no change.
    #[error("the rate limit of `{field}` at the gate `{gate}` must be above zero")]
    RateLimit {
        /// The gate.
        gate: String,
        /// The field.
        field: String,
    },
    /// A block refuses to be set up.
    #[error("`{module}` can't be set up: {reason}")]
    Refused {
        /// The module.
        module: String,
        /// Reason of the refusal.
        reason: String,
    },
}

fn did_you_mean(near: &[String]) -> String {
    match near {
        [] => String::new(),
        near => {
            let names: Vec<_> = near.iter().map(|name| format!("`{name}`")).collect();
            format!("; did you mean {}?", names.join(" or "))
        }
    }
}

impl fmt::Display for RobotError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { robot, problem, place } = self;
        write!(f, "{}:{}: robot `{robot}`: {problem}", place.file(), place.line())
    }
}

impl fmt::Display for RobotErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, error) in self.0.iter().enumerate() {
            write!(f, "{}{error}", if index == 0 { "" } else { "\n" })?;
        }
        Ok(())
    }
}

impl std::error::Error for RobotError {}

impl std::error::Error for RobotErrors {}
