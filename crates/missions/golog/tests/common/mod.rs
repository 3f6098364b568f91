//! A robot that performs actions.

use std::collections::BTreeMap;

use slate_golog::*;

/// Robot whose actions take two ticks, unless they are named to fail.
#[derive(Clone, Debug, Default)]
pub struct Robot {
    /// Starts, stops and ends, in order.
    pub log: Vec<String>,
    pub conditions: BTreeMap<String, bool>,
    /// Actions that fail.
    pub failing: Vec<String>,
    slots: BTreeMap<usize, (String, u32)>,
}

impl Robot {
    pub fn set_condition(&mut self, name: &str, holds: bool) {
        self.conditions.insert(name.into(), holds);
    }

    /// Reports the conditions and makes a tick.
    pub fn tick(&mut self, executor: &mut GologExecutor) -> GologOutcome {
        executor.observe(|name| self.conditions.get(name).copied()).unwrap();
        executor.tick(self).unwrap()
    }

    pub fn ticks(&mut self, executor: &mut GologExecutor, number: usize) -> GologOutcome {
        (0..number).for_each(|_| {
            self.tick(executor);
        });
        executor.outcome()
    }
}

impl GologHost for Robot {
    fn start(&mut self, slot: usize, action: &RobotAction<'_>) -> Result<(), String> {
        self.log.push(format!("start {}", action.text));
        self.slots.insert(slot, (action.text.clone(), 0));
        Ok(())
    }

    fn progress(&mut self, slot: usize) -> GologProgress {
        let (text, ticks) = self.slots.get_mut(&slot).unwrap();
        *ticks += 1;
        if *ticks < 2 {
            return GologProgress::Running;
        }
        let is_failing = self.failing.contains(text);
        let word = if is_failing { "fail" } else { "end" };
        self.log.push(format!("{word} {text}"));
        self.slots.remove(&slot);
        if is_failing { GologProgress::Failed } else { GologProgress::Succeeded }
    }

    fn stop(&mut self, slot: usize) {
        let (text, _) = self.slots.remove(&slot).unwrap();
        self.log.push(format!("stop {text}"));
    }
}

pub fn theory(text: &str) -> ActionTheory {
    ActionTheory::parse(text).unwrap_or_else(|error| panic!("{}", error.render()))
}

pub fn executor(text: &str) -> GologExecutor {
    GologExecutor::new(theory(text).into(), SearchLimits::default())
}

/// Action sequences of a program, each as a text.
pub fn all(text: &str) -> Vec<String> {
    let limits = SolutionLimits { most_depth: 12, most_transitions: 100_000 };
    let mut found = Vec::new();
    solutions(&theory(text), &limits, |actions| {
        found.push(actions.join(" "));
        true
    })
    .unwrap();
    found
}
