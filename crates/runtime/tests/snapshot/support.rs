//! Agents that are frozen, and what they have in common with those that are not.

use std::path::PathBuf;

use slate_blackboard::Stamp;
use slate_runtime::configuration::Database;
use slate_runtime::snapshot::Snapshot;
use slate_runtime::{Agent, Options, Rate};

use crate::snapshot::common::plugins;

/// Everything that a snapshot has: a queue that is read now and then, messages that wait, random numbers, a panic, a
/// command with a rate, a module that waits for news.
pub const ROBOT: &str = r#"
agent.name = "robot"
time.source = "counter"
[modules.counter]
params.panic_at = 13
[modules.dice]
[modules.sender]
[modules.receiver]
every = "400ms"
[modules.relay]
[modules.driver]
[links]
"receiver/notes" = "sender/note"
"receiver/history" = "counter/number"
"relay/input" = "counter/number"
"driver/input" = "dice/number"
[actuators.wheel]
command = "driver/wheel"
limits = { value = [-1.0, 1.0] }
rate_limits = { value = 20.0 }
"#;

pub fn options() -> Options {
    Options { rate: Rate::Max, armed: true, ..Options::default() }
}

pub fn robot(text: &str) -> Agent {
    let database = Database::from_text("robot.toml", text, Default::default()).unwrap();
    Agent::load_with(&database, &plugins(), options()).unwrap()
}

/// An agent as another process would make it of a file.
pub fn resumed(snapshot: &Snapshot, options: Options) -> Agent {
    let file = file(&format!("resumed-{:?}", std::thread::current().id()));
    snapshot.write(&file).unwrap();
    let snapshot = Snapshot::read(&file).unwrap();
    let agent = Agent::load_with(&snapshot.configuration(vec![]).unwrap(), &plugins(), options).unwrap();
    agent.restore(&snapshot).unwrap();
    agent
}

/// A path for a file of a test.
pub fn file(name: &str) -> PathBuf {
    let name: String = name.chars().filter(|c| c.is_ascii_alphanumeric() || *c == '-').collect();
    PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.snapshot"))
}

pub fn steps(agent: &mut Agent, count: usize) {
    for _ in 0..count {
        assert!(agent.step());
    }
}

type Values = Vec<(String, Option<(Vec<u8>, usize, Stamp)>)>;

/// All that can be seen of an agent, but for what is measured on the wall clock, and its log.
#[derive(Debug, PartialEq)]
pub struct Seen {
    now: u64,
    digest: Option<u64>,
    counts: Vec<(String, Option<u64>, Option<u64>)>,
    values: Values,
}

pub fn seen(agent: &mut Agent) -> Seen {
    let measured = |path: &str| {
        path.starts_with("loop/")
            || path.starts_with("log/")
            || path.ends_with("/timing")
            || path.ends_with("/histogram")
    };
    let properties = agent.board().properties();
    let values = properties.iter().filter(|property| !measured(property.path()));
    let values = values.map(|property| (property.path().to_owned(), property.newest().unwrap())).collect();
    let counts = agent.modules().into_iter().map(|module| {
        let counts = agent.counts(&module);
        (module, counts.map(|counts| counts.0), counts.map(|counts| counts.2))
    });
    let counts = counts.collect();
    Seen { now: agent.now(), digest: agent.digest(), counts, values }
}
