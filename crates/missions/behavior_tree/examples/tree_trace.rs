//! Prints traces of trees, for `tests/compare_behavior_tree_cpp.py`.
//!
//! A line is a tree: `{"xml": "...", "answers": {"A0": "RSF"}, "entries": {"x": 1}, "ticks": 20, "period": 30}`. The
//! n-th call of a leaf has the n-th answer: running, success or failure. Time continues by `period` ms with each tick. With
//! `"statuses": true`, the statuses of all nodes follow each tick.

use std::collections::BTreeMap;
use std::error::Error;
use std::io::{BufRead, Write};
use std::sync::Arc;

use serde::Deserialize;
use slate_behavior_tree::{
    BehaviorTree, BoardValue, LeafModels, LeafPorts, NodeStatus, TreeExecutor, TreeHost, TreeLeaf,
};

#[derive(Deserialize)]
struct Line {
    xml: String,
    answers: BTreeMap<String, String>,
    entries: BTreeMap<String, f64>,
    ticks: u64,
    period: u64,
    #[serde(default)]
    statuses: bool,
}

/// Host with prepared answers and a log of its calls.
struct Answers {
    answers: BTreeMap<String, String>,
    calls: BTreeMap<String, usize>,
    log: Vec<String>,
}

impl Answers {
    fn answer(&mut self, event: &str, leaf: &TreeLeaf) -> NodeStatus {
        self.log.push(format!("{event} {}", leaf.id()));
        let answers = self.answers[leaf.id()].as_bytes();
        let call = self.calls.entry(leaf.id().into()).or_default();
        *call += 1;
        match answers[(*call - 1) % answers.len()] {
            b'R' => NodeStatus::Running,
            b'S' => NodeStatus::Succeeded,
            _ => NodeStatus::Failed,
        }
    }
}

impl TreeHost for Answers {
    fn condition(&mut self, _: usize, leaf: &TreeLeaf, _: &mut LeafPorts<'_>) -> NodeStatus {
        self.answer("condition", leaf)
    }

    fn start(&mut self, _: usize, leaf: &TreeLeaf, _: &mut LeafPorts<'_>) -> NodeStatus {
        self.answer("start", leaf)
    }

    fn progress(&mut self, _: usize, leaf: &TreeLeaf, _: &mut LeafPorts<'_>) -> NodeStatus {
        self.answer("progress", leaf)
    }

    fn halt(&mut self, _: usize, leaf: &TreeLeaf) {
        self.log.push(format!("halt {}", leaf.id()));
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut output = std::io::stdout().lock();
    for line in std::io::stdin().lock().lines() {
        let line: Line = serde_json::from_str(&line?)?;
        let models = line.answers.keys().fold(LeafModels::default(), |models, name| {
            if name.starts_with('C') { models.condition(name) } else { models.action(name) }
        });
        let mut executor = TreeExecutor::new(Arc::new(BehaviorTree::parse(line.xml.as_bytes(), &models)?));
        let mut entries: Vec<(&str, BoardValue)> =
            line.entries.iter().map(|(name, value)| (name.as_str(), BoardValue::Number(*value))).collect();
        entries.push(("z", BoardValue::Text("1".into())));
        for (name, value) in &entries {
            executor.set_entry(name, value.clone());
        }
        let mut host = Answers { answers: line.answers, calls: BTreeMap::new(), log: Vec::new() };
        for tick in 0..line.ticks {
            match executor.tick(tick * line.period * 1_000_000, &mut host) {
                Ok(status) => host.log.push(format!("= {status:?}")),
                Err(error) => {
                    host.log.push(format!("error {error}"));
                    break;
                }
            }
            for (name, initial) in &entries {
                // A tree has no entry that none of its nodes names.
                host.log.push(format!("{name} = {}", executor.entry(name).unwrap_or(initial)));
            }
            if line.statuses {
                let nodes = 0..executor.tree().nodes().len();
                let texts = nodes.map(|node| match executor.status(node) {
                    NodeStatus::Idle => format!(" was {:?}", executor.last_status(node)),
                    status => format!(" {status:?}"),
                });
                host.log.push(format!("nodes:{}", texts.collect::<String>()));
            }
        }
        writeln!(output, "{}", serde_json::to_string(&host.log)?)?;
        output.flush()?;
    }
    Ok(())
}
