use serde::{Deserialize, Serialize};
use slate_module::{Sequence, Text, interface};

use super::plans::PlanLibrary;
use crate::ActionRequest;

/// Strategy: a plan with its outcomes so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StoredPlan {
    /// Name of the plan.
    pub name: String,
    /// Role, such as `defender`.
    pub role: String,
    /// Actions of the plan.
    pub actions: Vec<ActionRequest>,
    /// Number of trials.
    pub tried: u64,
    /// Number of successes.
    pub succeeded: u64,
    /// Total duration of its successes, seconds.
    pub seconds: f64,
}

impl StoredPlan {
    /// Returns the expected success rate by Laplace's rule of succession.
    /// It is one half without trials.
    pub fn expected_success_rate(&self) -> f64 {
        (self.succeeded as f64 + 1.0) / (self.tried as f64 + 2.0)
    }

    fn record(&mut self, success: bool, seconds: f64) {
        // The saved number is not checked yet.
        self.tried = self.tried.saturating_add(1);
        if success {
            self.succeeded = self.succeeded.saturating_add(1);
            self.seconds += seconds;
        }
    }
}

/// Strategies from which the Plan can choose (RoCS, 4.2).
/// They are plans by role, with their past outcomes.
///
/// Keep it as the state of the robot's Knowledge and call [`update`](StrategyModel::update) in its own: from there it is saved
/// with the robot, kept from run to run if the configuration names a file for that, and shown by a [`StrategyReport`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StrategyModel {
    role: String,
    plans: Vec<StoredPlan>,
}

impl StrategyModel {
    /// Returns the robot's role; empty for none.
    pub fn role(&self) -> &str {
        &self.role
    }

    /// Sets the role.
    pub fn take_role(&mut self, role: &str) {
        role.clone_into(&mut self.role);
    }

    /// Adds a plan; returns false if it is known.
    /// Other actions under the same name and role make a new plan, without outcomes.
    pub fn add_plan(&mut self, name: &str, role: &str, actions: &[ActionRequest]) -> bool {
        let plan = StoredPlan {
            name: name.into(),
            role: role.into(),
            actions: actions.to_vec(),
            tried: 0,
            succeeded: 0,
            seconds: 0.0,
        };
        match self.plans.iter_mut().find(|plan| plan.name == name && plan.role == role) {
            Some(known) if known.actions == actions => return false,
            Some(known) => *known = plan,
            None => self.plans.push(plan),
        }
        true
    }

    /// Returns the plan of the role with the highest expected success rate.
    /// Of equal ones it is the first. Plans of other libraries are kept, but not chosen.
    pub fn best(&self, library: &PlanLibrary) -> Option<&StoredPlan> {
        let present = library.plans.iter().filter(|plan| plan.role.as_str() == self.role);
        let plans = present.filter_map(|present| {
            let is_same = |plan: &&StoredPlan| plan.name == present.name.as_str() && plan.role == self.role;
            self.plans.iter().find(is_same)
        });
        let is_better = |plan: &StoredPlan, best: &StoredPlan| {
            plan.expected_success_rate() > best.expected_success_rate()
        };
        plans.reduce(|best, plan| if is_better(plan, best) { plan } else { best })
    }

    /// Records an outcome of a plan of the role; returns false if the plan is unknown.
    /// Its duration in seconds.
    pub fn record(&mut self, name: &str, success: bool, seconds: f64) -> bool {
        let index = self.plans.iter().position(|plan| plan.name == name && plan.role == self.role);
        index.map(|index| self.plans[index].record(success, seconds)).is_some()
    }

    /// Records as [`record`](StrategyModel::record), for a plan of any role.
    /// The role may have changed.
    pub fn record_for(&mut self, role: &str, name: &str, success: bool, seconds: f64) -> bool {
        let mut plans = self.plans.iter_mut();
        let plan = plans.find(|plan| plan.name == name && plan.role == role);
        plan.map(|plan| plan.record(success, seconds)).is_some()
    }

    /// Returns all plans, in the order of their addition.
    pub fn plans(&self) -> &[StoredPlan] {
        &self.plans
    }

    /// Returns the outcomes of the first sixteen plans, for a property.
    pub fn report(&self) -> StrategyReport {
        let mut records = [StrategyRecord::default(); 16];
        let mut length = 0;
        for (record, plan) in records.iter_mut().zip(&self.plans) {
            *record = StrategyRecord {
                tried: plan.tried,
                succeeded: plan.succeeded,
                seconds: plan.seconds,
                name: Text::new(&plan.name),
                role: Text::new(&plan.role),
            };
            length += 1;
        }
        StrategyReport { role: Text::new(&self.role), records: Sequence::new(&records[..length]) }
    }
}

/// Outcomes of a plan so far.
#[interface]
#[derive(PartialEq)]
pub struct StrategyRecord {
    /// Number of trials.
    pub tried: u64,
    /// Number of successes.
    pub succeeded: u64,
    /// Total duration of its successes.
    #[unit("s")]
    pub seconds: f64,
    /// Name of the plan.
    pub name: Text<28>,
    /// Role of the plan.
    pub role: Text<28>,
}

/// Role of the robot and outcomes of its plans.
#[interface]
pub struct StrategyReport {
    /// The robot's role; empty for none.
    pub role: Text<28>,
    /// Plans of the model.
    pub records: Sequence<StrategyRecord, 16>,
}
