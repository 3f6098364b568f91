use slate_runtime::snapshot::Snapshot;
use slate_runtime::{Agent, Control, Options};

use crate::snapshot::common::number;
use crate::snapshot::support::{ROBOT, file, robot};

fn run(agent: &mut Agent, cycles: u64) {
    agent
        .run(Box::new(move |cycle| if cycle.number >= cycles { Control::Stop } else { Control::Continue }))
        .unwrap();
}

#[test]
fn one_is_taken_at_a_time_and_once() {
    let path = file("at");
    let _ = std::fs::remove_file(&path);
    let mut agent = robot(&format!("{ROBOT}\n[snapshot]\nat = \"200ms\"\nfile = {:?}", path));
    run(&mut agent, 30);
    let snapshot = Snapshot::read(&path).unwrap();
    assert_eq!((snapshot.time(), snapshot.cycle()), (200_000_000, 11));
    std::fs::remove_file(&path).unwrap();
    run(&mut agent, 40);
    assert!(!path.exists(), "the time has passed");
    agent.restore(&snapshot).unwrap();
    run(&mut agent, 20);
    assert!(!path.exists(), "it goes on after that moment");
}

#[test]
fn one_is_taken_when_a_condition_becomes_true() {
    let path = file("when");
    let _ = std::fs::remove_file(&path);
    let text = format!("{ROBOT}\n[snapshot]\nwhen = \"/counter/number/value >= 7\"\nfile = {:?}", path);
    let mut agent = robot(&text);
    run(&mut agent, 12);
    let snapshot = Snapshot::read(&path).unwrap();
    assert_eq!(snapshot.cycle(), 7);
    std::fs::remove_file(&path).unwrap();
    run(&mut agent, 11);
    // After the panic in the next cycle the counter begins anew.
    assert_eq!(number(&agent, "counter/number/value"), -1.0);
    assert!(!path.exists(), "it was true all the time");
    run(&mut agent, 30);
    assert_eq!(Snapshot::read(&path).unwrap().cycle(), 20, "it has become true again");
}

#[test]
fn a_snapshot_does_not_take_the_place_of_the_log() {
    let path = file("same");
    let log = path.parent().unwrap().join(".").join(path.file_name().unwrap());
    let text = format!("{ROBOT}\n[snapshot]\nat = \"1s\"\nfile = {path:?}\n[log.targets]\nfile = {log:?}\n");
    let database = slate_runtime::configuration::Database::from_text("robot.toml", &text, Default::default());
    let agent = Agent::load_with(
        &database.unwrap(),
        &crate::snapshot::common::plugins(),
        crate::snapshot::support::options(),
    );
    let report = agent.unwrap_err().to_string();
    assert!(report.contains("a snapshot would take the place of the log"), "{report}");
}

#[test]
fn unreadable_trigger_property_is_refused() {
    for (line, words) in [
        ("at = \"1s\"", "no file"),
        ("file = \"x\"", "has no trigger"),
        ("at = \"1s\"\nfile = \"no-folder/x\"", "there is no folder"),
        ("file = \"x\"\nwhen = \"/counter/number/value\"", "none of <"),
        ("file = \"x\"\nwhen = \"/counter/number/valu > 1\"", "no field `valu`"),
        ("file = \"x\"\nwhen = \"/countr/number/value > 1\"", "no property"),
        ("file = \"x\"\nwhen = \"/counter/state/condition > 1\"", "condition"),
    ] {
        let text = format!("{ROBOT}\n[snapshot]\n{line}");
        let database =
            slate_runtime::configuration::Database::from_text("robot.toml", &text, Default::default());
        let report = match database {
            Err(report) => report.to_string(),
            Ok(database) => {
                let agent = Agent::load_with(
                    &database,
                    &crate::snapshot::common::plugins(),
                    crate::snapshot::support::options(),
                );
                agent.unwrap_err().to_string()
            }
        };
        assert!(report.contains(words), "{line}: {report}");
    }
}

#[test]
fn on_the_wall_clock_a_changing_condition_stops_no_loop() {
    let path = file("flip");
    let _ = std::fs::remove_file(&path);
    let text = format!(
        "agent.name = \"robot\"\nloop.period = \"1ms\"\n[modules.dice]\n\
         [snapshot]\nwhen = \"/dice/number/value > 0.5\"\nfile = {path:?}"
    );
    let configuration = crate::snapshot::common::configuration(&text);
    let mut agent =
        Agent::load(&configuration, &crate::snapshot::common::plugins(), Options::default()).unwrap();
    run(&mut agent, 1000);
    assert_eq!(number(&agent, "loop/state/cycles"), 1000.0);
    assert!(Snapshot::read(&path).unwrap().cycle() > 0);
}
