//! Cost of isolation, for the reader of a terminal; to be run with `--release`.

use std::time::Instant;

use slate_runtime::{Agent, Options, Rate};

use crate::common::{configuration, number};
use crate::modules::{fault, plugins};

fn agent(isolated: bool, at: u64) -> Agent {
    let text = format!(
        "time.source = \"pulse\"\nloop.period = \"1s\"\n[modules.pulse]\n[modules.villain]\nisolated = {isolated}\n\
         params = {{ fault = {}, at = {at} }}\nlog.level = \"warn\"\n",
        fault("abort")
    );
    let text = text.replace("log.level = \"warn\"\n", "");
    Agent::load(&configuration(&text), &plugins(), Options { rate: Rate::Max, ..Options::default() })
        .unwrap_or_else(|error| panic!("{error}"))
}

fn show(what: &str, mut microseconds: Vec<f64>) {
    microseconds.sort_by(f64::total_cmp);
    let at = |part: f64| microseconds[((microseconds.len() - 1) as f64 * part) as usize];
    let (count, p50, p99) = (microseconds.len(), at(0.5), at(0.99));
    println!("{what:44} p50 {p50:9.1} us, p99 {p99:9.1} us ({count} times)");
}

fn timed(agent: &mut Agent) -> f64 {
    let start = Instant::now();
    agent.step();
    start.elapsed().as_nanos() as f64 * 1e-3
}

pub fn print() {
    for isolated in [false, true] {
        let mut agent = agent(isolated, 0);
        let times = (0..20_000).map(|_| timed(&mut agent)).skip(1000).collect();
        show(if isolated { "a cycle with an isolated module" } else { "the same, linked in" }, times);
    }
    let mut agent = agent(true, 15);
    let (mut seen, mut started) = (Vec::new(), Vec::new());
    while seen.len() < 200 {
        let before = (agent.counts("villain").unwrap().2, restarts(&agent));
        let time = timed(&mut agent);
        if agent.counts("villain").unwrap().2 > before.0 {
            seen.push(time);
        } else if restarts(&agent) > before.1 {
            started.push(time);
        }
    }
    show("an abort, until all its outputs are safe", seen);
    show("a restart with its first tick", started);
}

fn restarts(agent: &Agent) -> f64 {
    number(agent, "villain/process/restarts")
}
