//! A robot for the tests.

use std::collections::BTreeMap;

use slate_behavior::{
    BehaviorAction, BehaviorEngine, BehaviorHost, BehaviorLimits, BehaviorProgress, BehaviorStatus,
    ScriptLevel, SkillFiles,
};

/// Time between two ticks, ns.
pub const TICK: u64 = 100_000_000;

/// A robot that writes down what it does.
#[derive(Clone, Default)]
pub struct Robot {
    pub events: Vec<String>,
    pub conditions: BTreeMap<String, bool>,
    /// Progress of each action; those that are not named run.
    pub progress: BTreeMap<usize, BehaviorProgress>,
    pub draws: u64,
}

impl BehaviorHost for Robot {
    fn condition(&mut self, name: &str) -> Option<bool> {
        self.conditions.get(name).copied()
    }

    fn start(&mut self, index: usize, action: &BehaviorAction, arguments: &[f64]) -> Result<(), String> {
        self.events.push(format!("start {} {arguments:?}", action.kind));
        self.progress.insert(index, BehaviorProgress::Running);
        Ok(())
    }

    fn progress(&mut self, index: usize) -> BehaviorProgress {
        self.progress.get(&index).copied().unwrap_or(BehaviorProgress::Running)
    }

    fn stop(&mut self, index: usize) {
        self.events.push(format!("stop {index}"));
    }

    fn random(&mut self) -> u64 {
        self.draws += 1;
        self.draws.wrapping_mul(0x9e37_79b9_7f4a_7c15)
    }

    fn log(&mut self, level: ScriptLevel, text: &str) {
        if level != ScriptLevel::Debug {
            self.events.push(text.into());
        }
    }
}

/// A skill named `it`, whose file continues with a text.
pub fn skill(rest: &str) -> String {
    format!(
        "module(..., skillenv.module_init)\nname = 'it'\ndocumentation = ''\n\
         depends_actions = {{{{v = 'go', kind = 'Go', arguments = {{'x', 'y'}}, defaults = {{y = 2}}}}}}\n\
         skillenv.skill_module(_M)\n{rest}"
    )
}

/// A skill named `it` of a machine that starts at `A`.
pub fn machine(rest: &str) -> String {
    skill(&format!("fsm = SkillHSM:new{{name = 'it', start = 'A'}}\n{rest}"))
}

pub fn files(text: &str) -> SkillFiles {
    SkillFiles::from_texts("it", &[("it", text)])
}

pub fn engine(text: &str) -> BehaviorEngine {
    BehaviorEngine::load(&files(text), "", BehaviorLimits::default()).unwrap()
}

/// Error of files that are refused.
pub fn refusal(text: &str) -> String {
    BehaviorEngine::load(&files(text), "", BehaviorLimits::default()).unwrap_err().to_string()
}

/// Runs until the mission ends, or a number of ticks; returns the status and what the robot wrote down.
pub fn run(engine: &mut BehaviorEngine, robot: &mut Robot, ticks: u64) -> BehaviorStatus {
    let mut status = BehaviorStatus::Running;
    for tick in 0..ticks {
        status = engine.tick(tick * TICK, robot).unwrap();
        if status != BehaviorStatus::Running {
            break;
        }
    }
    status
}

/// What a file prints while it is executed in the first tick of a skill without a machine.
pub fn printed(body: &str) -> Vec<String> {
    let text = skill(&format!("function execute()\n{body}\nreturn S_FINAL end function reset() end"));
    let mut robot = Robot::default();
    engine(&text).tick(0, &mut robot).unwrap();
    robot.events
}
