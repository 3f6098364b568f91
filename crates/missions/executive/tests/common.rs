//! Helpers of the tests of all Plans: they act as Execute, and inspect the Plan's requests.

use slate_plugin::mapek::{Ended, Ending, ExecuteStatus, Plan, PlanBlock, PlanStep, Planned, Route};
use slate_plugin::module::Sequence;
use slate_plugin::module::testing::Fixture;

/// Execute's status when the action of that ticket runs, or has ended.
pub fn status(number: u64, ticket: u64, ending: Option<Ending>) -> ExecuteStatus {
    let route = Route::DELIBERATIVE;
    let ended = ending.map(|ending| Ended { number, ticket, ending, route, ..Ended::default() });
    match ended {
        None => ExecuteStatus { ticket, route, ..ExecuteStatus::default() },
        Some(ended) => ExecuteStatus { ticket, ended: Sequence::new(&[ended]), ..ExecuteStatus::default() },
    }
}

/// What the Plan sends in this tick, such as `Go 1` or `clear`.
pub fn sent<P: Plan>(plan: &mut Fixture<PlanBlock<P>>) -> Vec<String> {
    plan.advance(20_000_000);
    plan.tick();
    let sent = plan.sent::<Planned>("plan");
    let text = |sent: &Planned| match sent.step {
        PlanStep::CLEAR => "clear".into(),
        _ => {
            let arguments = sent.action.arguments.iter().map(|number| format!(" {number}"));
            format!("{}{}", sent.action.kind.as_str(), arguments.collect::<String>())
        }
    };
    sent.iter().map(text).collect()
}
