//! Steps allocate nothing.

use std::sync::Arc;

use slate_petri_net::{
    ActionEvent, ActionProgress, ConflictOrder, NetBuilder, PetriNetExecutor, PetriPlan, PlanAction, PlanHost,
};

struct Host {
    steps: u32,
}

impl PlanHost for Host {
    fn condition(&mut self, _: usize, _: &str) -> Option<bool> {
        Some(self.steps.is_multiple_of(3))
    }

    fn progress(&mut self, _: usize, _: &PlanAction) -> ActionProgress {
        ActionProgress::Succeeded
    }

    fn control(&mut self, _: usize, _: &PlanAction, _: ActionEvent) {}
}

#[test]
fn a_step_allocates_nothing() {
    let ring = |name: &str, action: &str, is_endless: bool| {
        let mut net = NetBuilder::new(name);
        let (idle, run) = (net.place("idle", 1), net.place(&format!("{action}.exec"), 0));
        let goal = net.place("goal", 0);
        net.transition("*.start [go]", &[(idle, 1)], &[(run, 1)]);
        net.transition("*.end", &[(run, 1)], &[(if is_endless { idle } else { goal }, 1)]);
        net.transition("*.interrupt [and go (not stop)]", &[(run, 1)], &[(idle, 1)]);
        net.finish().unwrap()
    };
    let find = |name: &str| Ok((name == "inner").then(|| ring("inner", "work", false)));
    let plan = PetriPlan::new(ring("outer", "inner", true), find).unwrap();
    let mut executor = PetriNetExecutor::new(Arc::new(plan), ConflictOrder::Seed(1));
    let mut host = Host { steps: 0 };
    let mut fired = 0;
    let mut run = |executor: &mut PetriNetExecutor| {
        for _ in 0..1000 {
            host.steps += 1;
            executor.step(&mut host).unwrap();
            fired += executor.fired().len();
        }
    };
    run(&mut executor);
    let info = allocation_counter::measure(|| run(&mut executor));
    assert_eq!(info.count_total, 0);
    assert!(fired > 500, "{fired}");
}
