//! Benchmark of skills: machines in a tick each, and many in one tick.

use std::error::Error;

use slate_behavior::{
    BehaviorAction, BehaviorEngine, BehaviorHost, BehaviorLimits, BehaviorProgress, ScriptLevel, SkillFiles,
};

struct Robot;

impl BehaviorHost for Robot {
    fn condition(&mut self, _: &str) -> Option<bool> {
        Some(false)
    }

    fn start(&mut self, _: usize, _: &BehaviorAction, _: &[f64]) -> Result<(), String> {
        Ok(())
    }

    fn progress(&mut self, _: usize) -> BehaviorProgress {
        BehaviorProgress::Running
    }

    fn stop(&mut self, _: usize) {}

    fn random(&mut self) -> u64 {
        1
    }

    fn log(&mut self, _: ScriptLevel, _: &str) {}
}

/// Returns a skill that counts up and down, with two transitions in each state.
fn counter(name: &str) -> String {
    format!(
        "module(..., skillenv.module_init)
        name = '{name}' documentation = ''
        skillenv.skill_module(_M)
        fsm = SkillHSM:new{{name = name, start = 'UP'}}
        fsm:define_states{{export_to = _M, {{'UP', JumpState}}, {{'DOWN', JumpState}}}}
        fsm:add_transitions{{
            {{'UP', 'FAILED', cond = 'vars.stop'}}, {{'UP', 'DOWN', cond = 'vars.count >= 10'}},
            {{'DOWN', 'FAILED', cond = 'vars.stop'}}, {{'DOWN', 'UP', cond = function(state) return state.fsm.vars.count <= 0 end}}}}
        function UP:init() self.fsm.vars.count = self.fsm.vars.count or 0 end
        function UP:loop() self.fsm.vars.count = self.fsm.vars.count + 1 end
        function DOWN:loop() self.fsm.vars.count = self.fsm.vars.count - 1 end"
    )
}

/// Returns the best time of a number of ticks, µs for 1000 steps.
#[expect(clippy::disallowed_methods, reason = "it measures")]
fn measure(engine: &mut BehaviorEngine, ticks: u64, skills: u64) -> Result<f64, Box<dyn Error>> {
    let mut best = f64::INFINITY;
    for _ in 0..20 {
        let start = std::time::Instant::now();
        for tick in 0..ticks {
            engine.tick(tick * 20_000_000, &mut Robot)?;
        }
        let time = start.elapsed().as_secs_f64() * 1e6 * 1000.0 / (ticks * skills) as f64;
        best = if time < best { time } else { best };
    }
    Ok(best)
}

fn main() -> Result<(), Box<dyn Error>> {
    let limits = BehaviorLimits { operations: 10_000_000, ..BehaviorLimits::default() };
    let text = counter("one");
    let mut engine = BehaviorEngine::load(&SkillFiles::from_texts("one", &[("one", &text)]), "", limits)?;
    println!("1000 ticks of one skill: {:.0} µs", measure(&mut engine, 1000, 1)?);
    let empty = "module(..., skillenv.module_init) name = 'one' documentation = '' skillenv.skill_module(_M)
        function execute() return S_RUNNING end function reset() end";
    let mut engine = BehaviorEngine::load(&SkillFiles::from_texts("one", &[("one", empty)]), "", limits)?;
    println!("1000 ticks of one empty skill: {:.0} µs", measure(&mut engine, 1000, 1)?);
    let looping = format!("{text} function execute() for _ = 1, 1000 do fsm:loop() end return S_RUNNING end");
    let mut engine = BehaviorEngine::load(&SkillFiles::from_texts("one", &[("one", &looping)]), "", limits)?;
    println!("one tick of 1000 steps: {:.0} µs", measure(&mut engine, 50, 1000)?);
    let names: Vec<String> = (0..1000).map(|index| format!("skill{index}")).collect();
    let mut texts: Vec<(&str, String)> = names.iter().map(|name| (name.as_str(), counter(name))).collect();
    texts.push(("all", names.iter().map(|name| format!("use_skill('{name}') ")).collect()));
    let texts: Vec<(&str, &str)> = texts.iter().map(|(name, text)| (*name, text.as_str())).collect();
    let call: String = names.iter().map(|name| format!("{name}{{}} ")).collect();
    let mut engine = BehaviorEngine::load(&SkillFiles::from_texts("all", &texts), &call, limits)?;
    println!("one tick of 1000 skills: {:.0} µs", measure(&mut engine, 50, 1000)?);
    Ok(())
}
