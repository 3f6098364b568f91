//! From linear plans and execution rules to nets, as PNPgen does.

mod generate;
mod parse;

pub use generate::generate_net;
pub use parse::{parse_linear_plan, parse_rules};

/// An action of a linear plan.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearAction {
    /// Action with its arguments, such as `goto_printer`.
    pub action: String,
    /// Time after which the plan goes on without it, s.
    pub timeout: Option<f64>,
}

/// What a plan does when a condition holds while an action runs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExecutionRule {
    /// Guard, such as `and person close`.
    pub condition: String,
    /// Action, by its name or with its arguments.
    pub during: String,
    /// Actions that are performed instead.
    pub actions: Vec<String>,
    /// How the plan goes on afterwards.
    pub recovery: PlanRecovery,
}

/// How a plan goes on after an interruption.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlanRecovery {
    /// With the next action.
    SkipAction,
    /// With the interrupted action, from its start.
    RestartAction,
    /// With the first action.
    RestartPlan,
    /// Not at all: the plan has failed.
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
