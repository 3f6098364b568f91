use slate_module::{Input, Output, Queue, Sequence, Text, Tick, ports};
use slate_sorted::SortedSet;

use super::plans::{PlanDescription, PlanLibrary, PlanOutcome, Role};
use super::strategy::{StoredPlan, StrategyModel, StrategyReport};

/// Additional ports of the Knowledge of a robot with strategies.
#[ports]
pub struct StrategyPorts {
    /// Role of the robot, from the configuration or a role assignment.
    role: Input<Role>,
    /// Plans of all roles.
    library: Input<PlanLibrary>,
    /// Outcomes of plans, from the Plan.
    #[window(16)]
    outcomes: Queue<PlanOutcome>,
    /// Most promising plan of the role.
    /// Written initially, after a change of role or library, and after a failure: each time the Plan may begin with it.
    strategy: Output<PlanDescription>,
    /// Outcomes of all plans.
    report: Output<StrategyReport>,
}

impl StrategyModel {
    /// Updates from the inputs, and writes the outputs.
    pub fn update(&mut self, ports: &StrategyPorts, now: &Tick) {
        // Stored outcomes are reported in the first update.
        let (mut begins, mut changed) = (now.number() == 1, false);
        // The same role may be assigned repeatedly.
        if let Some(role) = ports.role.updated().filter(|role| role.name.as_str() != self.role()) {
            self.take_role(role.name.as_str());
            begins = true;
        }
        if let Some(library) = ports.library.updated() {
            for (index, plan) in library.plans.iter().enumerate() {
                let (name, role) = (plan.name, plan.role);
                if library.plans[..index].iter().any(|other| (other.name, other.role) == (name, role)) {
                    // Else each would replace the other one in every update.
                    now.error(format_args!(
                        "the library has two plans `{name}` for the role `{role}`, and the second one is left out: \
                         give it another name"
                    ));
                } else {
                    begins |= self.add_plan(name.as_str(), role.as_str(), &plan.actions);
                }
            }
        }
        for outcome in ports.outcomes.iter() {
            let (role, name) = (outcome.role.as_str(), outcome.name.as_str());
            changed |= self.record_for(role, name, outcome.success.get(), outcome.seconds);
            begins |= !outcome.success.get();
        }
        if begins {
            // Its value is all zero without a plan.
            let library = ports.library.get();
            let best = library.and_then(|library| self.best(library));
            if let (None, Some(library)) = (best, library) {
                warn_of_role(self.role(), library, now);
            }
            ports.strategy.set(best.map(StoredPlan::describe).unwrap_or_default());
        }
        if begins || changed {
            ports.report.set(self.report());
        }
    }
}

/// Warns that the library has no plan for a role.
fn warn_of_role(role: &str, library: &PlanLibrary, now: &Tick) {
    if role.is_empty() || library.plans.is_empty() {
        return;
    }
    let roles: SortedSet<_> = library.plans.iter().map(|plan| plan.role.as_str()).collect();
    let roles: Vec<_> = roles.into_iter().collect();
    now.warn(format_args!("no plan for the role `{role}`; roles with plans: {}", roles.join(", ")));
}

impl StoredPlan {
    /// Returns the description, with at most eight actions.
    pub fn describe(&self) -> PlanDescription {
        let actions = &self.actions[..self.actions.len().min(8)];
        PlanDescription {
            name: Text::new(&self.name),
            role: Text::new(&self.role),
            actions: Sequence::new(actions),
        }
    }
}
