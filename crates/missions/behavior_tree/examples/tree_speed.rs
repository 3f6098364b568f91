//! Speed of ticks: a reactive tree of conditions and actions, and one with scripts.

use std::error::Error;
use std::sync::Arc;

use slate_behavior_tree::{
    BehaviorTree, LeafModels, LeafPorts, NodeStatus, TreeExecutor, TreeHost, TreeLeaf,
};

struct Ready(u64);

impl TreeHost for Ready {
    fn condition(&mut self, _: usize, _: &TreeLeaf, _: &mut LeafPorts<'_>) -> NodeStatus {
        self.0 += 1;
        if self.0.is_multiple_of(7) { NodeStatus::Failed } else { NodeStatus::Succeeded }
    }

    fn start(&mut self, _: usize, _: &TreeLeaf, _: &mut LeafPorts<'_>) -> NodeStatus {
        NodeStatus::Running
    }

    fn progress(&mut self, _: usize, _: &TreeLeaf, _: &mut LeafPorts<'_>) -> NodeStatus {
        NodeStatus::Succeeded
    }

    fn halt(&mut self, _: usize, _: &TreeLeaf) {}
}

fn main() -> Result<(), Box<dyn Error>> {
    let part = "<ReactiveFallback><Inverter><Condition ID=\"clear\"/></Inverter><Sequence><Action ID=\"go\"/>\
                <Timeout msec=\"500\"><Action ID=\"look\"/></Timeout></Sequence></ReactiveFallback>";
    let counted = "<Sequence _skipIf=\"n &lt; 0\"><Script code=\"n := 1; n = n * 2 + 1\"/><ScriptCondition \
                   code=\"n == 3 &amp;&amp; true\"/></Sequence>";
    for (title, inner) in [("conditions and actions", part), ("scripts", counted)] {
        let count = 8;
        let xml = format!(
            "<root BTCPP_format=\"4\"><BehaviorTree ID=\"main\"><Parallel success_count=\"-1\" failure_count=\"-1\">\
             <SetBlackboard value=\"0\" output_key=\"n\"/>{}</Parallel></BehaviorTree></root>",
            inner.repeat(count)
        );
        let tree = Arc::new(BehaviorTree::parse(xml.as_bytes(), &LeafModels::default())?);
        let mut executor = TreeExecutor::new(Arc::clone(&tree));
        let mut host = Ready(0);
        #[expect(clippy::disallowed_methods, reason = "a measurement")]
        let start = std::time::Instant::now();
        let ticks = 1_000_000;
        for tick in 0..ticks {
            executor.tick(tick * 1_000_000, &mut host)?;
        }
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "{title}: {} nodes, {:.2} million ticks a second",
            tree.nodes().len(),
            ticks as f64 / seconds / 1e6
        );
    }
    Ok(())
}
