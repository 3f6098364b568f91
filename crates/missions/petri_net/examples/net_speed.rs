//! Speed of steps: a ring of plain places, and one of actions.

use std::error::Error;
use std::sync::Arc;

use slate_petri_net::{
    ActionEvent, ActionProgress, ConflictOrder, NetBuilder, PetriNetExecutor, PetriPlan, PlanAction, PlanHost,
};

struct Ready;

impl PlanHost for Ready {
    fn condition(&mut self, _: usize, _: &str) -> Option<bool> {
        Some(true)
    }

    fn progress(&mut self, _: usize, _: &PlanAction) -> ActionProgress {
        ActionProgress::Succeeded
    }

    fn control(&mut self, _: usize, _: &PlanAction, _: ActionEvent) {}
}

fn main() -> Result<(), Box<dyn Error>> {
    for (title, has_actions) in [("plain places", false), ("actions and guards", true)] {
        let mut net = NetBuilder::new("ring");
        let count = 8;
        for place in 0..count {
            net.place(&if has_actions { format!("go_{place}.exec") } else { String::new() }, 1);
        }
        for place in 0..count {
            let label = if has_actions { "*.end *.start [and (not (not ready)) clear]" } else { "" };
            net.transition(label, &[(place, 1)], &[((place + 1) % count, 1)]);
        }
        let plan = PetriPlan::new(net.finish()?, |_| Ok(None))?;
        let mut executor = PetriNetExecutor::new(Arc::new(plan), ConflictOrder::File);
        #[expect(clippy::disallowed_methods, reason = "a measurement")]
        let start = std::time::Instant::now();
        let mut fired = 0;
        for _ in 0..2_000_000 {
            executor.step(&mut Ready)?;
            fired += executor.fired().len();
        }
        let seconds = start.elapsed().as_secs_f64();
        println!("{title}: {:.1} million transitions a second", fired as f64 / seconds / 1e6);
    }
    Ok(())
}
