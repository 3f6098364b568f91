use slate_module::{Bool, Sequence, Text, interface};

use crate::ActionRequest;

/// Role of a robot.
#[interface]
#[derive(PartialEq)]
pub struct Role {
    /// Name, such as `defender`; empty for none.
    pub name: Text<28>,
}

/// Description of a plan, for Knowledge and Plan.
#[interface]
#[derive(PartialEq)]
pub struct PlanDescription {
    /// Name; empty for no plan.
    pub name: Text<28>,
    /// Role of the plan.
    pub role: Text<28>,
    /// Actions in sequence.
    pub actions: Sequence<ActionRequest, 8>,
}

/// Plans to choose from.
#[interface]
pub struct PlanLibrary {
    /// Plans in order of preference if equally promising.
    pub plans: Sequence<PlanDescription, 8>,
}

/// Outcome of a plan.
#[interface]
#[derive(PartialEq)]
pub struct PlanOutcome {
    /// Duration.
    #[unit("s")]
    pub seconds: f64,
    /// Name of the plan.
    pub name: Text<28>,
    /// Role of the plan.
    pub role: Text<28>,
    /// Success of the plan.
    pub success: Bool,
}
