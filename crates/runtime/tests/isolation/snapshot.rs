//! An isolated module in a snapshot: its state crosses processes twice, and it continues as one that is linked in.

use slate_runtime::configuration::Database;
use slate_runtime::snapshot::Snapshot;
use slate_runtime::{Agent, Options, Rate};

use crate::Test;
use crate::common::number;
use crate::modules::plugins;
use crate::same;

pub const TESTS: [Test; 2] = [
    ("isolated modules go on from a snapshot bit for bit", goes_on),
    ("isolated modules go back in their own process", goes_back),
];

fn options() -> Options {
    Options { rate: Rate::Max, armed: true, ..Options::default() }
}

fn load(isolated: &[&str]) -> Agent {
    let text = same::text(isolated);
    let database = Database::from_text("test.toml", &text, Default::default()).unwrap();
    Agent::load_with(&database, &plugins(), options()).unwrap()
}

fn steps(agent: &mut Agent, count: usize) {
    (0..count).for_each(|_| assert!(agent.step()));
}

fn goes_on() {
    let mut straight = load(&[]);
    steps(&mut straight, 200);
    for moment in [0, 1, 57, 100] {
        let mut first = load(&same::ALL);
        steps(&mut first, moment);
        let file = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("isolated.snapshot");
        first.composer().snapshot().unwrap().write(&file).unwrap();
        drop(first);
        let snapshot = Snapshot::read(&file).unwrap();
        let database = snapshot.configuration(vec![]).unwrap();
        let mut second = Agent::load_with(&database, &plugins(), options()).unwrap();
        second.restore(&snapshot).unwrap();
        steps(&mut second, 200 - moment);
        assert_eq!(second.digest(), straight.digest(), "after {moment} cycles");
        assert_eq!(number(&second, "clerk/total/value"), number(&straight, "clerk/total/value"));
    }
}

fn goes_back() {
    let mut agent = load(&same::ALL);
    steps(&mut agent, 40);
    let snapshot = agent.composer().snapshot().unwrap();
    steps(&mut agent, 60);
    let digest = agent.digest();
    for wander in [0, 13] {
        steps(&mut agent, wander);
        agent.restore(&snapshot).unwrap();
        steps(&mut agent, 60);
        assert_eq!(agent.digest(), digest, "after {wander} cycles more");
    }
}
