//! Trees and hosts for tests.

use std::collections::BTreeMap;
use std::sync::Arc;

use slate_behavior_tree::{
    BehaviorTree, BoardValue, LeafModels, LeafPorts, NodeStatus, TreeExecutor, TreeHost, TreeLeaf,
};

/// A host with written answers: the n-th call of a leaf has its n-th letter, again from the first after the last.
#[derive(Clone, Default)]
pub struct Answers {
    pub answers: BTreeMap<String, String>,
    pub calls: BTreeMap<String, usize>,
    pub log: Vec<String>,
    /// Written to the port `to` of the first action that starts.
    pub output: Option<BoardValue>,
}

impl Answers {
    pub fn new(answers: &[(&str, &str)]) -> Self {
        let answers = answers.iter().map(|(name, letters)| ((*name).into(), (*letters).into())).collect();
        Self { answers, ..Self::default() }
    }

    fn answer(&mut self, event: &str, leaf: &TreeLeaf, ports: &LeafPorts<'_>) -> NodeStatus {
        let values = ports.names().filter_map(|name| Some(format!(" {name}={}", ports.get(name)?)));
        self.log.push(format!("{event} {}{}", leaf.id(), values.collect::<String>()));
        let letters = self.answers.get(leaf.id()).map_or("R", String::as_str).as_bytes();
        let call = self.calls.entry(leaf.id().into()).or_default();
        *call += 1;
        match letters[(*call - 1) % letters.len()] {
            b'R' => NodeStatus::Running,
            b'S' => NodeStatus::Succeeded,
            b'K' => NodeStatus::Skipped,
            b'I' => NodeStatus::Idle,
            _ => NodeStatus::Failed,
        }
    }

    /// The orders since the last call.
    pub fn orders(&mut self) -> String {
        std::mem::take(&mut self.log).join(", ")
    }
}

impl TreeHost for Answers {
    fn condition(&mut self, _: usize, leaf: &TreeLeaf, ports: &mut LeafPorts<'_>) -> NodeStatus {
        self.answer("ask", leaf, ports)
    }

    fn start(&mut self, _: usize, leaf: &TreeLeaf, ports: &mut LeafPorts<'_>) -> NodeStatus {
        let status = self.answer("start", leaf, ports);
        if let Some(value) = self.output.take() {
            assert!(ports.set("to", value));
        }
        status
    }

    fn progress(&mut self, _: usize, leaf: &TreeLeaf, ports: &mut LeafPorts<'_>) -> NodeStatus {
        self.answer("go on", leaf, ports)
    }

    fn halt(&mut self, _: usize, leaf: &TreeLeaf) {
        self.log.push(format!("halt {}", leaf.id()));
    }
}

/// Actions `A` to `D` and conditions `P` and `Q`.
pub fn models() -> LeafModels {
    let models = ["A", "B", "C", "D"].into_iter().fold(LeafModels::default(), LeafModels::action);
    ["P", "Q"].into_iter().fold(models, LeafModels::condition)
}

/// The tree of a node, with further trees behind it.
pub fn document(node: &str, others: &str) -> String {
    format!(
        "<root BTCPP_format=\"4\" main_tree_to_execute=\"main\">\n\
         <BehaviorTree ID=\"main\">\n{node}\n</BehaviorTree>\n{others}</root>"
    )
}

pub fn tree(node: &str) -> Arc<BehaviorTree> {
    Arc::new(BehaviorTree::parse(document(node, "").as_bytes(), &models()).unwrap())
}

/// Calls of the host in each tick, and the status; 100 ms lie between two ticks.
pub fn trace(node: &str, answers: &[(&str, &str)], ticks: u64) -> Vec<String> {
    let mut executor = TreeExecutor::new(tree(node));
    let mut host = Answers::new(answers);
    (0..ticks).map(|tick| step(&mut executor, &mut host, tick)).collect()
}

pub fn step(executor: &mut TreeExecutor, host: &mut Answers, tick: u64) -> String {
    let status = executor.tick(tick * 100_000_000, host).unwrap();
    // Each state that a run reaches can be restored.
    let restored = TreeExecutor::restore(Arc::clone(executor.tree()), &executor.state()).unwrap();
    assert_eq!(restored.state(), executor.state());
    format!("{}: {status:?}", host.orders())
}
