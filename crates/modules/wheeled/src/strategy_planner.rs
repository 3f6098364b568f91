//! The deliberative behaviour of a robot with strategies: it follows the most promising plan of its role, and tells Knowledge
//! how that went.

use serde::{Deserialize, Serialize};
use slate_plugin::interfaces::{Orientation, Point2, Position};
use slate_plugin::mapek::{PlanDescription, PlanOutcome};
use slate_plugin::prelude::*;

use crate::actions::GoToOrigin;

/// Inputs, knowledge and outputs of the Plan.
#[ports]
pub struct StrategyNoticing {
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

/// How far the plan is.
#[derive(Default, Serialize, Deserialize)]
pub struct Trial {
    /// Whether the robot was told where it is, and which way it looks.
    placed: (bool, bool),
    /// The number of the strategy that is followed, or has ended.
    strategy: u64,
    /// The action that is under way; nothing when the plan has ended.
    step: Option<usize>,
    /// The number under which Execute has it.
    ticket: u64,
    /// When the plan began, seconds.
    since: f64,
}

/// Follows one plan after the other until one succeeds. Give it a period (`every`): time passes also when nothing changes.
pub struct StrategyPlanner;

impl Plan for StrategyPlanner {
    const NAME: &'static str = "strategy_planner";
    const DOC: &'static str = "Follows the most promising plan of the robot's role.";
    type Noticed = StrategyNoticing;
    type Params = StrategyPlannerParams;
    type State = Trial;

    fn run(
        trial: &mut Trial,
        noticed: &StrategyNoticing,
        situation: &Situation<'_>,
        params: &StrategyPlannerParams,
        now: &Tick,
        plan: &mut Agenda<'_>,
    ) {
        trial.placed.0 |= noticed.position.newest().is_some();
        trial.placed.1 |= noticed.orientation.newest().is_some();
        // Where it does not know where it is, every way would fail.
        if trial.placed != (true, true) {
            return;
        }
        let Some(strategy) = noticed.strategy.fresh() else { return };
        let number = noticed.strategy.stamp().sequence;
        if number != trial.strategy {
            // Another role, or another try: what was under way says nothing any more.
            if trial.step.is_some() {
                plan.clear();
            }
            let step = (!strategy.actions.is_empty()).then_some(0);
            *trial = Trial { strategy: number, step, ticket: 0, since: now.seconds(), ..*trial };
        }
        let Some(mut step) = trial.step else { return };
        let mut failed = now.seconds() - trial.since > params.time_limit;
        for ended in situation.ended().filter(|ended| ended.ticket == trial.ticket && ended.ticket > 0) {
            match ended.ending {
                Ending::COMPLETED => step += 1,
                Ending::FAILED | Ending::REFUSED => failed = true,
                // A reflex came between.
                _ => {}
            }
        }
        let succeeded = step == strategy.actions.len();
        if failed || succeeded {
            // The Plan is woken by what becomes of this, when Knowledge has learned of the outcome.
            plan.clear();
            trial.step = None;
            noticed.outcome.set(PlanOutcome {
                seconds: now.seconds() - trial.since,
                name: strategy.name,
                role: strategy.role,
                success: succeeded.into(),
            });
            return;
        }
        let action = strategy.actions[step];
        if let (GoToOrigin::KIND, [x, y, ..]) = (action.kind.as_str(), &*action.arguments) {
            noticed.goal.set(Point2 { x: *x, y: *y });
        }
        let goes_on = trial.step != Some(step);
        trial.step = Some(step);
        if (goes_on || situation.needs_plan())
            && let Some(ticket) = plan.replace(action)
        {
            trial.ticket = ticket;
        }
    }
}
