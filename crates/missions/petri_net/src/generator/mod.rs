//! Net generation from linear plans and execution rules, as PNPgen.

mod generate;
mod parse;

pub use generate::generate_net;
pub use parse::{parse_linear_plan, parse_rules};

/// Action of a linear plan.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearAction {
    /// Action with its arguments, such as `goto_printer`.
    pub action: String,
    /// Time after which the plan continues without the action, s.
    pub timeout: Option<f64>,
}

/// Reaction of a plan to a condition while an action runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExecutionRule {
    /// Guard, such as `and person close`.
    pub condition: String,
    /// Action, by its name or with its arguments.
    pub during: String,
    /// Actions that are performed instead.
    pub actions: Vec<String>,
    /// Continuation of the plan after the reaction.
    pub recovery: PlanRecovery,
}

/// Continuation of a plan after an interruption.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlanRecovery {
    /// Continuation with the next action.
    SkipAction,
    /// Continuation with the interrupted action, from its start.
    RestartAction,
    /// Continuation with the first action.
    RestartPlan,
    /// Failure of the plan.
    FailPlan,
}

impl PlanRecovery {
    const ALL: [Self; 4] = [Self::SkipAction, Self::RestartAction, Self::RestartPlan, Self::FailPlan];

    /// Returns the word in rules.
    pub fn word(self) -> &'static str {
        match self {
            Self::SkipAction => "skip_action",
            Self::RestartAction => "restart_action",
            Self::RestartPlan => "restart_plan",
            Self::FailPlan => "fail_plan",
        }
    }
}
