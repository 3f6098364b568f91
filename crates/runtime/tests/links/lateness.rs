//! Links that change while a module has not returned from its step.

use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use slate_blackboard::channel::Budget;
use slate_blackboard::interface::{Interface, View};
use slate_blackboard::{Access, Board, Store};
use slate_runtime::configuration::{Database, Options as Reading};
use slate_runtime::sharing::{
    DemandState, RemoteDemand, RemotePath, Sharing, SharingError, SharingHost, Site,
};
use slate_runtime::{Agent, Composer, Control, Mode, NewLink, Options, Rate, Stopper};
use slate_sorted::SortedMap;

use crate::links::common::Number;
use crate::links::support::{all, hold};

/// Lets the test say what is there of other agents.
#[derive(Clone, Default)]
struct Told(Arc<Mutex<Option<SharingHost>>>);

impl Sharing for Told {
    fn start(&mut self, site: Site) -> Result<(), SharingError> {
        *self.0.lock().unwrap() = Some(site.host);
        Ok(())
    }

    fn set_demands(&mut self, _: SortedMap<RemotePath, RemoteDemand>) {}
}

/// An agent that runs until this is dropped.
struct Running {
    board: Arc<Board>,
    database: Database,
    composer: Composer,
    stopper: Stopper,
    told: Told,
    number: u64,
    thread: Option<JoinHandle<()>>,
}

impl Running {
    fn start(number: u64, mode: Mode, links: &str) -> Self {
        let text = format!(
            r#"
[agent]
name = "late-{number}-{}"
[loop]
period = "2ms"
hang = "50ms"
[modules.counter]
[modules.held]
params.hold = {number}
{}
[links]
{links}
"#,
            std::process::id(),
            if mode == Mode::Threaded { "every = \"2ms\"" } else { "" }
        );
        let database = Database::from_text("late.toml", &text, Reading::default()).unwrap();
        let told = Told::default();
        let options = Options {
            mode,
            rate: Rate::REALTIME,
            sharing: Some(Box::new(told.clone())),
            ..Options::default()
        };
        let mut agent = Agent::load_with(&database, &all(), options).unwrap();
        let (board, composer, stopper) = (Arc::clone(agent.board()), agent.composer(), agent.stopper());
        let thread = std::thread::spawn(move || {
            agent.run(Box::new(|_| Control::Continue)).unwrap();
        });
        Self { board, database, composer, stopper, told, number, thread: Some(thread) }
    }

    /// Keeps the module in its step until it is late.
    fn hold(&self) {
        hold(self.number, true);
        self.wait_for("the module to be late", || self.condition() == "LATE");
    }

    fn let_go(&self) {
        hold(self.number, false);
    }

    fn condition(&self) -> &'static str {
        self.composer.modules().into_iter().find(|module| module.name == "held").unwrap().condition
    }

    fn seen(&self) -> f64 {
        let read = self.board.read("held/seen/value").unwrap();
        read.and_then(|(value, _)| value.as_f64()).unwrap_or(0.0)
    }

    fn trouble(&self, to: &str) -> Option<String> {
        self.composer.links().into_iter().find(|link| link.to == to).unwrap().trouble
    }

    fn wait_for(&self, what: &str, mut is_so: impl FnMut() -> bool) {
        let start = Instant::now();
        while !is_so() {
            assert!(start.elapsed() < Duration::from_secs(20), "{what}: {:?}", self.composer.links());
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.let_go();
        self.stopper.stop();
        self.thread.take().map(JoinHandle::join);
    }
}

#[test]
fn a_property_that_comes_while_a_module_is_late_is_linked_later() {
    for (number, mode) in [(1, Mode::Staged), (2, Mode::Threaded)] {
        let agent = Running::start(number, mode, "\"held/number\" = \"slate://other/a/number\"");
        agent.wait_for("a first step", || agent.board.read("held/seen").unwrap().is_some());
        agent.hold();
        let store = Store { capacity: 0, depth: 1, budget: Budget { latest: 4, queues: 4, window: 16 } };
        let path = "agents/other/a/number";
        let mirror = agent.board.add_channel(path, "", Number::DESCRIPTOR, store, Access::Output).unwrap();
        let mut writer = mirror.channel().unwrap().writer().unwrap();
        writer.write(View::of(&mut Number { value: 5.0 }).bytes(), 0, 0).unwrap();
        let host = agent.told.0.lock().unwrap().clone().unwrap();
        let other = RemotePath { agent: "other".into(), path: "a/number".into() };
        host.report(&other, DemandState::Served { property: "a/number".into() });
        let trouble = agent.trouble("held/number");
        assert!(trouble.as_ref().is_some_and(|text| text.contains("`held` has not returned")), "{trouble:?}");
        agent.let_go();
        agent.wait_for("the value of the other agent", || agent.seen() == 5.0);
        assert_eq!(agent.trouble("held/number"), None);
    }
}

#[test]
fn a_refused_link_leaves_nothing_behind_while_a_module_is_late() {
    for (number, mode) in [(3, Mode::Staged), (4, Mode::Threaded)] {
        let agent = Running::start(number, mode, "\"held/pair/first\" = \"counter/number/value\"");
        agent.wait_for("a first step", || agent.board.read("held/seen").unwrap().is_some());
        agent.hold();
        let link = NewLink::new("held/number", "counter/number");
        for refused in [
            agent.composer.link(&link),
            agent.composer.check_link(&link),
            agent.composer.unlink("held/pair/first"),
            agent.composer.check_unlink("held/pair/first"),
        ] {
            assert!(refused.unwrap_err().to_string().contains("`held` has not returned"));
        }
        // As a tool sets it.
        let set =
            |path: &str, value: &str| agent.composer.commit(|| agent.database.propose(&[(path, value)]));
        let refused = set("links.\"held/number\"", "counter/number").unwrap_err();
        assert!(refused.to_string().contains("`held` has not returned"), "{refused}");
        assert!(agent.database.diff().is_empty(), "{:?}", agent.database.diff());
        assert_eq!(agent.composer.links().len(), 1);
        // What it can do later it does; the change is made, and so it is said.
        assert_eq!(set("modules.held.params.factor", "2.0").unwrap().len(), 1);
        agent.let_go();
        agent.wait_for("its return", || agent.condition() == "WORKING");
        agent.composer.link(&link).unwrap();
        agent.wait_for("the new link", || agent.seen() >= 2.0);
    }
}

#[test]
fn settings_that_are_changed_while_links_wait_hold() {
    let agent = Running::start(5, Mode::Staged, "");
    agent.wait_for("a first step", || agent.board.read("held/seen").unwrap().is_some());
    agent.hold();
    // As of a file that was edited: it holds, and the link is made when that is possible.
    agent.database.set(&[("links.\"held/number\"", "counter/number")]).unwrap();
    let change = ("modules.held.params.factor", "3.0");
    let changed = agent.composer.commit(|| agent.database.propose(&[change])).unwrap();
    assert_eq!(changed.len(), 1);
    assert!(agent.trouble("held/number").unwrap().contains("`held` has not returned"));
    agent.let_go();
    agent.wait_for("the link", || agent.seen() >= 3.0);
    assert_eq!(agent.trouble("held/number"), None);
}
