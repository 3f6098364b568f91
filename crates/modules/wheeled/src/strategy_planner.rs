//! Plan of a robot with strategies.
//! It follows the most promising plan of its role, and reports the outcome to Knowledge.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Orientation, Point2, Position};
use slate_plugin::mapek::{PlanDescription, PlanOutcome};
use slate_plugin::prelude::*;

use crate::actions::GoToOrigin;

/// Inputs, knowledge and outputs of the Plan.
#[ports]
pub struct StrategyPlannerPorts {
    position: Noticed<Position>,
    orientation: Noticed<Orientation>,
    /// Plan to follow, from Knowledge.
    strategy: Input<PlanDescription>,
    /// Outcome of a plan, for Knowledge.
    outcome: Output<PlanOutcome>,
    /// Present goal, for reflexes.
    goal: Output<Point2>,
}

/// Parameters of [`StrategyPlanner`].
#[params]
pub struct StrategyPlannerParams {
    #[param(default = 60.0, range = 0.1..=1e6, unit = "s", doc = "time after which an unfinished plan has failed")]
    time_limit: f64,
}

/// Progress of the plan.
#[derive(Default, Serialize, Deserialize)]
pub struct StrategyProgress {
    /// Localization: true if the position is known, and if the heading is.
    #[serde(alias = "placed")]
    localized: (bool, bool),
    /// Number of the strategy that is followed, or has ended.
    strategy: u64,
    /// Running action; `None` when the plan has ended.
    step: Option<usize>,
    /// Ticket of the plan at Execute.
    ticket: u64,
    /// Time of the plan's start, seconds.
    since: f64,
}

/// Follows one plan after the other until one succeeds.
/// Give it a period (`every`): time passes also without changes.
pub struct StrategyPlanner;

impl Plan for StrategyPlanner {
    const NAME: &'static str = "strategy_planner";
    const DOC: &'static str = "Follows the most promising plan of the robot's role.";
    type Noticed = StrategyPlannerPorts;
    type Params = StrategyPlannerParams;
    type State = StrategyProgress;

    fn run(
        progress: &mut StrategyProgress,
        noticed: &StrategyPlannerPorts,
        situation: &Situation<'_>,
        params: &StrategyPlannerParams,
        now: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        progress.localized.0 |= noticed.position.newest().is_some();
        progress.localized.1 |= noticed.orientation.newest().is_some();
        // Without a pose every action would fail.
        if progress.localized != (true, true) {
            return;
        }
        let Some(strategy) = noticed.strategy.fresh() else { return };
        let number = noticed.strategy.stamp().sequence;
        if number != progress.strategy {
            progress.begin(strategy, number, now.seconds(), plan);
        }
        let Some(step) = progress.step else { return };
        let (next, has_failed) = progress.next_step(step, situation);
        let has_succeeded = next == strategy.actions.len();
        let is_late = now.seconds() - progress.since > params.time_limit;
        if !(has_failed || has_succeeded || is_late) {
            return progress.perform(next, strategy, noticed, situation, plan);
        }
        // The Plan is woken by Knowledge's answer to the outcome.
        plan.clear();
        progress.step = None;
        noticed.outcome.set(PlanOutcome {
            seconds: now.seconds() - progress.since,
            name: strategy.name,
            role: strategy.role,
            success: has_succeeded.into(),
        });
    }
}

impl StrategyProgress {
    /// Begins a plan for another role, or again.
    /// Running actions are outdated.
    fn begin(&mut self, strategy: &PlanDescription, number: u64, time: f64, plan: &mut Agenda<'_>) {
        if self.step.is_some() {
            plan.clear();
        }
        let step = (!strategy.actions.is_empty()).then_some(0);
        *self = Self { strategy: number, step, ticket: 0, since: time, ..*self };
    }

    /// Returns the step after the completed actions, and whether one has failed.
    fn next_step(&self, step: usize, situation: &Situation<'_>) -> (usize, bool) {
        let own = situation.ended().filter(|ended| ended.ticket == self.ticket && ended.ticket > 0);
        own.fold((step, false), |(step, has_failed), ended| match ended.ending {
            Ending::COMPLETED => (step + 1, has_failed),
            Ending::FAILED | Ending::REFUSED => (step, true),
            // A reflex came between.
            _ => (step, has_failed),
        })
    }

    /// Performs the action of a step, if it is another one or a reflex has cleared it.
    fn perform(
        &mut self,
        step: usize,
        strategy: &PlanDescription,
        noticed: &StrategyPlannerPorts,
        situation: &Situation<'_>,
        plan: &mut Agenda<'_>,
    ) {
        let action = strategy.actions[step];
        if let (GoToOrigin::KIND, [x, y, ..]) = (action.kind.as_str(), &*action.arguments) {
            noticed.goal.set(Point2 { x: *x, y: *y });
        }
        let is_next = self.step != Some(step);
        self.step = Some(step);
        if (is_next || situation.needs_plan())
            && let Some(ticket) = plan.replace(action)
        {
            self.ticket = ticket;
        }
    }
}
