//! Ticks allocate nothing.

use slate_behavior_tree::{
    BehaviorTree, LeafModels, LeafPorts, NodeStatus, TreeExecutor, TreeHost, TreeLeaf,
};

#[derive(Default)]
struct Host {
    calls: u32,
    halted: u32,
}

impl TreeHost for Host {
    fn condition(&mut self, _: usize, _: &TreeLeaf, _: &mut LeafPorts<'_>) -> NodeStatus {
        self.calls += 1;
        if self.calls.is_multiple_of(3) { NodeStatus::Failed } else { NodeStatus::Succeeded }
    }

    fn start(&mut self, _: usize, _: &TreeLeaf, _: &mut LeafPorts<'_>) -> NodeStatus {
        NodeStatus::Running
    }

    fn progress(&mut self, _: usize, _: &TreeLeaf, _: &mut LeafPorts<'_>) -> NodeStatus {
        self.calls += 1;
        if self.calls.is_multiple_of(4) { NodeStatus::Succeeded } else { NodeStatus::Running }
    }

    fn halt(&mut self, _: usize, _: &TreeLeaf) {
        self.halted += 1;
    }
}

#[test]
fn a_tick_allocates_nothing() {
    let xml = r#"<root BTCPP_format="4"><BehaviorTree ID="main"><ReactiveFallback>
        <Sequence><Condition ID="P"/><Script code="n := 1; n += 1"/></Sequence>
        <Parallel success_count="1"><Timeout msec="5"><Action ID="A" to="{n}"/></Timeout>
          <Repeat num_cycles="3"><Action ID="B"/></Repeat></Parallel>
      </ReactiveFallback></BehaviorTree></root>"#;
    let tree = BehaviorTree::parse(xml.as_bytes(), &LeafModels::default()).unwrap();
    let mut executor = TreeExecutor::new(tree.into());
    let mut host = Host::default();
    let mut run = |executor: &mut TreeExecutor| {
        for tick in 0..1000 {
            executor.tick(tick * 1_000_000, &mut host).unwrap();
        }
    };
    run(&mut executor);
    let info = allocation_counter::measure(|| run(&mut executor));
    assert_eq!(info.count_total, 0);
    assert!(host.halted > 100, "{}", host.halted);
}
