//! Errors of the bridge to monitors.

use slate_runtime::configuration::{Configuration, Diagnostic, Report, Span};

/// Error of the bridge to monitors of behavior trees.
#[derive(Debug, thiserror::Error)]
pub enum GrootError {
    /// No Plan follows a behavior tree.
    #[error("no Plan of this agent follows a behavior tree, so [groot] has nothing to show")]
    NoTree,
    /// The Plans have no ports yet.
    #[error("{} Plans follow behavior trees, and each needs a port: {}", .0.len(), .0.join(", "))]
    SeveralTrees(Vec<String>),
    /// Module that follows no tree.
    #[error("`{plan}` is no Plan that follows a behavior tree{}", known_plans(.known))]
    UnknownPlan {
        /// Path of the module.
        plan: String,
        /// Plans that do.
        known: Vec<String>,
        /// Place in the configuration.
        place: Span,
    },
    /// The port can't be had.
    #[error("Groot can't be served at {address}: {reason}")]
    Port {
        /// Address and port.
        address: String,
        /// Reason of the system.
        reason: std::io::Error,
    },
    /// No thread is left.
    #[error("the bridge to Groot can't be started: {0}")]
    System(#[from] std::io::Error),
}

impl GrootError {
    /// Returns help that resolves it.
    pub fn help(&self) -> String {
        match self {
            Self::NoTree => "add a Plan with kind = \"behavior_tree_plan\"; or take [groot] away".into(),
            Self::SeveralTrees(plans) => {
                let line = |(number, plan): (usize, &String)| format!("\"{plan}\" = {}", 1667 + 2 * number);
                let lines: Vec<String> = plans.iter().enumerate().map(line).collect();
                format!("write [groot] ports = {{ {} }}", lines.join(", "))
            }
            Self::UnknownPlan { .. } => {
                "name a module of kind \"behavior_tree_plan\", such as \"r2/planner\"".into()
            }
            Self::Port { .. } => {
                "choose another port: [groot] port = 1677; port 0 is any that is free".into()
            }
            Self::System(_) => "end other programs, or raise the limit of threads: ulimit -u".into(),
        }
    }

    /// Returns the error with file, line and help.
    /// `configuration` must be the one that the settings came from.
    pub fn report(&self, configuration: &Configuration) -> Report {
        let (message, help) = (self.to_string(), Some(self.help()));
        let place = match self {
            Self::UnknownPlan { place, .. } => Some(*place),
            _ => configuration.value(crate::TABLE).map(|table| table.span),
        };
        Report::from(match place {
            Some(span) => configuration.diagnostic(span, message, help),
            None => Diagnostic::without_place(message, help),
        })
    }
}

fn known_plans(plans: &[String]) -> String {
    if plans.is_empty() { String::new() } else { format!("; available: {}", plans.join(", ")) }
}
