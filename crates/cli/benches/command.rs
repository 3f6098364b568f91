//! Benchmark of the command's duration, from its start to its end.
//! For its help, for a shell's completion, and for queries to a local agent. Prints the processor time too, as the rest
//! depends on other load.
//!
//! `cargo bench -p slate-robotics-cli --bench command`; `SLATE=FILE` is another command that is measured.
#![allow(clippy::disallowed_methods, reason = "a bench measures real time")]
#![allow(clippy::unwrap_used, reason = "a bench that can't go on ends")]

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const CALLS: usize = 60;

const QUERIES: [&[&str]; 8] = [
    &["--help"],
    &["teleop", "--help"],
    &["get", "/loop/state"],
    &["set", "/r2/planner/params/max_linear_velocity", "0.3"],
    &["tree"],
    &["ps"],
    &["module", "list"],
    &["link"],
];

fn main() {
    let run = Run::start();
    println!("{:<36}{:>10}{:>10}{:>10}{:>12}", "", "least", "p50", "p90", "processor");
    for query in QUERIES {
        run.measure(&query.join(" "), || run.command(query));
    }
    let tab = || {
        let mut command = run.command(&["--", "slate", "get", "/r2/pl"]);
        command.env("SLATE_COMPLETE", "bash").env("_CLAP_IFS", "\n").env("_CLAP_COMPLETE_INDEX", "2");
        command
    };
    run.measure("get /r2/pl and Tab", tab);
}

/// Running agent that is queried.
struct Run {
    agent: Child,
    folder: PathBuf,
}

impl Run {
    fn start() -> Self {
        let folder = std::env::temp_dir().join(format!("slate-command-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let mut command = slate(&folder);
        let endless = ["--set", "modules.referee.enabled=false"];
        command.args(["run", "exp1", "--headless", "--rate", "realtime"]).args(endless);
        let run = Self { agent: command.spawn().unwrap(), folder };
        let begin = Instant::now();
        while !run.command(&["get", "/loop/state"]).status().unwrap().success() {
            assert!(begin.elapsed() < Duration::from_secs(20), "the agent is not reached");
            std::thread::sleep(Duration::from_millis(50));
        }
        run
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = slate(&self.folder);
        command.args(arguments);
        command
    }

    fn measure(&self, name: &str, command: impl Fn() -> Command) {
        let mut times = Vec::new();
        let before = processor();
        for _ in 0..CALLS {
            let begin = Instant::now();
            assert!(command().status().unwrap().success(), "{name}");
            times.push(begin.elapsed());
        }
        let processor = 1e3 * (processor() - before) / CALLS as f64;
        times.sort_unstable();
        let at = |place: usize| format!("{:.1} ms", times[place].as_secs_f64() * 1e3);
        let (p50, p90) = (at(CALLS / 2), at(CALLS * 9 / 10));
        println!("{name:<36}{:>10}{p50:>10}{p90:>10}{:>12}", at(0), format!("{processor:.1} ms"));
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        let _ = self.agent.kill();
        let _ = self.agent.wait();
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

fn slate(folder: &std::path::Path) -> Command {
    let mut command = Command::new(std::env::var_os("SLATE").unwrap_or(env!("CARGO_BIN_EXE_slate").into()));
    command.current_dir(folder).env("XDG_RUNTIME_DIR", folder);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

/// Returns the processor time of this process's ended children, s.
fn processor() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    let fields: Vec<_> = stat.rsplit_once(')').unwrap().1.split_whitespace().collect();
    let ticks: u64 = fields[13..15].iter().map(|field| field.parse::<u64>().unwrap()).sum();
    ticks as f64 / rustix::param::clock_ticks_per_second() as f64
}
