//! Traces of random skills, for `tests/compare_lupa.py`.
//!
//! Each line of the input is a skill with its ticks, as JSON; each line of the output is its trace.

use std::collections::BTreeMap;
use std::error::Error;
use std::io::BufRead;

use serde::Deserialize;
use slate_behavior::{
    BehaviorAction, BehaviorEngine, BehaviorHost, BehaviorLimits, BehaviorProgress, ScriptLevel, SkillFiles,
};

#[derive(Deserialize)]
struct Case {
    files: BTreeMap<String, String>,
    /// Conditions and progress of the actions for each tick.
    ticks: Vec<(BTreeMap<String, bool>, Vec<u8>)>,
}

#[derive(Default)]
struct Robot {
    events: Vec<String>,
    conditions: BTreeMap<String, bool>,
    progress: Vec<u8>,
    random: u64,
}

impl BehaviorHost for Robot {
    fn condition(&mut self, name: &str) -> Option<bool> {
        self.conditions.get(name).copied()
    }

    fn start(&mut self, index: usize, _: &BehaviorAction, arguments: &[f64]) -> Result<(), String> {
        self.events.push(format!("start {index} {}", arguments.len()));
        Ok(())
    }

    fn progress(&mut self, index: usize) -> BehaviorProgress {
        match self.progress.get(index) {
            Some(1) => BehaviorProgress::Succeeded,
            Some(2) => BehaviorProgress::Failed,
            Some(3) => BehaviorProgress::Preempted,
            _ => BehaviorProgress::Running,
        }
    }

    fn stop(&mut self, index: usize) {
        self.events.push(format!("stop {index}"));
    }

    fn random(&mut self) -> u64 {
        self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        self.random
    }

    fn log(&mut self, _: ScriptLevel, text: &str) {
        self.events.push(text.into());
    }
}

fn trace(case: &Case) -> Vec<String> {
    let texts: Vec<(&str, &str)> =
        case.files.iter().map(|(name, text)| (name.as_str(), text.as_str())).collect();
    let mut robot = Robot::default();
    let files = SkillFiles::from_texts("main", &texts);
    let mut engine = match BehaviorEngine::load(&files, "", BehaviorLimits::default()) {
        Ok(engine) => engine,
        Err(error) => return vec![format!("refused: {}", error.reason())],
    };
    for (tick, (conditions, progress)) in case.ticks.iter().enumerate() {
        (robot.conditions, robot.progress) = (conditions.clone(), progress.clone());
        match engine.tick(tick as u64 * 100_000_000, &mut robot) {
            Ok(status) => robot.events.push(format!("{status:?} {}", engine.active())),
            Err(error) => {
                robot.events.push(format!("error: {}", error.reason()));
                break;
            }
        }
    }
    robot.events
}

fn main() -> Result<(), Box<dyn Error>> {
    for line in std::io::stdin().lock().lines() {
        println!("{}", serde_json::to_string(&trace(&serde_json::from_str(&line?)?))?);
    }
    Ok(())
}
