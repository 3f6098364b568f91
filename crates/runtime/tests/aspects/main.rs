//! Services that modules need and that can be missing: the mechanism, and each service of the host. Each guarantee has
//! a test that tries to break it.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    unsafe_code,
    reason = "a test that fails panics, and wall-clock time is what some are about"
)]

mod actuators;
mod blackboard;
use crate::common;
mod fixture;
mod light;
mod mechanism;
mod network;
mod reload;
mod threaded;
mod transforms;

use std::time::{Duration, Instant};

use common::load;
use slate_module::Plugin;
use slate_runtime::log::MemoryTarget;
use slate_runtime::{Agent, Options, Rate, StartError};

/// An agent in lockstep whose clock is a counter, with those plugins beside the common ones.
fn try_agent(text: &str, plugins: &[Plugin], options: Options) -> Result<Agent, StartError> {
    let text =
        format!("time.source = \"clock\"\nlog.repeat = 0\n{text}\n[modules.clock]\nkind = \"counter\"\n");
    load(&text, plugins, Options { rate: Rate::Max, armed: true, ..options })
}

fn agent(text: &str, plugins: &[Plugin]) -> Agent {
    try_agent(text, plugins, Options::default()).unwrap()
}

/// As [`agent`], with what it logs.
fn logged(text: &str, plugins: &[Plugin]) -> (Agent, MemoryTarget) {
    let log = MemoryTarget::default();
    let options = Options { log: vec![Box::new(log.clone())], ..Options::default() };
    (try_agent(text, plugins, options).unwrap(), log)
}

/// Why an agent does not start, with what to do about it.
fn complaint(text: &str, plugins: &[Plugin]) -> String {
    match try_agent(text, plugins, Options::default()) {
        Ok(_) => panic!("it should not start"),
        Err(StartError::Configuration(report)) => full(&report),
        Err(other) => full(&other),
    }
}

/// A refusal with its help and what is related to it.
fn full(error: &(impl miette::Diagnostic + ?Sized)) -> String {
    let mut text = error.to_string();
    if let Some(help) = error.help() {
        text = format!("{text}; {help}");
    }
    for related in error.related().into_iter().flatten() {
        text = format!("{text}\n{}", full(related));
    }
    text
}

fn steps(agent: &mut Agent, count: usize) {
    (0..count).for_each(|_| assert!(agent.step()));
}

/// Whether the log has a line of a module with that text.
fn says(agent: &Agent, log: &MemoryTarget, module: &str, text: &str) -> bool {
    agent.logger().flush(LONG);
    log.lines().iter().any(|line| &*line.module == module && line.text.contains(text))
}

/// How a module is.
fn condition(agent: &Agent, module: &str) -> &'static str {
    let modules = agent.composer().modules();
    modules.iter().find(|status| status.name == module).unwrap().condition
}

/// Ticks that a module made.
fn ticks(agent: &Agent, module: &str) -> u64 {
    agent.counts(module).unwrap().0
}

/// Time enough for what must come in the end.
const LONG: Duration = Duration::from_secs(60);

/// Waits for what must come in the end.
fn wait(what: &str, mut done: impl FnMut() -> bool) {
    let start = Instant::now();
    while !done() {
        assert!(start.elapsed() < LONG, "waited in vain: {what}");
        std::thread::sleep(Duration::from_millis(1));
    }
}
