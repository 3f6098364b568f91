use std::time::Duration;

use slate_runtime::configuration::Database;
use slate_runtime::snapshot::SnapshotError;
use slate_runtime::{Agent, Control, Mode, Options};

use crate::snapshot::common::{configuration, number, plugins};
use crate::snapshot::support::file;

const THREADED: &str = r#"
agent.name = "robot"
loop.period = "2ms"
loop.hang = "500ms"
[modules.counter]
every = "2ms"
[modules.relay]
[modules.receiver]
every = "20ms"
[modules.sender]
every = "3ms"
[links]
"relay/input" = "counter/number"
"receiver/notes" = "sender/note"
"receiver/history" = "counter/number"
"#;

fn threaded(text: &str) -> Agent {
    let options = Options { mode: Mode::Threaded, ..Options::default() };
    Agent::load(&configuration(text), &plugins(), options).unwrap()
}

/// Runs until the counter says so, and does `work` meanwhile.
fn run_until<R: Send>(agent: &mut Agent, count: f64, work: impl FnOnce() -> R + Send) -> R {
    std::thread::scope(|scope| {
        let worker = scope.spawn(work);
        agent
            .run(Box::new(move |cycle| {
                let reached = cycle.board.read("counter/number/value").unwrap();
                let reached =
                    reached.and_then(|(value, _)| value.as_f64()).is_some_and(|value| value >= count);
                // Not for ever.
                if reached || cycle.number > 10_000 { Control::Stop } else { Control::Continue }
            }))
            .unwrap();
        worker.join().unwrap()
    })
}

#[test]
fn modules_with_threads_of_their_own_stand_still_for_it() {
    let mut agent = threaded(THREADED);
    let composer = agent.composer();
    let path = file("threaded");
    let saved = run_until(&mut agent, 150.0, || {
        while composer.board().read("counter/number/value").unwrap().is_none() {
            std::thread::yield_now();
        }
        composer.save_snapshot(&path).unwrap()
    });
    let (time, cycle) = (saved.time(), saved.cycle());
    assert!(cycle > 0 && time > 0);
    let snapshot = slate_runtime::snapshot::Snapshot::read(&path).unwrap();
    let mut second = threaded(snapshot.configuration_text());
    second.restore(&snapshot).unwrap();
    // Nothing runs yet, and the time continues from there.
    let count = number(&second, "counter/number/value");
    assert!(count < 150.0 && count > 0.0);
    assert!(second.now() >= time);
    run_until(&mut second, count + 100.0, || ());
    assert!(number(&second, "counter/number/value") >= count + 100.0);
    // No value and no message was lost or came twice.
    let sum = |agent: &Agent| number(agent, "receiver/sum/second");
    let state = number(&second, "counter/number/value");
    let most = state * (state + 1.0) / 2.0;
    assert!(sum(&second) <= most && sum(&second) > 0.0);
}

#[test]
fn restore_during_threads_loses_no_module() {
    let mut agent = threaded(THREADED);
    let composer = agent.composer();
    run_until(&mut agent, 300.0, || {
        while composer.now() < 50_000_000 {
            std::thread::sleep(Duration::from_millis(1));
        }
        let snapshot = composer.snapshot().unwrap();
        for _ in 0..5 {
            composer.restore(&snapshot, None).unwrap();
            // Time itself went back.
            assert!(composer.now() < snapshot.time() + 10_000_000_000);
        }
    });
    assert!(number(&agent, "counter/number/value") >= 300.0, "it went on after that");
}

#[test]
fn links_and_settings_come_back_while_threads_run() {
    let database = Database::from_text("robot.toml", THREADED, Default::default()).unwrap();
    let options = Options { mode: Mode::Threaded, ..Options::default() };
    let mut agent = Agent::load_with(&database, &plugins(), options).unwrap();
    let composer = agent.composer();
    let links = composer.links();
    run_until(&mut agent, 300.0, || {
        while composer.now() < 50_000_000 {
            std::thread::sleep(Duration::from_millis(1));
        }
        let snapshot = composer.snapshot().unwrap();
        for _ in 0..5 {
            let changes = [
                ("links.\"relay/input\"", "{ from = \"counter/number\", every = 3 }"),
                ("modules.counter.params.hang_ms", "9"),
            ];
            database.set(&changes).unwrap();
            composer.restore(&snapshot, Some(&database)).unwrap();
            assert!(database.diff().is_empty());
        }
    });
    let shown: Vec<_> = composer.links().into_iter().map(|link| (link.to, link.from)).collect();
    assert_eq!(shown, links.into_iter().map(|link| (link.to, link.from)).collect::<Vec<_>>());
    assert_eq!(number(&agent, "counter/params/hang_ms"), 0.0);
    assert!(number(&agent, "counter/number/value") >= 300.0, "it went on after that");
}

#[test]
fn a_module_that_does_not_return_is_named_and_the_others_go_on() {
    let text = THREADED.replace(
        "[modules.counter]\nevery = \"2ms\"",
        "[modules.stuck]\nkind = \"counter\"\nevery = \"2ms\"\nparams = { hang_at = 3, hang_ms = 3000 }\n[modules.counter]\nevery = \"2ms\"",
    );
    let mut agent = threaded(&text);
    let composer = agent.composer();
    let error = run_until(&mut agent, 400.0, || {
        let is_late = || composer.modules().iter().any(|module| module.condition == "LATE");
        while !is_late() {
            std::thread::sleep(Duration::from_millis(1));
        }
        composer.snapshot().unwrap_err()
    });
    assert!(matches!(&error, SnapshotError::Busy { module, .. } if module == "stuck"), "{error}");
    assert!(number(&agent, "counter/number/value") >= 400.0, "nobody was kept from going on");
}
